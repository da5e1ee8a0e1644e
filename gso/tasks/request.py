"""What is asked of a solve: one record, checked at one door."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar

import numpy as np

from gso import linalg, tasks
from gso.energy import Weighted
from gso.errors import OptionError
from gso.mesh import Mesh
from gso.quantities import Length, Strain, as_length, as_strain
from gso.tasks.options import Options
from gso.tasks.own_terms import check_own_term, kind
from gso.tasks.start import Start
from gso.typing import Array, MeshLike

#: The settings of a formulation.
O = TypeVar("O", bound=Options, covariant=True)
P = TypeVar("P", bound=Options)
#: Builds weighted terms of the user's for a design, or for a coarser copy of it.
OwnTerms = Callable[[Mesh], Iterable[Weighted]]


@dataclass(frozen=True)
class Limits:
    """Limits of a result; None where there is none.

    Attributes
    ----------
    max_deviation : float or None
        Largest distance between result and design, in both directions, in the design's unit.
    max_strain : float or None
        Largest principal strain of the pattern.
    target_curvature : float or None
        Mean absolute curvature to reach, 1/size^2.

    Raises
    ------
    OptionError
        A limit is not a positive number.

    Examples
    --------
    >>> Limits(max_deviation=2.0).given
    {'max_deviation': 2.0}
    """

    max_deviation: float | None = None
    max_strain: float | None = None
    target_curvature: float | None = None

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            number = isinstance(value, int | float | np.number)
            if value is not None and not (number and 0 < value < np.inf):
                raise OptionError(f"{name} is {value!r}; it must be a positive number")

    @property
    def given(self) -> dict[str, float]:
        """The limits that there are, by name."""
        return {name: float(value) for name, value in vars(self).items() if value is not None}

    def in_unit(self, unit: float) -> Limits:
        """Return the limits with lengths divided by a unit."""
        far = self.max_deviation
        return self if far is None else replace(self, max_deviation=far / unit)


@dataclass(frozen=True, eq=False)
class Request(Generic[O]):
    """What is asked of a solve, for any design; :func:`check` makes it.

    Attributes
    ----------
    task, formulation : str
        What to do, and which energy to minimise.
    options : Options
        Settings of the formulation.
    limits : Limits
        Limits of the result.
    start : Start
        The warm start, with its settings.
    formulation_given : bool
        Whether the user named the formulation; if not, a search may try another one.
    verdict : bool
        Whether to judge the result.
    x0 : ndarray or None
        Points of the start in the solver's frame: (n, 3), or (n, 2) for a flat image.
    max_displacement : float or None
        Largest displacement of a vertex, which searches set.
    weight_factor : float
        Factor on the weight of the task's main term (curvature, isometry), which searches vary.
    terms : tuple of callable
        Build the user's own terms, which join the objective of every stage.
    """

    task: str
    formulation: str
    options: O
    limits: Limits = Limits()
    start: Start = field(default_factory=Start)
    formulation_given: bool = True
    verdict: bool = True
    x0: Array | None = None
    max_displacement: float | None = None
    weight_factor: float = 1.0
    terms: tuple[OwnTerms, ...] = ()

    def own_items(self, mesh: Mesh, items: Iterable[Weighted]) -> list[Weighted]:
        """Build the user's own terms for a mesh in the solver's frame.

        Parameters
        ----------
        mesh : Mesh
            The design, a coarser copy of it, or one of its components, in the unit ball.
        items : iterable of Weighted
            The formulation's terms, whose names are taken.

        Raises
        ------
        OptionError
            What `terms` returns is no sequence of `gso.energy.Weighted`, a term cannot be
            evaluated, or a name is taken.
        """
        if not self.terms:
            return []
        items = list(items)
        taken, found = {item.term.name for item in items}, []
        rows = {block: len(mesh.vertices) for item in items for block, _ in item.term.stencil}
        for build in self.terms:
            built = build(mesh)
            if not isinstance(built, Iterable):
                raise OptionError(
                    f"terms: {build!r} returns {kind(built)}; it must return a list of "
                    "gso.energy.Weighted"
                )
            for item in built:
                if not isinstance(item, Weighted):
                    raise OptionError(f"terms: {kind(item)} is no gso.energy.Weighted")
                check_own_term(item, rows)
                if item.term.name in taken:
                    raise OptionError(
                        f"terms: the name {item.term.name!r} is that of a term of the formulation; "
                        "choose another one"
                    )
                found.append(item)
        return found

    def in_frame(self, scale: float, x0: Array | None) -> Request[O]:
        """Return the request for a design in the unit ball.

        Parameters
        ----------
        scale : float
            Radius of the ball, in the design's unit.
        x0 : ndarray or None
            Points of the start, in the solver's frame and numbering.
        """
        options, limits = self.options.in_unit(scale), self.limits.in_unit(scale)
        return replace(self, options=options, limits=limits, x0=x0)

    def with_options(self, options: P) -> Request[P]:
        """Return the request with the settings of any formulation."""
        own: Request[Any] = self
        return replace(own, options=options)


def check(
    task: str,
    formulation: str | None = None,
    options: str | Options | None = None,
    *,
    max_deviation: Length | None = None,
    max_strain: Strain | None = None,
    target_curvature: float | None = None,
    x0: MeshLike | Start | None = None,
    terms: Sequence[OwnTerms] = (),
    verdict: bool = True,
    diagonal: float = 1.0,
    unit: str = "mm",
) -> Request[Options]:
    """Check what :func:`gso.tno.optimize` is asked for, as far as it does not depend on the mesh.

    Of the mesh, it only needs the `diagonal` of its bounding box, and the `unit` of its
    coordinates, where `max_deviation` is a text.

    Raises
    ------
    OptionError
        Something is unknown or contradictory.
    BackendError
        The requested backend is not installed.

    Examples
    --------
    >>> request = check("flatten", options="jiang2020")
    >>> request.formulation, request.options.iterations
    ('isometry', 60)
    """
    name, chosen = tasks.choose(task, formulation, options)
    settings = chosen.options.coerce(options)
    if settings.backend is not None:
        linalg.find(settings.backend)
    far = max_deviation
    limits = Limits(
        None if far is None else as_length(far, "max_deviation", diagonal=diagonal, unit=unit),
        None if max_strain is None else as_strain(max_strain, "max_strain"),
        target_curvature,
    )
    start = x0 if isinstance(x0, Start) else Start(x0)
    known = {limit: f for f, kind in tasks.get(task).formulations.items() for limit in kind.limits}
    for limit in limits.given:
        if limit not in known:
            raise OptionError(f"{limit} belongs to task 'developable', not {task!r}")
        if limit not in chosen.limits:
            raise OptionError(f"{limit} belongs to the formulation {known[limit]!r}, not {name!r}")
    for limit in limits.given:
        if limits.target_curvature is not None and limit != "target_curvature":
            raise OptionError(f"give {limit} or target_curvature, not both")
        if start.iterations is not None and limit != "max_deviation":
            raise OptionError(
                f"{limit} takes many solves, which the iterations of a start would cut off; "
                "leave one of them out"
            )
    own = checked_terms(terms, f"formulation {name!r} of task {task!r}", takes=chosen.terms)
    # Another formulation, which a search may try, would not have these terms.
    given = formulation is not None or bool(own)
    return Request(task, name, settings, limits, start, given, verdict, terms=own)


def checked_terms(
    terms: Sequence[OwnTerms], asked: str, *, takes: bool = False
) -> tuple[OwnTerms, ...]:
    """Return the builders of the user's terms as a tuple.

    Parameters
    ----------
    terms : sequence of callable
    asked : str
        What is asked for, in words.
    takes : bool
        Whether it takes such terms.

    Raises
    ------
    OptionError
        It does not, or `terms` is no sequence of callables.
    """
    if callable(terms) or not isinstance(terms, Sequence) or not all(map(callable, terms)):
        raise OptionError(f"terms is {terms!r}; it must be a list of callables")
    if terms and not takes:
        able = ", ".join(
            f"{task!r} by {name!r}"
            for task in tasks.names()
            for name, one in tasks.get(task).formulations.items()
            if one.terms
        )
        raise OptionError(f"{asked} takes no terms; these do: {able}")
    return tuple(terms)

"""What is asked of a solve: one record, checked at one door."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

from gso import linalg, tasks
from gso.errors import OptionError
from gso.tasks.options import Options
from gso.typing import Array

if TYPE_CHECKING:
    from gso.io.convert import MeshLike

#: The settings of a formulation.
O = TypeVar("O", bound=Options, covariant=True)
P = TypeVar("P", bound=Options)


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


@dataclass(frozen=True)
class Start:
    """A warm start for :func:`gso.tno.optimize`, with settings on how it is used.

    Attributes
    ----------
    points : Mesh, array_like or None
        As `x0`; None for the optimiser's own start.
    source : str
        Origin of the start, reported as the result's `warm_start`.
    guarded : bool
        "developable", "flatten": drop the start if its energy is above that of the
        optimiser's own start, or if it has inverted cells in a flat image. The result is then
        the same as without it.
    iterations : int, optional
        Largest number of iterations over all stages. With `points`, they are reserved for the
        last stage first.
    tolerance : float
        With `points`, stages stop when an iteration lowers the energy by less than this share
        of it, or than the options' tolerance where that is larger.

    Raises
    ------
    OptionError
        `iterations` is not a whole number of 0 or more, or `tolerance` is negative or no number.

    Examples
    --------
    >>> import gso
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9), indexing="ij")
    >>> saddle = np.stack([u, v, 0.3 * u * v], axis=-1)
    >>> guess = Start(2 * saddle, source="guess", guarded=True, iterations=5)
    >>> result = gso.tno.optimize(saddle, x0=guess)
    >>> result.warm_start, result.iterations <= 5
    ('cold', True)
    """

    points: MeshLike | None = None
    source: str = "x0"
    guarded: bool = False
    iterations: int | None = None
    tolerance: float = 0.0

    def __post_init__(self) -> None:
        if not (isinstance(self.tolerance, int | float | np.number) and self.tolerance >= 0):
            raise OptionError(f"tolerance is {self.tolerance!r}; take a number, 0 or more")
        most = self.iterations
        if most is None:
            return
        if isinstance(most, bool) or not isinstance(most, int | np.integer) or most < 0:
            raise OptionError(
                f"iterations is {most!r}; take a whole number from 0 up, or None for no limit"
            )


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
    """

    task: str
    formulation: str
    options: O
    limits: Limits = Limits()
    start: Start = Start()
    formulation_given: bool = True
    verdict: bool = True
    x0: Array | None = None
    max_displacement: float | None = None
    weight_factor: float = 1.0

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
    max_deviation: float | None = None,
    max_strain: float | None = None,
    target_curvature: float | None = None,
    x0: MeshLike | Start | None = None,
    verdict: bool = True,
) -> Request[Options]:
    """Check what :func:`gso.tno.optimize` is asked for, as far as it does not depend on the mesh.

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
    limits = Limits(max_deviation, max_strain, target_curvature)
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
    given = formulation is not None
    return Request(task, name, settings, limits, start, given, verdict)

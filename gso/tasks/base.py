"""The interface between tasks and optimiser: a task turns a request into a plan of stages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from gso import parametrization
from gso.constraints import Compiled
from gso.energy import Limit, Weighted
from gso.energy.losses import Loss
from gso.mesh import Mesh
from gso.mesh.cut import Cut
from gso.pattern import Pattern
from gso.status import Status
from gso.tasks.options import Options
from gso.tasks.stage_constraints import StageConstraints
from gso.typing import Array
from gso.unknowns import Layout, Variables

if TYPE_CHECKING:
    from gso.tasks.request import Request

#: The settings of a formulation.
O = TypeVar("O", bound=Options)


def same(coordinates: Array) -> Array:
    """Return the coordinates unchanged."""
    return coordinates


class Analysis:
    """A design and its constraints, with what its plans need to know about them.

    It is made once for a design; tasks derive from it. Quantities are computed when first used.

    Parameters
    ----------
    mesh : Mesh
        The design, scaled to the unit ball, with grids numbered row by row.
    constraints : Compiled
        Hard and soft constraints on it.
    """

    def __init__(self, mesh: Mesh, constraints: Compiled):
        self.mesh, self.constraints = mesh, constraints

    @cached_property
    def imposed(self) -> StageConstraints:
        """The constraints as eliminated unknowns and terms."""
        return StageConstraints(self.constraints)

    @cached_property
    def opened(self) -> parametrization.Opened:
        """The design, cut open where it closes around itself, ready to be flattened."""
        return parametrization.opened(self.mesh)

    def opened_for(self, request: Request[Options]) -> parametrization.Opened:
        """Return the design ready to be flattened.

        Constraints and warm starts refer to the vertices of the uncut design: with them it is
        not cut.
        """
        if request.x0 is not None or not self.constraints.empty:
            return parametrization.Opened(self.mesh)
        return self.opened


@dataclass(frozen=True)
class Stage:
    """One solve of a continuation or coarse-to-fine sequence.

    Attributes
    ----------
    name : str
        Name in the progress and the history.
    layout : Layout
        Blocks of its coordinates.
    own_items : sequence of Weighted
        Weighted terms of its objective, without those of constraints.
    variables : callable
        Builds the unknowns from the coordinates at the start of the stage.
    enter : callable
        Maps the final coordinates of the stage before to the initial ones of this stage.
    iterations, tolerance : int, float
        Largest number of iterations, and relative decrease of the energy at which to stop.
    continuation : sequence of Loss
        Losses by iteration of the terms named `continued`. The last one holds for all later
        iterations and for the energy of the result.
    continued : str
        Name of the terms that `continuation` refers to.
    limits : sequence of Limit
        Bounds on the step length, such as "no triangle is inverted".
    bounds : callable, optional
        Computes the lower and upper bounds of all unknowns from the coordinates at the start of
        the stage.
    finished : callable, optional
        Stopping test of the sequence: tells from the coordinates at the end of the stage whether
        the remaining stages can be skipped.
    imposed : StageConstraints, optional
        Constraints on the stage's coordinates.
    moving : callable, optional
        As `variables`, for the first iteration after a handle has moved: fewer unknowns, for a
        faster answer. Those of the stage where not given.
    """

    name: str
    layout: Layout
    own_items: Sequence[Weighted]
    variables: Callable[[Array], Variables]
    enter: Callable[[Array], Array] = same
    iterations: int = 10
    tolerance: float = 1e-4
    continuation: Sequence[Loss] = ()
    continued: str = ""
    limits: Sequence[Limit] = ()
    bounds: Callable[[Array], tuple[Array, Array]] | None = None
    finished: Callable[[Array], bool] | None = None
    imposed: StageConstraints | None = None
    moving: Callable[[Array], Variables] | None = None

    @property
    def items(self) -> list[Weighted]:
        """All weighted terms of the objective, those of the constraints last."""
        return [*self.own_items, *(() if self.imposed is None else self.imposed.terms)]

    def unknowns(self, coordinates: Array, *, moving: bool = False) -> Variables:
        """Build the unknowns, without those that hard linear constraints eliminate."""
        build = self.moving if moving and self.moving is not None else self.variables
        variables = build(coordinates)
        return variables if self.imposed is None else self.imposed.eliminate(variables)


@dataclass(frozen=True)
class Plan:
    """Stages to solve, or a result that needs no solve.

    Attributes
    ----------
    layout : Layout
        Blocks of the result: "surface", "flat", or both.
    start : ndarray
        Coordinates before the first stage.
    stages : sequence of Stage
        Solved in order. The energy of the result is the objective of the last one solved.
    status : Status, optional
        Status of the result where the task knows it beforehand, as for a design that is good
        already.
    notes : sequence of str
        Messages to the user.
    details : dict
        Numbers that the task adds to the result.
    fallback : ndarray, optional
        Coordinates returned instead of the result if their energy, by the last objective, is
        lower.
    fallback_energy : dict, optional
        Their objective of the last stage by term, where it is known.
    finish : callable
        Post-processing of the coordinates that leaves the objective unchanged, such as the
        placement of a flat image.
    result_notes : callable, optional
        Computes more messages to the user from the coordinates of the result.
    spline : (int, int), optional
        Control points along both sides, if the last stage makes the surface a B-spline.
    cold_start : callable, optional
        With a warm start: computes the coordinates, in the layout of the last stage, from which
        a cold start would begin.
    start_refused : str
        Why the user's start is not used; empty if it is.
    cut : Cut, optional
        The cuts made to open the design. The flat image is then that of the cut mesh, in its
        numbering.
    edited : Stage, optional
        What a session iterates while handles move; the last stage where not given.
    further : callable, optional
        Builds another stage on the coordinates of the last one, or returns None if they need none.
        Its first argument is the number of such stages before. Solves without a verdict, and
        batches, leave them out.
    """

    layout: Layout
    start: Array
    stages: Sequence[Stage] = ()
    status: Status | None = None
    notes: Sequence[str] = ()
    details: dict[str, Any] = field(default_factory=dict)
    finish: Callable[[Array], Array] = same
    fallback: Array | None = None
    fallback_energy: dict[str, float] | None = None
    result_notes: Callable[[Array], list[str]] | None = None
    spline: tuple[int, int] | None = None
    cold_start: Callable[[], Array] | None = None
    start_refused: str = ""
    cut: Cut | None = None
    edited: Stage | None = None
    further: Callable[[int, Array], Stage | None] | None = None


@dataclass
class Solution:
    """Final coordinates of a plan, with their status and energy.

    Attributes
    ----------
    blocks : dict of str to ndarray
        The result's blocks of coordinates by name.
    status : Status
        Why the solve ended.
    energy : dict of str to float
        The objective by term.
    backend : str
        Linear backend of the last stage.
    notes, details
        As in the plan.
    spline : ndarray, (p, q, 3), optional
        Control points, where the unknowns of the last stage were those of a B-spline surface.
    fitted : ndarray, (n, 3), optional
        Vertices that the first spline of that stage was fitted to.
    cut : Cut, optional
        As in the plan.
    stage : Stage, optional
        The stage that was solved last; None if none was.
    coordinates : ndarray
        Coordinates at its end, before the plan's post-processing.
    formulation : str
        The formulation, where the solve was of a request.
    """

    blocks: dict[str, Array]
    status: Status
    energy: dict[str, float]
    coordinates: Array
    backend: str = ""
    notes: tuple[str, ...] = ()
    details: dict[str, Any] = field(default_factory=dict)
    spline: Array | None = None
    fitted: Array | None = None
    cut: Cut | None = None
    stage: Stage | None = None
    formulation: str = ""

    @property
    def points(self) -> Array:
        """Its surface (n, 3), or its flat image (n, 2) where it has no surface."""
        return self.blocks["surface"] if "surface" in self.blocks else self.blocks["flat"]


class Runner(Protocol):
    """Solver of the requests of one task for one design, as a search sees it."""

    @property
    def analysis(self) -> Analysis:
        """The task's analysis of the design."""

    def __call__(self, request: Request[Options]) -> Solution:
        """Plan and solve."""

    def usable_start(self, *requests: Request[Options]) -> bool:
        """Return whether the start of these requests, which differ in bounds, is to be used."""

    def evaluate(self, solution: Solution, blocks: dict[str, Array]) -> Solution:
        """Return a solution at other coordinates, with the energy that they have."""

    def lay_out(self, surface: Mesh) -> Pattern | None:
        """Flatten a surface; None where it cannot be flattened."""


@dataclass(frozen=True)
class Formulation(Generic[O]):
    """An energy that a task can minimise.

    Attributes
    ----------
    options : type
        Class of its settings.
    plan : callable
        Makes the plan, from the task's analysis of the design and the request in its frame.
    presets : tuple of str
        Names of presets that imply this formulation.
    limits : tuple of str
        Names of the :class:`gso.tasks.request.Limits` that it takes.
    search : callable, optional
        Finds the solution for a request with limits.
    before : callable, optional
        Returns the request, by another formulation, whose result a solve improves; None where it
        starts from something else.
    terms : bool
        Whether its plans add the user's own terms, :meth:`gso.tasks.request.Request.own_items`.
    """

    options: type[O]
    plan: Callable[[Any, Request[O]], Plan]
    presets: tuple[str, ...] = ()
    limits: tuple[str, ...] = ()
    search: Callable[[Runner, Request[O]], Solution] | None = None
    before: Callable[[Request[O]], Request[Any] | None] | None = None
    terms: bool = False


@dataclass(frozen=True)
class Task:
    """What can be done with a design.

    Attributes
    ----------
    formulations : dict of str to Formulation
        The first is the default.
    metrics : callable
        ``metrics(design, result, flat, scale)`` returns values by the names in
        :data:`gso.metrics.INFO`, from a component before and after, its flat image (n, 2) or
        None, and its size.
    flat : bool
        Whether the result is a flat image, to which start and constraints refer.
    lengths : tuple of str
        Names of those `details` of its plans that are lengths.
    analysis : type
        Derived from :class:`Analysis`, if its plans need more than that.
    pattern_metrics : callable, optional
        Metrics of the pattern (n, 2) of a surface, if its result is a surface that can be laid
        flat.
    others : callable, optional
        Returns other requests to solve, in turn, where the result of one is not usable. Its last
        argument is whether more is wrong than the distance.
    """

    formulations: Mapping[str, Formulation[Any]]
    metrics: Callable[[Mesh, Mesh, Any, float], dict[str, float]]
    flat: bool = False
    lengths: tuple[str, ...] = ()
    analysis: type[Analysis] = Analysis
    pattern_metrics: Callable[[Mesh, Array], dict[str, float]] | None = None
    others: Callable[[Any, Request[Any], bool], Iterator[Request[Any]]] | None = None

    @property
    def options(self) -> type[Options]:
        """Class of the default formulation's settings."""
        kind: type[Options] = next(iter(self.formulations.values())).options
        return kind

    def plan(self, analysis: Analysis, request: Request[Options]) -> Plan:
        """Plan a request in the frame of an analysed design."""
        return self.formulations[request.formulation].plan(analysis, request)


__all__ = [
    "Analysis",
    "Formulation",
    "Options",
    "Plan",
    "Runner",
    "Solution",
    "Stage",
    "Task",
    "same",
]

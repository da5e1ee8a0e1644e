"""The interface between tasks and optimiser: a task turns a request into a plan of stages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from gso import parametrization
from gso.constraints import Compiled
from gso.energy import Limit, Weighted
from gso.mesh import Mesh
from gso.mesh.cutting import Cut
from gso.status import Status
from gso.tasks.options import Options
from gso.typing import Array
from gso.unknowns import Layout, Variables


def same(coordinates: Array) -> Array:
    """Return the coordinates unchanged."""
    return coordinates


@dataclass
class Stage:
    """One solve of a continuation or coarse-to-fine sequence.

    Attributes
    ----------
    name : str
        Name in the progress and the history.
    layout : Layout
        Blocks of its coordinates.
    items : list of Weighted
        Weighted terms of its objective.
    variables : callable
        Builds the unknowns from the coordinates at the start of the stage.
    enter : callable
        Maps the final coordinates of the stage before to the initial ones of this stage.
    iterations, tolerance : int, float
        Largest number of iterations, and relative decrease of the energy at which to stop.
    eps : sequence of float
        Smoothing of the absolute value in the terms named `robust`, one value per iteration.
    robust : str
        Name of the terms that use `eps`.
    limits : sequence of Limit
        Bounds on the step length, such as "no triangle is inverted".
    bounds : callable, optional
        Computes the lower and upper bounds of all unknowns from the coordinates at the start of
        the stage.
    enough : callable, optional
        Stopping test of the continuation: tells from the coordinates at the end of the stage
        whether the remaining stages can be skipped.
    """

    name: str
    layout: Layout
    items: list[Weighted]
    variables: Callable[[Array], Variables]
    enter: Callable[[Array], Array] = same
    iterations: int = 10
    tolerance: float = 1e-4
    eps: Sequence[float] = ()
    robust: str = ""
    limits: Sequence[Limit] = ()
    bounds: Callable[[Array], tuple[Array, Array]] | None = None
    enough: Callable[[Array], bool] | None = None


@dataclass
class Request:
    """A user's problem, scaled to the unit ball, with grids numbered row by row.

    Attributes
    ----------
    mesh : Mesh
        The design.
    options : Options
        Settings of the task.
    formulation : str
        Which energy to minimise.
    constraints : Compiled
        Hard and soft constraints.
    start : ndarray or None
        Warm start: (n, 3), or (n, 2) for a flat image.
    max_deviation : float or None
        Largest distance from the design.
    demand : float
        Factor on the weight of the task's main term (curvature, isometry), which searches vary.
    """

    mesh: Mesh
    options: Any
    formulation: str
    constraints: Compiled
    start: Array | None = None
    max_deviation: float | None = None
    demand: float = 1.0

    @property
    def reach(self) -> float | None:
        """Bound on the displacement: `max_deviation`, reduced by a tiny margin for rounding."""
        return None if self.max_deviation is None else self.max_deviation * (1.0 - 1e-7)


@dataclass
class Plan:
    """Stages to solve, or a result that needs no solve.

    Attributes
    ----------
    layout : Layout
        Blocks of the result: "surface", "flat", or both.
    start : ndarray
        Coordinates before the first stage.
    stages : list of Stage
        Solved in order. The energy of the result is the objective of the last one solved.
    status : Status, optional
        Status of the result where the task knows it beforehand, as for a design that is good
        already.
    notes : list of str
        Messages to the user.
    details : dict
        Numbers that the task adds to the result.
    fallback : ndarray, optional
        Coordinates returned instead of the result if their energy, by the last objective, is
        lower.
    finish : callable
        Post-processing of the coordinates that leaves the objective unchanged, such as the
        placement of a flat image.
    remark : callable, optional
        Computes more messages to the user from the coordinates of the result.
    spline : (int, int), optional
        Control points along both sides, if the last stage makes the surface a B-spline.
    unstarted : callable, optional
        With a warm start: computes the coordinates, in the layout of the last stage, from which
        a cold start would begin.
    refused : str
        Why the user's start is not used; empty if it is.
    cut : Cut, optional
        The cuts made to open the design. The flat image is then that of the cut mesh, in its
        numbering.
    """

    layout: Layout
    start: Array
    stages: list[Stage] = field(default_factory=list)
    status: Status | None = None
    notes: list[str] = field(default_factory=list)
    details: dict[str, Any] = field(default_factory=dict)
    finish: Callable[[Array], Array] = same
    fallback: Array | None = None
    remark: Callable[[Array], list[str]] | None = None
    spline: tuple[int, int] | None = None
    unstarted: Callable[[], Array] | None = None
    refused: str = ""
    cut: Cut | None = None

    def entered(self) -> Array:
        """Compute the initial coordinates of the last stage if no stage before it is solved."""
        coordinates = self.start
        for stage in self.stages:
            coordinates = stage.enter(coordinates)
        return coordinates


def open_up(request: Request) -> parametrization.Opened:
    """Cut the design open where it closes around itself, ready to be flattened.

    Constraints and warm starts refer to the vertices of the uncut design: with them it is not
    cut.
    """
    if request.start is not None or not request.constraints.empty:
        return parametrization.Opened(request.mesh)
    return parametrization.opened(request.mesh)


__all__ = ["Options", "Plan", "Request", "Stage", "open_up", "same"]

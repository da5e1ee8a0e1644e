"""How a task tells the optimiser what to do: a request in, a plan of stages out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gso.constraints import Compiled
from gso.mesh import Mesh
from gso.status import Status
from gso.tasks.options import Options
from gso.terms import Limit, Weighted
from gso.variables import Layout, Variables

Array = NDArray[np.float64]


def same(coordinates: Array) -> Array:
    """Take over the coordinates as they are."""
    return coordinates


@dataclass
class Stage:
    """One solve of a coarse-to-fine sequence.

    Attributes
    ----------
    name : str
        What it is called in the progress and the history.
    layout : Layout
        Its coordinates.
    items : list of Weighted
        Its objective.
    variables : callable
        Makes the unknowns from the coordinates at its start.
    enter : callable
        Makes its coordinates from those of the stage before.
    iterations, tolerance : int, float
        When to stop.
    eps : sequence of float
        Smoothing of the absolute value by iteration, for the terms named `robust`.
    robust : str
        Name of that term.
    limits : sequence of Limit
        What a step must not cross.
    bounds : callable, optional
        Smallest and largest value of every unknown, from the coordinates at its start.
    enough : callable, optional
        Whether the coordinates at its end make the stages after it needless.
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
    """What the user wants, in the unit ball and with grids numbered row by row.

    Attributes
    ----------
    mesh : Mesh
        The design.
    options : Options
        Settings of the task.
    formulation : str
        Which energy.
    constraints : Compiled
        What must hold.
    start : ndarray or None
        Where to start: (n, 3), or (n, 2) for a flat image.
    max_deviation : float or None
        Largest distance from the design.
    demand : float
        Factor on the weight of what the task asks for, for searches.
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
        """Bound on the displacement: a hair inside what was asked for."""
        return None if self.max_deviation is None else self.max_deviation * (1.0 - 1e-7)


@dataclass
class Plan:
    """What to do: stages to solve, or a result that is there already.

    Attributes
    ----------
    layout : Layout
        Blocks of the result: "surface", "flat", or both.
    start : ndarray
        Coordinates before the first stage.
    stages : list of Stage
        Solved in order; the last one's objective is the result's energy.
    status : Status, optional
        Set when there is nothing to solve.
    notes : list of str
        What the user should know.
    details : dict
        Numbers the task wants in the result.
    fallback : ndarray, optional
        Coordinates that the result must not be worse than, by the last objective.
    finish : callable
        What is done to the coordinates after the last stage without changing the
        objective: a flat image is put in its place.
    remark : callable, optional
        What the user should know of the coordinates of the result.
    spline : (int, int), optional
        Control points along both sides, where the last stage makes the surface a B-spline.
    unstarted : callable, optional
        Where a start was given: coordinates of the last stage that a solve without it would
        begin from.
    refused : str
        Why a start that was given is not used.
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

    def entered(self) -> Array:
        """Coordinates of the last stage when nothing is solved before it."""
        coordinates = self.start
        for stage in self.stages:
            coordinates = stage.enter(coordinates)
        return coordinates


__all__ = ["Options", "Plan", "Request", "Stage", "same"]

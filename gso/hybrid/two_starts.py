"""The better of two starts for a large grid: the design itself, and a net's result.

Which of the two ends in the lower minimum is decided on a grid of the net's size, where both
solves take little of the time of the whole.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from gso.hierarchy import coarser, resample
from gso.mesh import Mesh
from gso.result import Result
from gso.tasks.developable import NEAR, Options
from gso.tno import Start
from gso.typing import Array

#: Tolerance of both solves, as that of the coarser grids of a cold solve.
_LOOSE = 1e-3


def better_start(
    design: Mesh,
    points: Array,
    resolution: int,
    options: Options,
    optimize: Callable[..., Result],
    judged: bool = True,
) -> Start | None:
    """Solve a coarser copy of a grid from the design and from a net's result.

    Parameters
    ----------
    design : Mesh
        A grid.
    points : ndarray, (n, 3)
        The net's result at the design's vertices.
    resolution : int
        Largest number of vertices along the longer side of the copy.
    options : Options
        Settings of the solve; the copies are solved with offsets along normals.
    optimize : callable
        :func:`gso.tno.optimize`, with the task and the formulation.
    judged : bool
        Whether a result that is too far from the design is solved again, near it. Then a minimum
        that is near enough counts as the lower one.

    Returns
    -------
    Start or None
        The lower minimum, carried to the design's vertices; its `source` says where it came from,
        "net" or "cold". It has no points where both are too far away. None where there is no such
        copy.
    """
    copies = coarser(design, resolution)
    index = design.grid_index
    shape = copies[0].grid_shape if copies else None
    if index is None or shape is None or max(shape) > resolution:
        return None
    copy = copies[0]
    seen = resample(points[index], *shape).reshape(-1, 3)
    quick = replace(options, variables="normal", tolerance=max(options.tolerance, _LOOSE))
    net = Start(seen, source="net", resolution=resolution)
    solves = [optimize(copy, options=quick, verdict=False, x0=x0) for x0 in (None, net)]
    best = min(solves, key=lambda solve: (judged and _far(solve), sum(solve.energy.values())))
    if judged and _far(best):
        # What follows is another solve, near the design: the same as after a cold one.
        return Start()
    shift = (best.mesh.vertices - copy.vertices)[copy.grid_index]
    moved = design.vertices.copy()
    moved[index] += resample(shift, *index.shape)
    source = "net" if best is solves[1] else "cold"
    return Start(moved, source=source, resolution=max(shape), solved=True)


def _far(result: Result) -> bool:
    """Return whether a result is farther from its design than one without limits may be."""
    return result.deviation > NEAR * result.design.size

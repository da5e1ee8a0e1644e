"""The solve of a design cut into pieces: each piece developable, the seams closed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from gso.constraints import Constraint, Glue, SmoothCurves
from gso.cut_pieces import Pieces
from gso.errors import OptionError
from gso.mesh import Mesh
from gso.mesh.cut import Cut
from gso.pipeline.judgement import judged
from gso.pipeline.solve import Asked, solve_mesh
from gso.pipeline.start import Start
from gso.result import Result
from gso.seams import joint_bounds
from gso.seams.chains import chains
from gso.solver import Callback
from gso.typing import Ints
from gso.verdict import Limits

#: Weight of the smoothness of seams.
_SMOOTH = 8e-6
#: Cosine of the turn of a seam on a quad mesh from which on it is a corner.
_CORNER = 0.7


def constraints_of(pieces: Pieces) -> list[Constraint]:
    """Return what keeps the seams of pieces closed, and smooth."""
    opened = pieces.opened
    pairs = np.unique(np.sort(opened.seams.transpose(0, 2, 1).reshape(-1, 2), axis=1), axis=0)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    if not len(pairs):
        return []
    lines = [line for _, line in chains(pieces.edges, pieces.sides)]
    if not pieces.design.has_triangles:
        # A corner of a quad would lose its angle if the seam became smooth there.
        lines = [part for line in lines for part in _straight(pieces.design, line)]
    lines = [line for line in lines if len(line) > 2]
    out: list[Constraint] = [Glue(pairs)]
    return [*out, SmoothCurves(lines, _SMOOTH)] if lines else out


def _straight(mesh: Mesh, line: Ints) -> list[Ints]:
    """Divide a chain of vertices at its corners."""
    way = np.diff(mesh.vertices[line], axis=0)
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
    corner = np.flatnonzero(np.einsum("ij,ij->i", way[1:], way[:-1]) < _CORNER) + 1
    ends = [0, *corner.tolist(), len(line) - 1]
    return [line[a : b + 1] for a, b in pairwise(ends)]


def solved(
    pieces: Pieces,
    task: str,
    constraints: Sequence[Constraint],
    start: Start,
    solve: Callable[[Mesh, Sequence[Constraint], Start], Result],
) -> Result:
    """Solve a design cut into pieces.

    Parameters
    ----------
    pieces : Pieces
    task : str
        The task: "developable", or "flatten" for the patterns of the pieces as they are.
    constraints : sequence of Constraint
        In the numbering of the design.
    start : Start
        In the numbering of the design.
    solve : callable
        Solves a mesh with constraints from a start.

    Returns
    -------
    Result
        Its design and mesh are cut open; `pieces` has the result's.
    """
    if task not in ("developable", "flatten"):
        raise OptionError(
            f"task {task!r} does not take pieces; give it the whole design, pieces.design"
        )
    design = pieces.opened.mesh
    joined = constraints_of(pieces) if task == "developable" else []
    if start.points is not None:
        points = np.asarray(getattr(start.points, "vertices", start.points), float)
        if len(points) == len(pieces.design.vertices):
            start = replace(start, points=points[pieces.opened.vertex])
    result = solve(design, [*joined, *constraints], start)
    # Advice to join what was cut open is no use here.
    own = tuple(note for note in result.notes if note not in design.notes)
    result.notes = pieces.design.notes + own
    if task == "developable":
        result.pieces = moved(pieces, result.mesh)
    return result


def moved(pieces: Pieces, surface: Mesh) -> Pieces:
    """Return the pieces with the vertices of a surface that is cut open, (p, 3)."""
    vertex = pieces.opened.vertex
    points = pieces.design.vertices.copy()
    points[vertex] = surface.vertices
    opened = Cut(surface, vertex, pieces.opened.seams)
    return Pieces(pieces.design.replaced(points), opened, pieces.names)


def gap(surface: Mesh, seams: Ints) -> float:
    """Return the largest distance between the two copies of a vertex on a seam."""
    one, two = (surface.vertices[seams[:, k]] for k in (0, 1))
    return float(np.linalg.norm(one - two, axis=2).max(initial=0.0))


def solve_pieces(
    pieces: Pieces,
    asked: Asked,
    constraints: Sequence[Constraint],
    start: Start,
    callback: Callback | None,
) -> Result:
    """Solve a design in pieces, within a distance of it where one is given."""

    def solve(what: Asked) -> Result:
        one = partial(solve_mesh, what, callback)
        return solved(pieces, what.task, constraints, start, one)

    allowed = asked.bounds.get("max_deviation")
    if allowed is None:
        return solve(asked)
    bounds = {**asked.bounds, "max_deviation": None}
    free = replace(asked, bounds=bounds, verdict=False)
    result = solve(free) if free.bounded else None
    # A bound on strain or curvature is met with the least displacement, which may be too much.
    if result is None or joint_bounds.deviation(pieces, result) > allowed:
        free = replace(free, bounds=dict.fromkeys(bounds))
        result = joint_bounds.within(
            pieces, allowed, asked.options, lambda options: solve(replace(free, options=options))
        )
    if asked.verdict:
        limits: dict[str, Any] = dict(asked.bounds)
        result = judged(result, Limits(**limits))
    return result

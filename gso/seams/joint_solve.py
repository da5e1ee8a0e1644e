"""The solve of a design cut into pieces: each piece developable, the seams closed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from gso.constraints import Constraint, Glue, SmoothCurves
from gso.cut_pieces import Pieces
from gso.errors import MeshError, OptionError
from gso.mesh import Cut, Mesh
from gso.pipeline import add_verdict
from gso.pipeline.component_solves import solve_mesh
from gso.result import Result
from gso.seams import joint_bounds
from gso.seams.chains import chains
from gso.seams.design_constraints import of_design
from gso.solver import Callback
from gso.tasks import Limits
from gso.tasks.base import Options
from gso.tasks.request import Request
from gso.typing import Ints

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


def solve_pieces(
    pieces: Pieces,
    request: Request[Options],
    constraints: Sequence[Constraint] = (),
    callback: Callback | None = None,
) -> Result:
    """Solve a design in pieces, within a distance of it where one is given.

    Parameters
    ----------
    pieces : Pieces
    request : Request
        Its task is "developable", or "flatten" for the patterns of the pieces as they are. Its
        start is in the numbering of the design.
    constraints : sequence of Constraint
        On the design: its boundary does not include the seams. Those of flat patterns are on the
        mesh that is cut open.
    callback : callable, optional
        Called after every iteration.

    Returns
    -------
    Result
        Its design and mesh are cut open; `pieces` has the result's.

    Raises
    ------
    MeshError
        No vertex is inside a piece. Where only some components have none, these stay as they are.
    """
    if request.task not in ("developable", "flatten"):
        raise OptionError(
            f"task {request.task!r} does not take pieces; give it the whole design, pieces.design"
        )
    allowed = request.limits.max_deviation
    if allowed is None:
        return _solve(pieces, constraints, callback, request)
    free = replace(request, limits=replace(request.limits, max_deviation=None), verdict=False)
    solve = partial(_solve, pieces, constraints, callback)
    result = solve(free) if free.limits.given else None
    # A limit on strain or curvature is met with the least displacement, which may be too much.
    if result is None or joint_bounds.deviation(pieces, result) > allowed:
        free = replace(free, limits=Limits())
        result = joint_bounds.within(
            pieces, allowed, free.options, lambda options: solve(free.with_options(options))
        )
    return add_verdict(result, request.limits) if request.verdict else result


def _solve(
    pieces: Pieces,
    constraints: Sequence[Constraint],
    callback: Callback | None,
    request: Request[Options],
) -> Result:
    """Solve pieces, which are close to the design by the weights of the energy only."""
    design = pieces.opened.mesh
    if request.task == "developable" and not design.stars:
        raise MeshError("no vertex is inside a piece, so no piece has curvature; refine the mesh")
    wanted = list(constraints)
    if request.task == "developable":
        wanted = [*constraints_of(pieces), *of_design(constraints, pieces.design)]
    start = request.start
    if start.points is not None:
        points = np.asarray(getattr(start.points, "vertices", start.points), float)
        if len(points) == len(pieces.design.vertices):
            start = replace(start, points=points[pieces.opened.vertex])
    result = solve_mesh(replace(request, start=start), design, wanted, callback)
    # Advice to join what was cut open is no use here.
    own = tuple(note for note in result.notes if note not in design.notes)
    result.notes = pieces.design.notes + own
    if request.task == "developable":
        result.pieces = _with_vertices(pieces, result.mesh)
    return result


def _with_vertices(pieces: Pieces, surface: Mesh) -> Pieces:
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

"""Coarser copies of a design, with its constraints, on which a solve begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gso.components import several
from gso.constraints import Compiled, Pins
from gso.constraints.equations import Part
from gso.errors import MeshError
from gso.hierarchy import (
    Prolongation,
    Transfer,
    coarser,
    nearest_on_grid,
    prolong_displacement,
    resample_like,
    thinned,
)
from gso.mesh import Mesh
from gso.tasks.developable.analysis import Analysis
from gso.tasks.developable.bounds import inside
from gso.tasks.developable.options import Options
from gso.tasks.request import Request
from gso.tasks.start import Start
from gso.typing import Array, Ints

#: Vertices of a mesh to those of the next coarser one.
_RATIO = 4
#: Largest number of vertices of the coarsest mesh that is not a grid.
_COARSEST = 4000
#: Coarser meshes up to this number of vertices have free vertices, others normal offsets.
FREE_VERTICES = 20_000
#: Longest side of grids that are solved under constraints on their own vertices only.
_SHORT = 96
#: Factor on the number of vertices above which other meshes have coarser ones, under constraints.
#: With coarser meshes the solve ends in a minimum of higher energy: around held vertices the lowest
#: minimum has folds as fine as the mesh.
_CONSTRAINED = 4
#: Parts of constraints with at most so many vertices keep them on coarser meshes.
_FEW = 100


@dataclass(frozen=True)
class Level:
    """A resolution of the design.

    Attributes
    ----------
    mesh : Mesh
        The design at this resolution.
    begin : Mesh
        The surface from which its stage starts: the same, or the warm start.
    constraints : Compiled
        The constraints on it.
    ids : ndarray of int, (m,), or None
        The vertices of the coarser level before it among its own; None on the coarsest one and on
        grids, which are resampled.
    """

    mesh: Mesh
    begin: Mesh
    constraints: Compiled
    ids: Ints | None = None

    def enter(self, before: Level, bound: float | None, coordinates: Array) -> Array:
        """Move its start by the displacement that the coarser level before it has found."""
        points = coordinates.reshape(-1, 3)
        if self.ids is None:
            # A warm start has its details up to some resolution only.
            base = before.mesh if self.begin is self.mesh else before.begin
            moved = prolong_displacement(base, self.begin, points)
        else:
            c = self.constraints
            field = Prolongation(self.begin, self.ids, c.hard_ids)
            held = c.hard_positions - self.begin.vertices[c.hard_ids]
            moved = self.begin.vertices + field(points - before.begin.vertices, held)
        return inside(moved, self.mesh, bound).ravel()


def levels(analysis: Analysis, request: Request[Options]) -> list[Level]:
    """Return the resolutions at which a design is solved, coarsest first, its own last.

    It is the only one where there are no others: on small meshes, with several components that are
    solved together, with a start on meshes that are not grids or under constraints, and under
    constraints that coarser meshes cannot have.
    """
    mesh, constraints = analysis.mesh, analysis.constraints
    start = request.x0
    own = Level(mesh, mesh if start is None else mesh.replaced(start), constraints)
    begun = start is not None
    free = constraints.empty
    if begun and (request.max_displacement is not None or mesh.grid_index is None or not free):
        return [own]
    if mesh.grid_index is not None and free:
        return _resample(own, request)
    if several(mesh) or request.options.variables == "spline":
        return [own]
    if mesh.grid_index is not None:
        return _resample(own, request) if _side(mesh) > _SHORT else [own]
    least = request.options.coarse_vertices * (1 if free else _CONSTRAINED)
    return _thin(own) if len(mesh.vertices) > least else [own]


def _resample(own: Level, request: Request[Options]) -> list[Level]:
    """Return the levels of a grid."""
    o = request.options
    meshes = coarser(own.mesh, o.coarse_size if _from_the_coarsest(request) else o.free_size)
    begins = meshes
    if request.x0 is not None:
        meshes, begins, own = _begun(own, meshes, request.start)
    found = []
    wanted = _vertices(own.constraints.parts)
    for mesh, begin in zip(meshes, begins, strict=True):
        constraints: Compiled | None = own.constraints
        if not own.constraints.empty:
            near = nearest_on_grid(own.mesh, mesh, wanted)
            constraints = own.constraints.on(Transfer(own.mesh, mesh, near))
        if constraints is not None:
            found.append(Level(mesh, begin, constraints))
    return [*found, own]


def _begun(own: Level, meshes: list[Mesh], start: Start) -> tuple[list[Mesh], list[Mesh], Level]:
    """Return the coarser grids, the surfaces from which their stages start, and the own level.

    A start keeps its fine detail: only the displacements found on the coarser grids are
    interpolated and added to it. They correct its low-frequency error, which would take many
    iterations on the fine grid, at a fraction of the cost.
    """
    if start.resolution is None:
        return meshes, resample_like(meshes, own.begin), own
    if start.solved:
        meshes = [mesh for mesh in meshes if _side(mesh) > start.resolution]
    begins = resample_like(meshes, own.begin)
    keep = [detailed(mesh, start.resolution) for mesh in [*meshes, own.mesh]]
    # The first one has the start's displacement, which the next ones get from it.
    keep[0] = True
    begins = [begin if k else mesh for mesh, begin, k in zip(meshes, begins, keep, strict=False)]
    return meshes, begins, own if keep[-1] else replace(own, begin=own.mesh)


def _from_the_coarsest(request: Request[Options]) -> bool:
    """Tell whether the coarsest grids are needed.

    A warm start that has details on all grids has the large displacements already.
    """
    return request.x0 is None or request.start.resolution is not None


def detailed(mesh: Mesh, resolution: int) -> bool:
    """Tell whether a start of some resolution has the details that a grid can show."""
    return _side(mesh) < 2 * resolution


def _side(mesh: Mesh) -> int:
    """Return the number of vertices along the longer side of a grid."""
    return max(mesh.grid_shape or (0,))


def _thin(own: Level) -> list[Level]:
    """Return the levels of a mesh that is no grid: triangles on some of its vertices."""
    mesh = own.mesh
    small = [p for p in own.constraints.parts if p.vertices.size <= _FEW]
    keep = np.zeros(len(mesh.vertices), bool)
    keep[_vertices(small)] = True
    points, triangles = mesh.vertices, mesh.triangles
    near = np.arange(len(points))
    found: list[Level] = []
    steps: list[Ints] = []
    while len(near) > _COARSEST:
        light = thinned(points, triangles, len(near) // _RATIO, np.flatnonzero(keep[near]))
        if 2 * len(light.ids) > len(near):
            break
        near, points, triangles = near[light.ids], points[light.ids], light.faces
        try:
            copy = Mesh(points, triangles)
        except MeshError:
            break
        constraints = own.constraints.on(Transfer(mesh, copy, near))
        if constraints is None or not copy.stars:
            break
        steps.append(light.ids)
        found.append(Level(copy, copy, constraints))
    finer = [own, *found][: len(steps)]
    linked = [
        Level(x.mesh, x.begin, x.constraints, ids) for x, ids in zip(finer, steps, strict=True)
    ]
    return [*found[-1:], *linked[::-1]] if found else [own]


def _vertices(parts: Sequence[Part]) -> Ints:
    ids = [p.vertices.ravel() for p in parts]
    return np.unique(np.concatenate([np.zeros(0, np.int64), *ids]))


def pinned_only(constraints: Compiled) -> bool:
    """Return whether all hard constraints are positions of vertices."""
    return all(isinstance(p, Pins) for p in constraints.parts if p.hard)

"""Seams along polylines on the surface."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import MeshError, OptionError
from gso.geometry.polygon import densified
from gso.mesh import Mesh, Nearest, Paths
from gso.mesh.slicing import divided, followed
from gso.seams.kinds import Placed, Seam
from gso.seams.walking import Walker
from gso.typing import Array, Ints

#: Largest distance of a point from the surface, relative to the diagonal.
_NEAR = 0.05
#: Distance of places at which faces below a polyline are looked for, in mean edge lengths.
_STEP = 0.25


@dataclass(frozen=True, eq=False)
class Polyline(Seam):
    """A polyline on the surface.

    Its points are moved to the nearest vertices. In triangle meshes the seam goes straight through
    the triangles between them, and vertices are inserted where it crosses edges. In other meshes it
    follows edge rows close to the polyline.

    Parameters
    ----------
    points : array_like, (k, 3)
        Two or more points on the surface or close to it.
    closed : bool
        Whether the polyline leads back to its first point.

    Examples
    --------
    >>> import gso
    >>> u, v = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 9), indexing="ij")
    >>> sheet = gso.as_mesh(np.stack([u, v, 0.1 * u * v], axis=-1))
    >>> len(gso.cut(sheet, Polyline([[0, 0.52, 0], [1, 0.52, 0.05]])))
    2
    """

    points: ArrayLike
    closed: bool = False
    INSERTS = True

    def placed(self, mesh: Mesh) -> Placed:
        if not mesh.is_triangles:
            return super().placed(mesh)
        none = np.empty((0, 2), np.int64)
        inserted, own = [none], none
        for k, start, goal in self._steps(mesh, self._checked(mesh)):
            count = len(mesh.vertices)
            mesh, more, line = _straight(mesh, start, goal)
            inserted.append(more)
            own = np.concatenate([followed(own, more, count), _pairs(line, k, start, goal)])
        return Placed(mesh, np.concatenate(inserted), own)

    def edges(self, mesh: Mesh) -> Ints:
        """Return the edges (e, 2) of a mesh that are close to it; no vertex is inserted."""
        points = self._checked(mesh)
        found = []
        for k, start, goal in self._steps(mesh, points):
            line = _along_rows(mesh, points[[k, (k + 1) % len(points)]], start, goal)
            found.append(_pairs(line, k, start, goal))
        return np.concatenate(found)

    def faces(self, mesh: Mesh) -> Ints:
        """Return the faces (k,) of a mesh that it passes over."""
        points, table = self._checked(mesh), mesh.faces
        line = np.concatenate([points, points[:1]]) if self.closed else points
        quads = np.flatnonzero(table[:, 3] >= 0) if table.shape[1] == 4 else np.empty(0, np.int64)
        triangles = np.concatenate([table[:, :3], table[quads][:, [0, 2, -1]]])
        owner = np.concatenate([np.arange(len(table)), quads])
        step = _STEP * float(mesh.edge_lengths.mean())
        place = Nearest.of(mesh.vertices, triangles).locate(densified(line, step))[0]
        return np.unique(owner[place])

    def _steps(self, mesh: Mesh, points: Array) -> list[tuple[int, int, int]]:
        """Return the number of each segment, and the vertices that it leads from and to."""
        ids = _nearest_vertices(mesh, points)
        if (ids == ids[0]).all():
            raise OptionError(
                f"all points of the polyline are nearest to vertex {ids[0]}: it is shorter than an "
                "edge of the mesh, and names none"
            )
        stops = (np.r_[ids, ids[:1]] if self.closed else ids).tolist()
        return [(k, a, b) for k, (a, b) in enumerate(pairwise(stops)) if a != b]

    def _checked(self, mesh: Mesh) -> Array:
        try:
            points = np.asarray(self.points, float)
        except (TypeError, ValueError):
            points = np.zeros(0)
        if points.ndim != 2 or points.shape[1] != 3 or len(points) < 2:
            raise OptionError(f"a polyline has points (k, 3), two or more, not {points.shape}")
        wrong = np.flatnonzero(~np.isfinite(points).all(axis=1))
        if wrong.size:
            raise OptionError(f"point {wrong[0]} of a polyline is not finite")
        far = Nearest(mesh).distances(points)
        k = int(far.argmax())
        if far[k] > _NEAR * mesh.diagonal:
            raise OptionError(
                f"point {k} of a polyline is {far[k]:.4g} from the surface, more than "
                f"{100 * _NEAR:.0f} % of its diagonal"
            )
        return points


def _nearest_vertices(mesh: Mesh, points: Array) -> Ints:
    from scipy.spatial import cKDTree

    used = np.flatnonzero(mesh.used)
    nearest: Ints = used[cKDTree(mesh.vertices[used]).query(points)[1]]
    return nearest


def _pairs(line: Ints | None, number: int, start: int, goal: int) -> Ints:
    """Return the edges (e, 2) of a path, which is None where there is none."""
    if line is None:
        raise MeshError(
            f"no seam on the surface leads from point {number} of the polyline to the next "
            f"(vertices {start} and {goal})"
        )
    return np.stack([line[:-1], line[1:]], axis=1)


def _straight(mesh: Mesh, start: int, goal: int) -> tuple[Mesh, Ints, Ints | None]:
    """Insert a straight line between two vertices; a path along edges where that fails."""
    count = len(mesh.vertices)
    found = Walker(mesh).walk(start, goal)
    none = np.empty((0, 2), np.int64)
    if found is None or len(set(found.edges)) < len(found.edges):
        return mesh, none, _path(mesh, start, goal, np.ones(len(mesh.edges)))
    edges = np.array(found.edges, np.int64).reshape(-1, 2)
    finer, inserted = divided(mesh, edges, np.array(found.shares))
    line = np.array([s if s >= 0 else count - 1 - s for s in found.stops])
    return finer, inserted, line


def _along_rows(mesh: Mesh, ends: Array, start: int, goal: int) -> Ints | None:
    """Find a path along edges close to a segment, with few turns."""
    middle = mesh.vertices[mesh.edges].mean(axis=1)
    way = ends[1] - ends[0]
    along = np.clip((middle - ends[0]) @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
    far = np.linalg.norm(middle - ends[0] - along[:, None] * way, axis=1)
    step = float(mesh.edge_lengths.mean())
    return _path(mesh, start, goal, 1.0 + (far / step) ** 2)


def _path(mesh: Mesh, start: int, goal: int, weight: Array) -> Ints | None:
    wanted = np.zeros(len(mesh.vertices), bool)
    wanted[goal] = True
    line = Paths(mesh).cheapest(start, wanted, weight)
    return line if line[-1] == goal else None

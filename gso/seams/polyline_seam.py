"""Seams along polylines on the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import MeshError, OptionError
from gso.mesh import Mesh, Nearest, Paths
from gso.mesh.slicing import divided, followed
from gso.seams.kinds import Placed, Seam
from gso.seams.walking import Walker
from gso.typing import Array, Ints

#: Largest distance of a point from the surface, relative to the diagonal.
_NEAR = 0.05


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
        points = self._checked(mesh)
        ids = _nearest_vertices(mesh, points)
        stops = np.r_[ids, ids[:1]] if self.closed else ids
        if (ids == ids[0]).all():
            raise OptionError(
                f"all points of the polyline are nearest to vertex {ids[0]}: it is shorter than an "
                "edge of the mesh, so there is nothing to cut"
            )
        inserted, edges = [], []
        for k, (start, goal) in enumerate(
            zip(stops[:-1].tolist(), stops[1:].tolist(), strict=True)
        ):
            if start == goal:
                continue
            if mesh.is_triangles:
                mesh, more, line = _straight(mesh, start, goal)
                inserted.append(more)
            else:
                line = _along_rows(mesh, points[[k, (k + 1) % len(points)]], start, goal)
            if line is None:
                raise MeshError(
                    f"no seam on the surface leads from point {k} of the polyline to the next "
                    f"(vertices {start} and {goal})"
                )
            edges.append(np.stack([line[:-1], line[1:]], axis=1))
        none = np.empty((0, 2), np.int64)
        own = none
        count = len(mesh.vertices) - sum(map(len, inserted))
        for k, line in enumerate(edges):
            more = inserted[k] if inserted else none
            own = np.concatenate([followed(own, more, count), line])
            count += len(more)
        return Placed(mesh, np.concatenate([none, *inserted]), own)

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

"""Kinds of seams: what a mesh is cut along."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gso import metrics
from gso.errors import MeshError, OptionError
from gso.mesh import Mesh, between
from gso.mesh.attributes import LABELS
from gso.mesh.slicing import sliced
from gso.mesh.topology import edge_graph
from gso.spelling import choices
from gso.typing import Array, Flags, Ints

#: Price of edges in the plane of a slice, relative to those at a distance of one edge length.
_NEAR = 0.3


class Placed(NamedTuple):
    """A seam on a mesh.

    Attributes
    ----------
    mesh : Mesh
        The mesh, with vertices inserted where the seam needs them.
    inserted : ndarray of int, (k, 2)
        The ends of the edge on which each new vertex lies, in the order of insertion.
    edges : ndarray of int, (e, 2)
        The edges to cut.
    """

    mesh: Mesh
    inserted: Ints
    edges: Ints


class Seam:
    """Something to cut a mesh along; subclasses give its edges."""

    #: Whether the seam may insert vertices.
    INSERTS = False

    def placed(self, mesh: Mesh) -> Placed:
        """Place the seam on a mesh."""
        return Placed(mesh, np.empty((0, 2), np.int64), self.edges(mesh))

    def edges(self, mesh: Mesh) -> Ints:
        """Return the edges (e, 2) to cut."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class Edges(Seam):
    """Edges of the mesh.

    Parameters
    ----------
    pairs : array_like of int, (e, 2)
        Vertices at both ends of each.
    """

    pairs: ArrayLike

    def edges(self, mesh: Mesh) -> Ints:
        return _indices(self.pairs, mesh, 2, "pairs of vertices (e, 2)")


@dataclass(frozen=True, eq=False)
class Path(Seam):
    """A path from vertex to vertex, along the shortest edges between them.

    Parameters
    ----------
    vertices : array_like of int, (k,)
        Vertices on the path, two or more; they need not be neighbours.
    closed : bool
        Whether the path leads back to the first vertex.
    """

    vertices: ArrayLike
    closed: bool = False

    def edges(self, mesh: Mesh) -> Ints:
        from scipy.sparse.csgraph import dijkstra

        ids = _indices(self.vertices, mesh, 1, "a list of vertices")
        if len(ids) < 2:
            raise OptionError(f"a path has {len(ids)} vertices; it needs two or more")
        stops = np.r_[ids, ids[:1]] if self.closed else ids
        a, b = mesh.edges.T
        graph = edge_graph(len(mesh.vertices), a, b, mesh.edge_lengths)
        starts = np.unique(stops[:-1])
        away, before = dijkstra(graph, directed=False, indices=starts, return_predecessors=True)
        out = []
        for start, end in zip(stops[:-1].tolist(), stops[1:].tolist(), strict=True):
            row = int(np.searchsorted(starts, start))
            if not np.isfinite(away[row, end]):
                raise MeshError(f"no path along edges leads from vertex {start} to vertex {end}")
            while end != start:
                out.append((int(before[row, end]), end))
                end = out[-1][0]
        return np.array(out, np.int64).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class Slice(Seam):
    """The intersection with a plane.

    In triangle meshes, vertices are inserted where the plane crosses edges. In other meshes the
    seam follows the edge rows near the plane: the shortest cut, where edges far from it cost more.

    Parameters
    ----------
    point, normal : array_like, (3,)
        A point of the plane, and its normal (of any length).
    """

    point: ArrayLike
    normal: ArrayLike

    INSERTS = True

    def placed(self, mesh: Mesh) -> Placed:
        inserted = np.empty((0, 2), np.int64)
        if mesh.is_triangles:
            mesh, inserted = sliced(mesh, self._heights(mesh))
        return Placed(mesh, inserted, self.edges(mesh))

    def edges(self, mesh: Mesh) -> Ints:
        height = self._heights(mesh)
        faces = mesh.faces
        if not mesh.is_triangles:
            step = float(mesh.edge_lengths.mean())
            own = np.where(faces >= 0, height[faces], height[faces[:, :1]])
            below = np.asarray((own < -step).all(axis=1))
            above = np.asarray((own > step).all(axis=1))
            if below.any() and above.any():
                return between(mesh, below, above, _NEAR + np.abs(height) / step)
        corner = np.where(faces >= 0, height[faces], 0.0)
        side = corner.sum(axis=1) > 0
        return edges_between(mesh, side.astype(np.int64))

    def _heights(self, mesh: Mesh) -> Array:
        """Return the signed distances (n,) of the vertices; those close to zero are zero."""
        point, normal = (np.asarray(x, float) for x in (self.point, self.normal))
        size = float(np.linalg.norm(normal)) if normal.shape == (3,) else 0.0
        if point.shape != (3,) or not np.isfinite(point).all() or not 0 < size < np.inf:
            raise OptionError(
                f"a slice has point {self.point!r} and normal {self.normal!r}; they must be "
                "three finite numbers each, and the normal not zero"
            )
        height: Array = (mesh.vertices - point) @ (normal / size)
        height[np.abs(height) < 1e-9 * mesh.diagonal] = 0.0
        return height


@dataclass(frozen=True)
class Labels(Seam):
    """The edges between faces with different labels in the file that the mesh was read from.

    Parameters
    ----------
    kind : {"o", "g", "s", "usemtl"}
        The OBJ keyword of the labels: objects, groups, smoothing groups or materials.
    """

    kind: str = "g"

    def edges(self, mesh: Mesh) -> Ints:
        if self.kind not in LABELS:
            raise OptionError(f"no labels {self.kind!r}; {choices(self.kind, LABELS)}")
        said = mesh.attributes
        if said is None or self.kind not in said.labels:
            raise MeshError(f"the mesh has no {LABELS[self.kind]} ({self.kind!r}) to cut between")
        labels = said.labels[self.kind]
        _, same = np.unique(["", *labels.names], return_inverse=True)
        return edges_between(mesh, same[labels.of_face + 1])


@dataclass(frozen=True)
class Groups(Seam):
    """The edges between faces of different groups, objects or materials of an OBJ file.

    Groups (``g``) are taken where there are two or more of them, otherwise objects (``o``),
    otherwise materials (``usemtl``).
    """

    def edges(self, mesh: Mesh) -> Ints:
        kinds = {} if mesh.attributes is None else mesh.attributes.labels
        known = [kind for kind in ("g", "o", "usemtl") if kind in kinds]
        if not known:
            raise MeshError(
                "the mesh has no groups (g), objects (o) or materials (usemtl) to cut between"
            )
        cut = (Labels(kind).edges(mesh) for kind in known)
        return next((edges for edges in cut if len(edges)), np.empty((0, 2), np.int64))


@dataclass(frozen=True)
class Creases(Seam):
    """The edges at which the surface bends by more than an angle.

    Parameters
    ----------
    angle : float
        The angle between the normals of both faces, in degrees.
    """

    angle: float = 30.0

    def edges(self, mesh: Mesh) -> Ints:
        if not (isinstance(self.angle, int | float | np.number) and 0 < self.angle < 180):
            raise OptionError(f"angle is {self.angle!r}; it must be between 0 and 180 degrees")
        he = mesh.half_edges
        k = he.interior[metrics.dihedral_angles(mesh) > self.angle]
        return np.stack([he.origin[k], he.dest[k]], axis=1)


def edges_between(mesh: Mesh, label: Ints | Flags) -> Ints:
    """Return the edges (e, 2) between faces with different labels (m,)."""
    he, k = mesh.half_edges, mesh.half_edges.interior
    k = k[label[he.face[k]] != label[he.face[he.twin[k]]]]
    return np.stack([he.origin[k], he.dest[k]], axis=1)


def _indices(given: ArrayLike, mesh: Mesh, ndim: int, what: str) -> Ints:
    """Check indices of vertices."""
    try:
        ids = np.asarray(given)
    except ValueError:
        ids = np.zeros(0)
    if ids.ndim != ndim or ids.dtype.kind not in "iu" or (ndim == 2 and ids.shape[1] != 2):
        raise OptionError(f"a seam needs {what}, not {given!r}")
    count = len(mesh.vertices)
    bad = ids[(ids < 0) | (ids >= count)]
    if bad.size:
        raise OptionError(f"a seam names vertex {bad[0]}; the mesh has {count}")
    return ids.astype(np.int64)

"""A mesh as flat facets with folds between them, and the tolerance of its coordinates."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gso import geometry
from gso.geometry.vectors import fold_angles
from gso.mesh import Mesh, topology
from gso.recognition.fold_diagonals import fold_triangles
from gso.typing import Array, Flags, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

#: Largest share of the size that rounding of coordinates is taken for.
_COARSEST = 2e-4
#: Relative error of coordinates that are not rounded.
_EXACT = 2e-9
#: Fold, in radians, up to which a mesh can be a smooth surface: a tube of 12 sides has 30 degrees.
SMOOTH = np.radians(30.5)
#: Multiple of the step of the coordinates within which points count as on a surface.
_MARGIN = 1.5


def coordinate_step(points: Array) -> float:
    """Find the step to which coordinates were rounded: decimals, digits, or single precision.

    Never more than 2e-4 of the size, and never less than 2e-9 of it: whole numbers may be exact.

    >>> coordinate_step(np.array([[0.125, 99.5, 3.141]]))
    0.001
    """
    size = max(geometry.box_diagonal(points), 1e-300)
    largest = np.abs(points).max()
    steps = [_COARSEST * size]
    for decimals in range(13):
        step = 10.0**-decimals
        if np.abs(points - np.round(points / step) * step).max() <= 1e-7 * step + 1e-15 * largest:
            steps.append(step)
            break
    magnitude = 10.0 ** np.floor(np.log10(np.maximum(np.abs(points), 1e-300)))
    for digits in range(4, 12):
        unit = magnitude * 10.0 ** (1 - digits)
        if (np.abs(points - np.round(points / unit) * unit) <= 1e-4 * unit).all():
            steps.append(float(unit.max()))
            break
    if (points == points.astype(np.float32)).all():
        steps.append(float(largest * 2.0**-24))
    rounded = steps[1:]
    step = max(rounded) if rounded else _EXACT * size
    return float(np.clip(step, _EXACT * size, _COARSEST * size))


@dataclass(frozen=True)
class FacetGraph:
    """Triangles of a mesh, the folds between them, and the flat facets that they form.

    Attributes
    ----------
    points : ndarray, (n, 3)
    triangles : ndarray of int, (t, 3)
    step : float
        Step to which the coordinates are rounded.
    allowed : float
        Distance from its surface that a point may have besides.
    largest_smooth : float
        Angle, in radians, above which a fold across rulings is an edge of the design.
    """

    points: Array
    triangles: Ints
    step: float
    allowed: float = 0.0
    largest_smooth: float = SMOOTH

    @classmethod
    def of(cls, mesh: Mesh, allowed: float = 0.0, largest_smooth: float = SMOOTH) -> FacetGraph:
        """Make the graph of a mesh; distances up to `allowed` are within the tolerance, too."""
        step = coordinate_step(mesh.vertices[mesh.used])
        return cls(mesh.vertices, fold_triangles(mesh), step, allowed, largest_smooth)

    def refined(self, points: Array, triangles: Ints, source: Ints) -> FacetGraph:
        """Return the graph of a refined mesh; facets are those of the triangles' sources (t2,)."""
        new = replace(self, points=points, triangles=triangles)
        new.__dict__["facet"] = self.facet[source]
        return new

    @property
    def tolerance(self) -> float:
        """Distance within which a point counts as on a surface."""
        return max(_MARGIN * self.step, self.allowed)

    @cached_property
    def half_edges(self) -> topology.HalfEdges:
        """Half-edges of the triangles."""
        return topology.half_edges(self.triangles, len(self.points))

    @cached_property
    def _doubled(self) -> Array:
        return geometry.area_vectors(self.points, self.triangles)

    @cached_property
    def areas(self) -> Array:
        """Areas of the triangles, (t,)."""
        return np.asarray(0.5 * np.linalg.norm(self._doubled, axis=1))

    @cached_property
    def normals(self) -> Array:
        """Unit normals of the triangles, (t, 3)."""
        return np.asarray(self._doubled / np.maximum(2 * self.areas, 1e-300)[:, None])

    @cached_property
    def middles(self) -> Array:
        """Centroids of the triangles, (t, 3)."""
        return np.asarray(self.points[self.triangles].mean(axis=1))

    @cached_property
    def pairs(self) -> Ints:
        """Triangles on the left and right of each interior edge, (e, 2)."""
        he, one = self.half_edges, self.half_edges.interior
        return np.stack([he.face[one], he.face[he.twin[one]]], axis=1)

    @cached_property
    def ends(self) -> Ints:
        """Start and end of each interior edge, seen from its left triangle, (e, 2)."""
        he, one = self.half_edges, self.half_edges.interior
        return np.stack([he.origin[one], he.dest[one]], axis=1)

    @cached_property
    def folds(self) -> Array:
        """Angle at each interior edge, in radians, positive where the surface is convex; (e,)."""
        a, b = self.normals[self.pairs[:, 0]], self.normals[self.pairs[:, 1]]
        along = self.points[self.ends[:, 1]] - self.points[self.ends[:, 0]]
        return fold_angles(a, b, along)

    @cached_property
    def facet(self) -> Ints:
        """Flat facet of each triangle, (t,): neighbours in one plane are one facet."""
        he, one = self.half_edges, self.half_edges.interior
        left, right = self.pairs.T
        over = self.points[he.dest[he.next[he.twin[one]]]] - self.points[he.origin[one]]
        back = self.points[he.dest[he.next[one]]] - self.points[he.origin[one]]
        off = np.minimum(
            np.abs(np.einsum("ed,ed->e", over, self.normals[left])),
            np.abs(np.einsum("ed,ed->e", back, self.normals[right])),
        )
        flat = (off <= 2 * self.tolerance) & (np.abs(self.folds) < _FLATTEST)
        label = topology.label_components(len(self.triangles), left[flat], right[flat])
        return self._checked(label)

    def _checked(self, label: Ints) -> Ints:
        """Divide facets that are not flat as a whole into their triangles."""
        count = int(label.max()) + 1
        normal = self._mean_normals(label)
        height = np.einsum("tcd,td->tc", self.points[self.triangles], normal[label])
        low, high = np.full(count, np.inf), np.full(count, -np.inf)
        np.minimum.at(low, label, height.min(axis=1))
        np.maximum.at(high, label, height.max(axis=1))
        bent = (high - low > 4 * self.tolerance)[label]
        label = label.copy()
        label[bent] = count + np.arange(int(bent.sum()))
        return np.asarray(np.unique(label, return_inverse=True)[1].ravel(), np.int64)

    @cached_property
    def facet_normals(self) -> Array:
        """Unit normals of the facets, (f, 3)."""
        return self._mean_normals(self.facet)

    def _mean_normals(self, label: Ints) -> Array:
        count = int(label.max()) + 1
        total = np.stack([np.bincount(label, d, count) for d in self._doubled.T], axis=1)
        norm = np.linalg.norm(total, axis=1, keepdims=True)
        return np.asarray(total / np.maximum(norm, 1e-300))

    @cached_property
    def facet_areas(self) -> Array:
        """Areas of the facets, (f,)."""
        return np.asarray(np.bincount(self.facet, self.areas), float)

    @cached_property
    def facet_vertices(self) -> csr_matrix:
        """Which vertices each facet has, (f, n)."""
        rows = np.repeat(self.facet, 3)
        table = topology.edge_graph(
            max(int(self.facet.max()) + 1, len(self.points)), rows, self.triangles.ravel()
        )
        table = table[: int(self.facet.max()) + 1, : len(self.points)]
        table.data[:] = 1.0
        return table

    @cached_property
    def shared(self) -> Flags:
        """Which vertices belong to several facets, (n,)."""
        return np.asarray(self.facet_vertices.getnnz(axis=0) > 1)

    def connected(self, member: Flags, joined: Flags | None = None) -> Ints:
        """Label the connected parts of triangles (t,); -1 for those that are no members.

        Across all edges, or those of a mask (e,).
        """
        both = member[self.pairs].all(axis=1)
        if joined is not None:
            both &= joined
        ids = np.flatnonzero(member)
        new = np.full(len(self.triangles), -1)
        new[ids] = np.arange(len(ids))
        a, b = new[self.pairs[both]].T
        label = np.full(len(self.triangles), -1)
        if len(ids):
            label[ids] = topology.label_components(len(ids), a, b)
        return label


#: Fold, in radians, above which neighbours never form one facet.
_FLATTEST = np.radians(20.0)

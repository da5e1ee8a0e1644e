"""The net of a surface of flat faces: flat parts, and the edges to fold and to join them along."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gso.geometry import closest_motion
from gso.geometry.vectors import unit
from gso.mesh import Mesh
from gso.mesh.topology import edge_keys
from gso.pattern import Folded, Pattern
from gso.typing import Array, Ints
from gso.unfolding.dual_edges import dual_edges


@dataclass(frozen=True, eq=False)
class Net:
    """A surface of flat faces, cut along edges and laid flat; :func:`gso.unfold` makes it.

    Attributes
    ----------
    mesh : Mesh
        The surface as triangles, with copies of vertices where the given one is not manifold.
    face : ndarray of int, (t,)
        The given face of each triangle.
    vertex : ndarray of int, (n,)
        The given vertex of each vertex.
    pattern : Pattern
        The flat parts side by side, the outside up, with all triangles in their order.
    part : ndarray of int, (t,)
        Part of each triangle; 0 is the largest part.
    folded : Folded
        The edges to fold along, as vertices of the pattern. Angles are positive for mountain folds;
        radii are 0. There are small ones in faces that are not exactly flat, see :attr:`folds`.
    flat_angle : float
        Angle in degrees up to which an edge counts as flat.
    notes : tuple of str
        What was found or changed.
    """

    mesh: Mesh
    face: Ints
    vertex: Ints
    pattern: Pattern
    part: Ints
    folded: Folded
    flat_angle: float = 0.0
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return int(self.part.max()) + 1

    def __repr__(self) -> str:
        folds, cuts = len(self.folds.edges), len(self.pattern.seams)
        return f"Net({len(self)} parts, {folds} folds, {cuts} edges cut)"

    @cached_property
    def areas(self) -> Array:
        """Areas of the parts, (k,)."""
        p = self.pattern.flat[self.pattern.faces]
        one, other = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
        area = 0.5 * (one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
        return np.asarray(np.bincount(self.part, area), float)

    @cached_property
    def folds(self) -> Folded:
        """The folds that are drawn: edges that do not count as flat."""
        bent = np.abs(self.folded.angles) > np.radians(self.flat_angle)
        return Folded(*(values[bent] for values in self.folded[:3]))

    @property
    def angles(self) -> Array:
        """Angles of :attr:`folds` in degrees, (f,): positive for mountain folds."""
        return np.asarray(np.degrees(self.folds.angles))

    @property
    def cut_edges(self) -> Ints:
        """The edges of the mesh, (c, 2), along which it is cut; :attr:`pattern` pairs them."""
        return np.asarray(self.pattern.vertex[self.pattern.seams[:, 0]])

    @property
    def cut_length(self) -> float:
        """Length of all edges along which the mesh is cut."""
        a, b = self.mesh.vertices[self.cut_edges].transpose(1, 0, 2)
        return float(np.linalg.norm(b - a, axis=1).sum())

    def fold(self) -> Array:
        """Fold the parts by their folds alone.

        Returns
        -------
        ndarray, (p, 3)
            Positions of the pattern's vertices. A triangle of each part stays in its place in the
            plane z = 0, with the outside up.
        """
        faces = self.pattern.faces
        flat = np.pad(self.pattern.flat, ((0, 0), (0, 1)))
        edges = dual_edges(faces, flat)
        count = len(flat)
        ends = self.folded.edges
        keys = edge_keys(ends[:, 0], ends[:, 1], count)
        order = np.argsort(keys)
        own = edge_keys(edges.ends[:, 0], edges.ends[:, 1], count)
        angle = np.zeros(len(edges))
        if len(keys):
            at = order[np.minimum(np.searchsorted(keys[order], own), len(keys) - 1)]
            angle = np.where(keys[at] == own, self.folded.angles[at], 0.0)
        turn, shift = _motions(flat, edges.triangles, edges.ends, angle, len(faces))
        out = np.einsum("tij,tkj->tki", turn, flat[faces]) + shift[:, None]
        points: Array = flat.copy()
        points[faces.ravel()[::-1]] = out.reshape(-1, 3)[::-1]
        return points

    def misfit(self) -> float:
        """Return how far the folded parts are from the mesh at most, in its unit of length."""
        points, design = self.fold(), self.mesh.vertices[self.pattern.vertex]
        far = 0.0
        for part in range(len(self)):
            ids = np.unique(self.pattern.faces[self.part == part])
            turn, shift = closest_motion(points[ids], design[ids])
            away = points[ids] @ turn.T + shift - design[ids]
            far = max(far, float(np.linalg.norm(away, axis=1).max()))
        return far


def _motions(flat: Array, pairs: Ints, ends: Ints, angle: Array, count: int) -> tuple[Array, Array]:
    """Return rotation (t, 3, 3) and shift (t, 3) of each triangle: one of each part stays.

    From a triangle to the next, a fold turns by its angle about the edge, the first triangle of
    each pair being to the left of it.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, connected_components
    from scipy.spatial.transform import Rotation

    a, b = pairs.T
    number = np.arange(1, len(a) + 1)
    graph = coo_matrix(
        (np.r_[number, number], (np.r_[a, b], np.r_[b, a])), shape=(count, count)
    ).tocsr()
    turn, shift = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
    _, label = connected_components(graph, directed=False)
    depth, above = np.zeros(count, np.int64), np.full(count, -1)
    for root in np.unique(label, return_index=True)[1].tolist():
        order, before = breadth_first_order(graph, root, directed=False)
        above[order[1:]] = before[order[1:]]
        for here in order[1:].tolist():
            depth[here] = depth[above[here]] + 1
    below = np.flatnonzero(above >= 0)
    if not len(below):
        return turn, shift
    by = np.asarray(graph[below, above[below]]).ravel().astype(np.int64) - 1
    edge = np.full(count, -1)
    edge[below] = by
    way = unit(flat[ends[:, 1]] - flat[ends[:, 0]])
    for level in range(1, int(depth.max(initial=0)) + 1):
        own = np.flatnonzero(depth == level)
        e, up = edge[own], above[own]
        # Seen from the other triangle, both the edge and the side are reversed.
        side = np.where(pairs[e, 0] == up, 1.0, -1.0)
        local = Rotation.from_rotvec((side * angle[e])[:, None] * way[e]).as_matrix()
        pivot = flat[ends[e, 0]]
        still = pivot - np.einsum("tij,tj->ti", local, pivot)
        turn[own] = turn[up] @ local
        shift[own] = np.einsum("tij,tj->ti", turn[up], still) + shift[up]
    return turn, shift

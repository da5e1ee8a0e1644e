"""The net of a surface of flat faces: flat parts, and the edges to fold and to join them along."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gso.in_browser import show
from gso.mesh import Mesh
from gso.pattern import Folded, Pattern
from gso.short_repr import html_repr
from gso.typing import Array, Ints
from gso.unfolding.dual_edges import dual_edges
from gso.unfolding.folding import angles_at, frames, misfit, motions


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

    _repr_html_ = html_repr
    show = show

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
        return self.folded.taken(np.abs(self.folded.angles) > np.radians(self.flat_angle))

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
        faces, count = self.pattern.faces, len(self.pattern.flat)
        flat = np.pad(self.pattern.flat, ((0, 0), (0, 1)))
        edges = dual_edges(faces, flat)
        ends = flat[edges.ends]
        # Both triangles have the edge in the same place.
        frame = frames(ends, np.tile([0.0, 0.0, 1.0], (len(ends), 1)))
        middle, both = (np.stack([x, x], axis=1) for x in (ends.mean(axis=1), frame))
        angle = angles_at(edges, self.folded, count)
        turn, shift = motions(edges.triangles, middle, both, angle, len(faces))
        out = np.einsum("tij,tkj->tki", turn, flat[faces]) + shift[:, None]
        points: Array = flat.copy()
        points[faces.ravel()[::-1]] = out.reshape(-1, 3)[::-1]
        return points

    def misfit(self) -> float:
        """Return how far the folded parts are from the mesh at most, in its unit of length."""
        design = self.mesh.vertices[self.pattern.vertex]
        return misfit(self.fold(), design, self.pattern.mesh.components)

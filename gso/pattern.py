"""The flat pattern of a surface: a planar mesh, cut open where necessary."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gso.mesh import Mesh
from gso.mesh.topology import label_components
from gso.short_repr import short_repr
from gso.typing import Array, Flags, Ints

#: Angle in radians up to which edges are in line, and bends equal.
_STRAIGHT = 1e-6
#: Names of the arrays in files.
_ARRAYS = ("flat", "faces", "vertex", "seams")


def _no_seams() -> Ints:
    return np.empty((0, 2, 2), np.int64)


class Zone(NamedTuple):
    """A round face of a pattern, which is bent as a whole.

    Attributes
    ----------
    kind : str
        "cylinder", "cone", or "torsal" for any other developable surface.
    least, most : float
        Smallest and largest radius.
    angle : float
        Angle by which it turns in all, in radians, positive for mountain folds.
    pressed : bool
        Whether a press bends it at one line in its middle; otherwise it is rolled.
    """

    kind: str
    least: float
    most: float
    angle: float
    pressed: bool = False

    def scaled(self, scale: float) -> Zone:
        """Return it in another unit."""
        return self._replace(least=scale * self.least, most=scale * self.most)

    def in_words(self) -> str:
        """Say what to do, with radii in millimetres.

        >>> Zone("cylinder", 1500.0, 1500.0, np.pi).in_words()
        'roll R 1500, 180 deg down'
        >>> Zone("cone", 40.0, 90.0, -np.pi / 2).in_words()
        'roll cone R 40 to 90, 90 deg up'
        """
        radii = f"R {self.least:.4g}"
        if self.most > self.least * (1.0 + _STRAIGHT):
            radii += f" to {self.most:.4g}" if np.isfinite(self.most) else " or more"
        name = "" if self.kind == "cylinder" else f" {self.kind}"
        way = "down" if self.angle > 0 else "up"
        turn = abs(np.degrees(self.angle))
        return f"{'press' if self.pressed else 'roll'}{name} {radii}, {turn:.4g} deg {way}"


class Bend(NamedTuple):
    """A straight line to bend along.

    Attributes
    ----------
    line : ndarray, (2, 2)
        Its ends in the pattern.
    angle : float
        Angle between the faces in radians: positive for mountain folds, negative for valley
        folds, zero where nothing is bent.
    radius : float
        Radius of the bend, in the mesh's unit; infinite where nothing is bent.
    zone : int
        Number of the zone that it is a line of; -1 for none.
    """

    line: Array
    angle: float
    radius: float
    zone: int = -1

    def in_words(self) -> str:
        """Describe the bend, with a radius in millimetres.

        >>> Bend(np.zeros((2, 2)), np.radians(12.3), 45.6).in_words()
        'mountain 12.3 degrees, radius 45.6 mm'
        """
        name = "mountain" if self.angle > 0 else "valley"
        radius = f", radius {self.radius:.4g} mm" if np.isfinite(self.radius) else ""
        return f"{name} {abs(np.degrees(self.angle)):.4g} degrees{radius}"


class Folded(NamedTuple):
    """Edges of a pattern to bend along.

    Attributes
    ----------
    edges : ndarray of int, (k, 2)
    angles, radii : ndarray, (k,)
        As of a :class:`Bend`.
    zone : ndarray of int, (k,) or (0,)
        Number of each edge's zone, -1 for none; empty without zones.
    """

    edges: Ints = np.empty((0, 2), np.int64)
    angles: Array = np.empty(0)
    radii: Array = np.empty(0)
    zone: Ints = np.empty(0, np.int64)

    def taken(self, which: Flags) -> Folded:
        """Return the marked ones (k,)."""
        zone = self.zone[which] if len(self.zone) else self.zone
        return Folded(self.edges[which], self.angles[which], self.radii[which], zone)

    def lines(self, flat: Array) -> list[Bend]:
        """Return them as lines, for positions (p, 2) of the pattern's vertices.

        Edges that continue each other with the same angle are one line, with the smallest radius.
        """
        if not len(self.edges):
            return []
        chain = self._chains(flat)
        out = []
        for own in np.split(order := np.argsort(chain, kind="stable"), _starts(chain[order])):
            ends = flat[self.edges[own]].reshape(-1, 2)
            along = (ends - ends[0]) @ (ends[1] - ends[0])
            line = ends[[int(along.argmin()), int(along.argmax())]]
            zone = int(self.zone[own[0]]) if len(self.zone) else -1
            out.append(Bend(line, float(self.angles[own[0]]), float(self.radii[own].min()), zone))
        return out

    def _chains(self, flat: Array) -> Ints:
        """Name edges by the line that they are on, in the order of their first edges."""
        count = len(self.edges)
        ends = self.edges.ravel()
        order = np.argsort(ends, kind="stable")
        often = np.bincount(ends)
        two = np.flatnonzero(often[ends[order]] == 2)[::2]
        one, other = order[two] // 2, order[two + 1] // 2
        a, b = (flat[self.edges[k]] for k in (one, other))
        way, to = a[:, 1] - a[:, 0], b[:, 1] - b[:, 0]
        long = np.linalg.norm(way, axis=1) * np.linalg.norm(to, axis=1)
        straight = np.abs(way[:, 0] * to[:, 1] - way[:, 1] * to[:, 0]) <= _STRAIGHT * long
        same = np.abs(self.angles[one] - self.angles[other]) <= _STRAIGHT
        linked = straight & same & (one != other)
        names = label_components(count, one[linked], other[linked])
        _, first, label = np.unique(names, return_index=True, return_inverse=True)
        return np.argsort(np.argsort(first))[label.ravel()]


def _starts(sorted_names: Ints) -> Ints:
    return np.flatnonzero(np.diff(sorted_names)) + 1


@dataclass(frozen=True)
class Pattern:
    """A flat pattern, and the correspondence of its vertices to the surface.

    Attributes
    ----------
    flat : ndarray, (p, 2)
        Positions of its vertices in the plane, in the surface's unit of length.
    faces : ndarray of int, (m, 3) or (m, 4)
        The surface's faces, in their order, as indices of the pattern's vertices.
    vertex : ndarray of int, (p,)
        Index of the corresponding vertex of the surface; 0 ... n - 1 where nothing is cut.
    seams : ndarray of int, (s, 2, 2)
        Pairs of pattern edges that are one edge of the surface. The first ends of a pair are
        the same vertex of the surface, and so are the second ends.

    Examples
    --------
    >>> y, x = np.mgrid[:3.0, :4.0]
    >>> sheet = Mesh.from_grid(np.stack([x, y, 0 * x], axis=-1))
    >>> pattern = Pattern.whole(sheet, sheet.vertices[:, :2])
    >>> pattern.mesh, pattern.is_cut
    (Mesh(12 vertices, 6 faces, grid 3 x 4), False)
    """

    flat: Array
    faces: Ints
    vertex: Ints
    seams: Ints = field(default_factory=_no_seams)

    __repr__ = short_repr

    @classmethod
    def whole(cls, surface: Mesh, flat: Array) -> Pattern:
        """Make the pattern of a surface that is not cut from its flat image (n, 2)."""
        return cls(flat, surface.faces, np.arange(len(surface.vertices)))

    @property
    def is_cut(self) -> bool:
        """Whether some vertex of the surface has several copies in the pattern."""
        return bool(np.bincount(self.vertex).max(initial=0) > 1)

    @cached_property
    def mesh(self) -> Mesh:
        """The pattern as a mesh at z = 0."""
        return Mesh(np.pad(self.flat, ((0, 0), (0, 1))), self.faces)

    def surface(self, mesh: Mesh) -> Mesh:
        """Return the surface in space with the pattern's connectivity: cut open along its seams.

        Parameters
        ----------
        mesh : Mesh
            The surface that the pattern belongs to.
        """
        return Mesh(mesh.vertices[self.vertex], self.faces) if self.is_cut else mesh

    def arrays(self, prefix: str = "pattern_") -> dict[str, np.ndarray]:
        """Return the pattern as arrays by name; see :meth:`from_arrays`."""
        return {f"{prefix}{name}": getattr(self, name) for name in _ARRAYS}

    @classmethod
    def from_arrays(
        cls, data: Mapping[str, np.ndarray], surface: Mesh, prefix: str = "pattern_"
    ) -> Pattern:
        """Return the pattern of a surface that :meth:`arrays` describes.

        Raises
        ------
        KeyError, ValueError
            Arrays are missing, or do not fit each other or the surface.
        """
        flat, faces, vertex, seams = (data[f"{prefix}{name}"] for name in _ARRAYS)
        count, kept = len(flat), faces >= 0
        fits = flat.shape == (count, 2) and vertex.shape == (count,) and seams.shape[1:] == (2, 2)
        if not fits or faces.shape != surface.faces.shape or (kept != (surface.faces >= 0)).any():
            raise ValueError("the arrays of the pattern do not fit each other")
        for name, ids, end in (
            ("faces", faces[kept], count),
            ("vertex", vertex, len(surface.vertices)),
            ("seams", seams, count),
        ):
            if ids.dtype.kind not in "iu" or (ids.size and not 0 <= ids.min() <= ids.max() < end):
                raise ValueError(f"{prefix}{name} points outside")
        if (vertex[faces[kept]] != surface.faces[kept]).any():
            raise ValueError("the pattern's vertices are not those of the surface's faces")
        return cls(flat, faces, vertex, seams)

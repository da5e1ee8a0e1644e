"""Strips that are longer than a sheet, or overlap themselves in the plane, divided across.

Joints are along rulings or between two of them. Where their parts do not fit, joints run straight
across the strip.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from gso import faults
from gso.errors import MeshError
from gso.geometry.ears import divided
from gso.geometry.polygon import points_at
from gso.geometry.vectors import lengths
from gso.mesh import Mesh, topology
from gso.ruled.lines.line_surface import line_surface
from gso.ruled.lines.polygons import Polygons
from gso.ruled.ruled_surface import RuledSurface
from gso.ruled.surface_polygons import SurfacePolygons
from gso.typing import Array, Ints

#: Share of the distance between two rulings up to which a joint is moved to one of them.
_NEAR = 0.1
#: Parts at most of a strip that overlaps itself.
_PARTS = 12
#: Places, in widths of the strip, at which a joint across is tried.
_SHIFTS = (-0.03, -0.02, -0.01, 0.0, 0.01, 0.02, 0.03)


#: Whether a part of a pattern is as it should be: its vertices (n, 2) and polygons.
Fits = Callable[[Array, Sequence[Ints]], bool]


def divided_to_fit(
    surface: RuledSurface, design: Mesh, fits: Fits, most: int | None = None
) -> tuple[RuledSurface, Ints]:
    """Divide the strips that do not fit a sheet across, each into parts of equal length.

    A strip stays where its rulings branch or close around, and where no division fits. All strips
    stay where the outline of a polygon between two rulings has a hole.

    Parameters
    ----------
    surface : RuledSurface
    design : Mesh
        What it is near.
    fits : callable
        Takes the vertices (n, 2) of a pattern and the polygons of a part of it, as numbers of
        vertices, and tells whether that fits.
    most : int, optional
        Largest number of parts of a strip.

    Returns
    -------
    surface : RuledSurface
        The same surface with more strips, numbered in the order of those before; their joints are
        creases. The same object where nothing is divided.
    faces : ndarray of int
        For each joint, a face of the surface as it was given in the strip that it divides.
    """
    strips = _Strips.of(surface)
    if strips is None:
        return surface, np.empty(0, np.int64)
    joints: list[_Joint] = []
    for part in range(int(strips.part.max()) + 1):
        cells = np.flatnonzero(strips.part == part)
        if not fits(surface.pattern.flat, [strips.rings[c] for c in cells]):
            joints += strips.divided(cells, fits, most)
    faces = strips.face[[joint.strip for joint in joints]]
    return (strips.joined(joints, design) if joints else surface), faces


def without_overlaps(surface: RuledSurface, design: Mesh) -> RuledSurface:
    """Divide the strips that overlap themselves in the plane across, such as those of spirals.

    Parameters
    ----------
    surface : RuledSurface
    design : Mesh
        What it is near.

    Returns
    -------
    RuledSurface
        As of :func:`divided_to_fit`. The same object where it is not sound otherwise, and where
        strips would be divided into many parts.
    """
    if not (surface.overlaps and surface.untangled):
        return surface

    def fits(flat: Array, rings: Sequence[Ints]) -> bool:
        level = np.pad(flat, ((0, 0), (0, 1)))
        part = Mesh(level, divided(list(rings), level)[0])
        return not faults.overlaps(part, flat).size

    try:
        return divided_to_fit(surface, design, fits, most=_PARTS)[0]
    except MeshError:
        # A joint leaves faces without area.
        return surface


#: A vertex of a pattern, or a place between two: both, and the share of the way.
_Place = tuple[int, int, float]
#: A polygon that a joint divides, -1 along a ruling, and the ends of the joint there.
_Piece = tuple[int, _Place, _Place]


@dataclass(frozen=True)
class _Joint:
    """A line across a strip.

    Attributes
    ----------
    strip : int
        A polygon of the strip.
    pieces : tuple of _Piece
        The line in each polygon that it divides, or along a ruling.
    """

    strip: int
    pieces: tuple[_Piece, ...]


class _Strips(SurfacePolygons):
    """The polygons of a surface, and their division."""

    def divided(self, cells: Ints, fits: Fits, most: int | None) -> list[_Joint]:
        """Return the joints of one strip: as few as there can be; none where nothing fits."""
        order = _in_order(self.pairs, cells)
        if order is None:
            return []
        hinges, path = order
        flat = self.surface.pattern.flat
        middle = flat[self.rulings[hinges]].mean(axis=1)
        ends = [
            2.0 * float(lengths(flat[self.rings[c]].mean(axis=0) - m))
            for c, m in ((path[0], middle[0]), (path[-1], middle[-1]))
        ]
        at = ends[0] + np.cumsum(np.r_[0.0, lengths(np.diff(middle, axis=0))])
        whole = float(at[-1]) + ends[1]
        for count in range(2, 1 + (2 * len(path) if most is None else most)):
            wanted = (whole * np.arange(1, count) / count).tolist()
            for way in (self._joint, self._across):
                found = dict.fromkeys(way(hinges, path, at, place) for place in wanted)
                joints = [joint for joint in found if joint is not None]
                if joints and all(fits(*part) for part in self._parts(path, joints)):
                    return joints
        return []

    def _across(self, hinges: Ints, path: Ints, at: Array, wanted: float) -> _Joint | None:
        """Return the joint straight across the strip at a distance from the begin, if there is one.

        Of several places nearby, that is taken whose ends are the farthest from vertices.
        """
        flat = self.surface.pattern.flat
        if not at[0] < wanted < at[-1]:
            return None
        ends = flat[self.rulings[hinges]]
        width, middle = float(np.median(lengths(ends[:, 1] - ends[:, 0]))), ends.mean(axis=1)
        begin, end = points_at(wanted + np.array([-0.5, 0.5]) * width, at, middle)
        way = end - begin
        way = way / max(float(np.hypot(*way)), 1e-300)
        beyond = {
            (min(a, b), max(a, b)): (int(one), int(two))
            for (a, b), (one, two) in zip(
                self.rulings[hinges].tolist(), self.pairs[hinges].tolist(), strict=True
            )
        }
        best, most = None, 0.0
        for shift in width * np.array(_SHIFTS):
            place = float(np.clip(wanted + shift, at[0], at[-1]))
            off = (flat - points_at(place, at, middle)) @ way
            start = int(path[int(np.searchsorted(at, place))])
            pieces = self._crossed(off, start, beyond)
            clear = min(
                (abs(float(off[v])) for _, *two in pieces for a, b, _ in two for v in (a, b)),
                default=0.0,
            )
            if clear > most:
                best, most = _Joint(start, tuple(pieces)), clear
        return best

    def _crossed(
        self, off: Array, start: int, beyond: dict[tuple[int, int], tuple[int, int]]
    ) -> list[_Piece]:
        """Return the pieces of a line from a polygon to both sides of the strip; else none.

        Parameters
        ----------
        off : ndarray, (n,)
            Distances of the pattern's vertices from the line, with sign.
        start : int
        beyond : dict
            The polygons on both sides of each ruling.
        """
        pieces: list[_Piece] = []
        todo: list[tuple[int, tuple[int, int] | None]] = [(start, None)]
        while todo:
            cell, entry = todo.pop()
            ring = self.rings[cell].tolist()
            edges = [
                (min(a, b), max(a, b))
                for a, b in zip(ring, ring[1:] + ring[:1], strict=True)
                if off[a] * off[b] < 0
            ]
            if len(edges) != 2 or (entry is not None and entry not in edges):
                return []
            one, two = ((a, b, float(off[a] / (off[a] - off[b]))) for a, b in edges)
            pieces.append((cell, one, two))
            for edge in edges:
                if edge != entry and edge in beyond:
                    first, second = beyond[edge]
                    todo.append((second if first == cell else first, edge))
            if len(pieces) > len(self.rings):
                return []
        return pieces

    def _joint(self, hinges: Ints, path: Ints, at: Array, wanted: float) -> _Joint:
        """Return the joint at a distance from the begin, or at a ruling near to it."""
        k = int(np.searchsorted(at, wanted))
        if 0 < k < len(at):
            share = float((wanted - at[k - 1]) / max(at[k] - at[k - 1], 1e-300))
            if _NEAR < share < 1.0 - _NEAR:
                return self._between(int(path[k]), int(hinges[k - 1]), int(hinges[k]), share)
            k -= int(share <= _NEAR)
        a, b = self.rulings[hinges[min(k, len(at) - 1)]].tolist()
        return _Joint(int(path[0]), ((-1, (a, a, 0.0), (b, b, 0.0)),))

    def _between(self, cell: int, before: int, after: int, share: float) -> _Joint:
        """Return the joint between two rulings of a polygon."""
        ring = self.rings[cell].tolist()
        here, there = (set(self.rulings[k].tolist()) for k in (before, after))
        # Turned so that it begins with the second end of the ruling before.
        start = next(i for i in range(len(ring)) if {ring[i - 1], ring[i]} == here)
        ring = ring[start:] + ring[:start]
        mid = next(i for i in range(len(ring) - 1) if {ring[i], ring[i + 1]} == there)
        flat = self.surface.pattern.flat
        one = _along(flat, ring[: mid + 1], share)
        two = _along(flat, ring[mid + 1 :], 1.0 - share)
        return _Joint(cell, ((cell, one, two),))

    def _parts(self, path: Ints, joints: list[_Joint]) -> list[tuple[Array, list[Ints]]]:
        """Return the vertices (n, 2) and the polygons of the parts between joints of a strip."""
        flat = self.surface.pattern.flat
        nodes = _Nodes(flat, {int(c): self.rings[c].tolist() for c in path})
        rings, lines = nodes.divided(np.arange(len(flat)), joints)
        owner: dict[tuple[int, int], int] = {}
        pairs = []
        for number, ring in enumerate(rings):
            for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
                edge = (min(a, b), max(a, b))
                if edge not in lines and owner.setdefault(edge, number) != number:
                    pairs.append((owner[edge], number))
        one, two = np.array(pairs, np.int64).reshape(-1, 2).T
        label = topology.label_components(len(rings), one, two)
        points = np.array(nodes.points)
        return [
            (points, [np.array(rings[k]) for k in np.flatnonzero(label == part)])
            for part in np.unique(label)
        ]

    def joined(self, joints: list[_Joint], design: Mesh) -> RuledSurface:
        """Return the surface with joints."""
        surface, vertex = self.surface, self.surface.pattern.vertex
        own = {cell: vertex[ring].tolist() for cell, ring in enumerate(self.rings)}
        nodes = _Nodes(surface.mesh.vertices, own)
        rings, lines = nodes.divided(vertex, joints)
        rulings = nodes.pieces(vertex[self.rulings])
        kept = np.array([(min(a, b), max(a, b)) not in lines for a, b in rulings.tolist()], bool)
        none = np.empty((0, 3), np.int64)
        polygons = Polygons(
            [np.array(ring) for ring in rings],
            np.zeros(len(rings), np.int64),
            rulings[kept],
            none[:, :2],
            none,
            none,
        )
        made = line_surface(design, polygons, np.array(nodes.points))
        return replace(
            made.measured_pleats(design),
            moved=surface.moved,
            deviation=surface.deviation,
            crossed=surface.crossed,
        )


class _Nodes:
    """Vertices and polygons, with new vertices on edges.

    Parameters
    ----------
    vertices : ndarray, (n, 2) or (n, 3)
    rings : dict of int to list of int
        Corners of polygons, by the polygon's number.

    Attributes
    ----------
    points : list of ndarray
        All vertices, new ones at the end.
    """

    def __init__(self, vertices: Array, rings: dict[int, list[int]]):
        self.vertices, self.rings = vertices, rings
        self.points: list[Array] = list(vertices)
        self._new: dict[tuple[int, int], dict[float, int]] = {}

    def divided(
        self, vertex: Ints, joints: list[_Joint]
    ) -> tuple[list[list[int]], set[tuple[int, int]]]:
        """Return the polygons with joints, and the joints as edges, the smaller vertex first.

        Parameters
        ----------
        vertex : ndarray of int
            For each vertex of the pattern, that of the polygons.
        joints : list of _Joint
        """
        lines = [
            (cell, self.at(vertex, one), self.at(vertex, two))
            for joint in joints
            for cell, one, two in joint.pieces
        ]
        self.insert()
        every = {cell: [ring] for cell, ring in self.rings.items()}
        for cell, a, b in lines:
            if cell >= 0:
                every[cell] = [half for ring in every[cell] for half in _halves(ring, a, b)]
        rings = [ring for several in every.values() for ring in several]
        return rings, {(min(a, b), max(a, b)) for _, a, b in lines}

    def at(self, vertex: Ints, place: _Place) -> int:
        """Return the vertex at a place of the pattern."""
        a, b, share = int(vertex[place[0]]), int(vertex[place[1]]), place[2]
        if a == b:
            return a
        if a > b:
            a, b, share = b, a, 1.0 - share
        known = self._new.setdefault((a, b), {})
        if share not in known:
            known[share] = len(self.points)
            self.points.append((1.0 - share) * self.vertices[a] + share * self.vertices[b])
        return known[share]

    def _between(self, a: int, b: int) -> list[int]:
        """Return the new vertices on an edge, from one end to the other."""
        new = self._new.get((min(a, b), max(a, b)), {})
        return [number for _, number in sorted(new.items(), reverse=a > b)]

    def pieces(self, edges: Ints) -> Ints:
        """Return edges (k, 2) divided at their new vertices."""
        out = [pair for a, b in edges.tolist() for pair in pairwise([a, *self._between(a, b), b])]
        return np.array(out, np.int64).reshape(-1, 2)

    def insert(self) -> None:
        """Insert the new vertices into all polygons with their edges."""
        for ring in self.rings.values():
            out: list[int] = []
            for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
                out += [a, *self._between(a, b)]
            ring[:] = out


def _halves(ring: list[int], a: int, b: int) -> list[list[int]]:
    """Divide a polygon between two of its corners; whole where one of them is none."""
    if a not in ring or b not in ring:
        return [ring]
    i, j = sorted((ring.index(a), ring.index(b)))
    halves = [ring[i : j + 1], ring[j:] + ring[: i + 1]]
    return halves if min(map(len, halves)) > 2 else [ring]


def _along(flat: Array, line: list[int], share: float) -> _Place:
    """Return the place at a share of the length of a polyline of vertices."""
    if len(line) == 1:
        return line[0], line[0], 0.0
    at = np.r_[0.0, np.cumsum(lengths(np.diff(flat[line], axis=0)))]
    k = min(int(np.searchsorted(at, share * at[-1], "right")) - 1, len(line) - 2)
    part = float((share * at[-1] - at[k]) / max(at[k + 1] - at[k], 1e-300))
    for end in (0, 1):
        if abs(part - end) < _NEAR:
            return line[k + end], line[k + end], 0.0
    return line[k], line[k + 1], part


def _in_order(pairs: Ints, cells: Ints) -> tuple[Ints, Ints] | None:
    """Return the rulings and the polygons of a strip from end to end; None where it branches."""
    own = np.flatnonzero(np.isin(pairs[:, 0], cells))
    degree = np.bincount(pairs[own].ravel(), minlength=int(cells.max()) + 1)
    if not len(own) or len(own) != len(cells) - 1 or degree.max() > 2:
        return None
    at: dict[int, list[int]] = {int(c): [] for c in cells}
    for k in own.tolist():
        for end in pairs[k].tolist():
            at[end].append(k)
    here = int(cells[(degree[cells] == 1).argmax()])
    rulings: list[int] = []
    path = [here]
    while len(rulings) < len(own):
        k = next(k for k in at[here] if not rulings or k != rulings[-1])
        here = int(pairs[k].sum()) - here
        rulings.append(k)
        path.append(here)
    return np.array(rulings), np.array(path)

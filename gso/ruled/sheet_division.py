"""Strips that are longer than a sheet, divided across: along rulings, or between two of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from gso.geometry.vectors import lengths
from gso.mesh import Mesh, topology
from gso.mesh.topology import pair_keys
from gso.ruled.lines.line_surface import line_surface
from gso.ruled.lines.polygons import Polygons
from gso.ruled.ruled_surface import RuledSurface
from gso.typing import Array, Ints

#: Share of the distance between two rulings up to which a joint is moved to one of them.
_NEAR = 0.1


def divided_to_fit(
    surface: RuledSurface, design: Mesh, fits: Callable[[Array], bool]
) -> RuledSurface:
    """Divide the strips that do not fit a sheet across, each into parts of equal length.

    A strip stays where its rulings branch or close around, and where no division fits.

    Parameters
    ----------
    surface : RuledSurface
    design : Mesh
        What it is near.
    fits : callable
        Takes the vertices (k, 2) of a part of the pattern, and tells whether it fits.

    Returns
    -------
    RuledSurface
        The same surface with more strips, numbered in the order of those before; their joints are
        creases. The same object where nothing is divided.
    """
    strips = _Strips.of(surface)
    if strips is None:
        return surface
    joints: list[_Joint] = []
    for part in range(int(strips.part.max()) + 1):
        cells = np.flatnonzero(strips.part == part)
        flat = surface.pattern.flat[np.concatenate([strips.rings[c] for c in cells])]
        if not fits(flat):
            joints += strips.divided(cells, fits)
    return strips.joined(joints, design) if joints else surface


#: A vertex of a pattern, or a place between two: both, and the share of the way.
_Place = tuple[int, int, float]


@dataclass(frozen=True)
class _Joint:
    """A line across a strip, between places on both of its sides, in a polygon or along a ruling.

    Attributes
    ----------
    cell : int
        The polygon; -1 along a ruling.
    one, two : _Place
    """

    cell: int
    one: _Place
    two: _Place


@dataclass(frozen=True)
class _Strips:
    """A surface as polygons between rulings.

    Attributes
    ----------
    surface : RuledSurface
    rings : list of ndarray of int
        Corners of the polygons, vertices of the pattern, anticlockwise.
    part : ndarray of int, (p,)
        The part of the pattern that each is in.
    pairs : ndarray of int, (r, 2)
        The polygons on both sides of the rulings.
    rulings : ndarray of int, (r, 2)
        The rulings, as edges of the pattern.
    """

    surface: RuledSurface
    rings: list[Ints]
    part: Ints
    pairs: Ints
    rulings: Ints

    @classmethod
    def of(cls, surface: RuledSurface) -> _Strips | None:
        """Read a surface; None where a polygon has a hole, or touches itself."""
        pattern = surface.pattern
        he, n = pattern.mesh.half_edges, len(pattern.flat)
        inner = np.flatnonzero((he.twin >= 0) & (he.origin < he.dest))
        key = pair_keys(np.stack([he.origin[inner], he.dest[inner]], axis=1), n)
        hinge = np.isin(key, pair_keys(surface.folded.edges, n))
        one, two = he.face[inner], he.face[he.twin[inner]]
        count = len(pattern.faces)
        cell = topology.label_components(count, one[~hinge], two[~hinge])
        part = topology.label_components(count, one, two)
        # In the order of strips.
        first = np.unique(cell, return_index=True)[1]
        rank = np.empty(len(first), np.int64)
        rank[np.lexsort((first, surface.strip[first]))] = np.arange(len(first))
        cell = rank[np.unique(cell, return_inverse=True)[1]]
        first = np.unique(cell, return_index=True)[1]
        k = np.flatnonzero(he.face >= 0)
        twin = np.where(he.twin[k] >= 0, cell[he.face[he.twin[k]]], -1)
        k = k[twin != cell[he.face[k]]]
        after: list[dict[int, int]] = [{} for _ in first]
        for own, a, b in zip(
            cell[he.face[k]].tolist(), he.origin[k].tolist(), he.dest[k].tolist(), strict=True
        ):
            if a in after[own]:
                return None
            after[own][a] = b
        rings = []
        for ways in after:
            ring = [next(iter(ways))]
            while (ahead := ways[ring[-1]]) != ring[0]:
                ring.append(ahead)
            if len(ring) < len(ways):
                return None
            rings.append(np.array(ring))
        at = inner[hinge]
        pairs = np.stack([cell[he.face[at]], cell[he.face[he.twin[at]]]], axis=1)
        ends = np.stack([he.origin[at], he.dest[at]], axis=1)
        return cls(surface, rings, np.unique(part[first], return_inverse=True)[1], pairs, ends)

    def divided(self, cells: Ints, fits: Callable[[Array], bool]) -> list[_Joint]:
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
        for count in range(2, 2 * len(path) + 1):
            wanted = whole * np.arange(1, count) / count
            found = dict.fromkeys(self._place(hinges, path, at, place) for place in wanted.tolist())
            if all(fits(points) for points in self._parts(path, hinges, list(found))):
                return [joint for _, joint in found]
        return []

    def _place(self, hinges: Ints, path: Ints, at: Array, wanted: float) -> tuple[float, _Joint]:
        """Return the position in the path, and the joint nearest to a distance from the begin."""
        k = int(np.searchsorted(at, wanted))
        if 0 < k < len(at):
            share = (wanted - at[k - 1]) / max(at[k] - at[k - 1], 1e-300)
            if _NEAR < share < 1.0 - _NEAR:
                return k + float(share), self._between(
                    int(path[k]), hinges[k - 1], hinges[k], share
                )
            k -= int(share <= _NEAR)
        k = min(k, len(at) - 1)
        a, b = self.rulings[hinges[k]].tolist()
        return k + 1.0, _Joint(-1, (a, a, 0.0), (b, b, 0.0))

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
        return _Joint(cell, one, _along(flat, ring[mid + 1 :], 1.0 - share))

    def _parts(self, path: Ints, hinges: Ints, joints: list[tuple[float, _Joint]]) -> list[Array]:
        """Return the vertices (k, 2) of the parts between joints."""
        flat = self.surface.pattern.flat

        def point(place: _Place) -> Array:
            a, b, share = place
            return np.asarray((1.0 - share) * flat[a] + share * flat[b])

        out = []
        bounds: list[tuple[float, _Joint | None]] = [(0.0, None), *joints, (float(len(path)), None)]
        for (low, first), (high, last) in pairwise(bounds):
            ids = [self.rings[path[k]] for k in range(int(np.ceil(low)), int(np.floor(high)))]
            points = [flat[np.concatenate(ids)]] if ids else []
            for joint in (first, last):
                if joint is not None:
                    points.append(np.stack([point(joint.one), point(joint.two)]))
            # Corners between a joint inside a polygon and the next ruling.
            for bound, hinge in ((low, int(np.ceil(low)) - 1), (high, int(np.floor(high)) - 1)):
                if bound % 1.0 and 0 <= hinge < len(hinges):
                    points.append(flat[self.rulings[hinges[hinge]]])
            out.append(np.concatenate(points))
        return out

    def joined(self, joints: list[_Joint], design: Mesh) -> RuledSurface:
        """Return the surface with joints."""
        surface, vertex = self.surface, self.surface.pattern.vertex
        nodes = _Nodes(surface.mesh.vertices, [vertex[ring].tolist() for ring in self.rings])
        lines = [(j.cell, nodes.at(vertex, j.one), nodes.at(vertex, j.two)) for j in joints]
        nodes.insert()
        rings = [[ring] for ring in nodes.rings]
        joined = {(min(a, b), max(a, b)) for _, a, b in lines}
        for cell, a, b in lines:
            if cell >= 0:
                rings[cell] = [half for ring in rings[cell] for half in _halves(ring, a, b)]
        mesh_rulings = vertex[self.rulings]
        kept = [tuple(sorted(e)) not in joined for e in mesh_rulings.tolist()]
        every = [np.array(ring) for several in rings for ring in several]
        none = np.empty((0, 3), np.int64)
        polygons = Polygons(
            every,
            np.zeros(len(every), np.int64),
            mesh_rulings[np.array(kept, bool)],
            none[:, :2],
            none,
            none,
        )
        made = line_surface(design, polygons, np.array(nodes.points))
        return replace(
            made, moved=surface.moved, deviation=surface.deviation, crossed=surface.crossed
        )


@dataclass
class _Nodes:
    """Vertices and polygons, with new vertices on edges.

    Attributes
    ----------
    vertices : ndarray, (n, 3)
    rings : list of list of int
    points : list of ndarray, (3,)
        All vertices, new ones at the end.
    """

    vertices: Array
    rings: list[list[int]]
    points: list[Array] = field(init=False)

    def __post_init__(self) -> None:
        self.points = list(self.vertices)
        self._new: dict[tuple[int, int], dict[float, int]] = {}

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

    def insert(self) -> None:
        """Insert the new vertices into all polygons with their edges."""
        for ring in self.rings:
            out: list[int] = []
            for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
                out.append(a)
                new = sorted(self._new.get((min(a, b), max(a, b)), {}).items(), reverse=a > b)
                out += [number for _, number in new]
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

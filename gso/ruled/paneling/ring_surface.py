"""Surfaces of revolution of polygons, with facets: whole, or cut along the outline of a design."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from gso.geometry.polygon import arc_lengths
from gso.geometry.steady import steady
from gso.mesh import Mesh
from gso.mesh.polyline import Polylines
from gso.mesh.separation import centres
from gso.ruled.lines.line_surface import line_surface
from gso.ruled.lines.polygons import Polygons
from gso.ruled.ruled_surface import RuledSurface
from gso.seams.profile_sections import directions
from gso.seams.revolution import Revolution
from gso.typing import Array, Flags, Ints

if TYPE_CHECKING:
    from shapely import Geometry

#: Least and largest number of facets of a ring, and the part of the allowed distance that the
#: facets are to be within of the circle.
_FACETS, ROUND = (48, 256), 0.02
#: Distance of the outline from the ends of the polygon, and from the axis, over the allowed one, up
#: to which it is there.
_AT_END, _ON_AXIS = 0.1, 0.5
#: Step to which places on the surface are rounded, in facets and in lengths of the polygon.
_STEP = 1e-7
#: Largest number of face centres by which the inside of the outline is found.
_SOME = 200


class RingSurface:
    """Facets of the surface of revolution of a polygon.

    Places on it are counted by facets around the axis, and by lengths of the polygon over its
    whole length.

    Parameters
    ----------
    design : Mesh
    body : Revolution
    polygon : ndarray, (k + 1, 2)
        Radius and height.
    allowed : float
        Distance from the design, by which the number of facets is chosen. They are as far inside
        of the circles as outside.
    """

    def __init__(self, design: Mesh, body: Revolution, polygon: Array, allowed: float):
        self.design, self.body, self.polygon = design, body, polygon
        self.allowed = allowed
        count = int(np.ceil(np.pi / np.sqrt(2.0 * ROUND * allowed / float(polygon[:, 0].max()))))
        self.count = int(np.clip(count, *_FACETS))
        self.ways = directions(design, body.origin, body.axis)
        self.is_closed = body.is_closed
        along = arc_lengths(polygon)
        self.size = float(along[-1])
        self.levels = along / self.size

    def whole(self) -> RuledSurface:
        """Return the whole surface."""
        rows, count = self._rows, self.count
        points = self._at(np.arange(1.0 * count), np.arange(rows + 1.0)[:, None]).reshape(-1, 3)
        ids = np.arange((rows + 1) * count).reshape(rows + 1, count)
        on_axis = self.polygon[:, 0] == 0.0
        ids[on_axis] = ids[on_axis, :1]
        if self.is_closed:
            ids[-1] = ids[0]
        after = np.roll(ids, -1, axis=1)
        # The normals are on the left of the profile.
        corners = np.stack([ids[:-1], ids[1:], after[1:], after[:-1]], axis=-1).reshape(-1, 4)
        different = corners != np.roll(corners, 1, axis=1)
        polygons = _polygons(
            [ring[own] for ring, own in zip(corners, different, strict=True)],
            np.repeat(np.arange(rows), count),
            np.stack([ids[:-1], ids[1:]], axis=-1).reshape(-1, 2),
            np.stack([ids, after], axis=-1)[0 if self.is_closed else 1 : -1].reshape(-1, 2),
        )
        return line_surface(self.design, polygons, points).measured(self.design)

    def within_outline(self) -> RuledSurface | None:
        """Return the part within the outline of the design; None where it has no such outline."""
        import shapely

        region = self._region()
        if region is None or region.is_empty:
            return None
        k, row = (x.ravel() for x in np.meshgrid(np.arange(self.count), np.arange(self._rows)))
        cells = shapely.box(k, self.levels[row], k + 1.0, self.levels[row + 1])
        cut = partial(shapely.intersection, grid_size=_STEP)
        pieces, of_cell = shapely.get_parts(steady(cut, cells, region), return_index=True)
        kept = (shapely.get_type_id(pieces) == 3) & (shapely.area(pieces) > 0.0)
        pieces, of_cell = pieces[kept], of_cell[kept]
        if not len(pieces) or shapely.get_num_interior_rings(pieces).any():
            # A hole within a facet.
            return None
        rings = shapely.get_exterior_ring(pieces)
        # As those of the whole surface: the normals are on the left of the profile.
        rings = np.where(shapely.is_ccw(rings), shapely.reverse(rings), rings)
        places, of_piece = shapely.get_coordinates(rings, return_index=True)
        # Rings end where they begin.
        last = np.append(np.diff(of_piece) > 0, True)
        places, of_piece = places[~last], of_piece[~last]
        return self._of_pieces(places, of_piece, k[of_cell], row[of_cell])

    @property
    def _rows(self) -> int:
        return len(self.polygon) - 1

    def _at(self, turn: Array, level: Array) -> Array:
        """Return points (..., 3) by numbers of facets and of sides of the polygon.

        Whole numbers are their beginnings, and fractions are places along them.
        """
        whole, row = np.floor(turn), np.minimum(np.floor(level), self._rows - 1).astype(int)
        part = (level - row)[..., None]
        profile = (1.0 - part) * self.polygon[row] + part * self.polygon[row + 1]
        ends = []
        for k in (whole, whole + 1.0):
            angle = 2.0 * np.pi * (k % self.count) / self.count
            ends.append(
                np.cos(angle)[..., None] * self.ways[0] + np.sin(angle)[..., None] * self.ways[1]
            )
        share = (turn - whole)[..., None]
        round_it = (1.0 - share) * ends[0] + share * ends[1]
        out = 2.0 / (1.0 + np.cos(np.pi / self.count))
        radius, height = profile[..., :1], profile[..., 1:]
        return np.asarray(out * radius * round_it + height * self.body.axis + self.body.origin)

    def _of_pieces(self, places: Array, of_piece: Ints, facet: Ints, row: Ints) -> RuledSurface:
        """Return the surface of parts of facets, with the places (n, 2) of their corners."""
        turn, level = places.T
        end = np.searchsorted(self.levels, level - 2.0 * _STEP)
        on_level = np.abs(self.levels[np.minimum(end, self._rows)] - level) <= 2.0 * _STEP
        on_ruling = np.abs(turn - np.round(turn)) <= 2.0 * _STEP
        own = row[of_piece]
        low, high = self.levels[own], self.levels[own + 1]
        number = np.where(on_level, end, own + (level - low) / (high - low))
        turned = np.where(on_ruling, np.round(turn), turn)
        # Angles are even along facets, places are not.
        half = np.pi / self.count
        share = 0.5 + np.tan((turned - facet[of_piece] - 0.5) * 2.0 * half) / (2.0 * np.tan(half))
        along = np.where(on_ruling, turned, facet[of_piece] + share)
        first, ids = self._same(turned, level, np.where(on_level, end, -1))
        points = self._at(along[first], number[first])
        begins = np.flatnonzero(np.diff(of_piece, prepend=-1))
        rings = [_without_repeats(ring) for ring in np.split(ids, begins[1:])]
        keep = [len(ring) > 2 for ring in rings]
        after = np.arange(1, len(ids) + 1)
        after[np.append(begins[1:], len(ids)) - 1] = begins
        same_ruling = on_ruling & on_ruling[after] & (turned == turned[after])
        same_level = on_level & on_level[after] & (end == end[after])
        edges = np.stack([ids, ids[after]], axis=1)
        rulings = edges[same_ruling & (ids != ids[after])]
        around, long = np.round(turned).astype(int) % self.count, np.abs(level[after] - level)
        opened = self._opened(edges, around, long, own, same_ruling)
        polygons = _polygons(
            [ring for ring, sound in zip(rings, keep, strict=True) if sound],
            row[np.array(keep)],
            rulings,
            edges[same_level & (ids != ids[after])],
        )
        return line_surface(self.design, polygons, points, opened=opened).measured(self.design)

    def _same(self, turn: Array, level: Array, end: Ints) -> tuple[Ints, Ints]:
        """Return the first of all corners that are the same, and the number of each (n,).

        Parameters
        ----------
        turn, level : ndarray, (n,)
        end : ndarray of int, (n,)
            Corner of the polygon, -1 between two.
        """
        key = np.stack([np.round(turn / _STEP), np.round(level / _STEP)], axis=1)
        key[:, 0] %= np.round(self.count / _STEP)
        there = end >= 0
        key[there, 1] = -1.0 - (end[there] % self._rows if self.is_closed else end[there])
        key[there & (self.polygon[end, 0] == 0.0), 0] = 0.0
        _, first, ids = np.unique(key, axis=0, return_index=True, return_inverse=True)
        return first, ids.ravel()

    def _opened(self, edges: Ints, turn: Ints, long: Array, row: Ints, is_ruling: Flags) -> Ints:
        """Return the rulings (k, 2) along which rings are opened that close around the axis.

        They are at the angle where they are shortest in all.
        """
        found = [np.empty((0, 2), np.int64)]
        for number in range(self._rows):
            own = is_ruling & (row == number)
            length = np.bincount(turn[own], long[own], self.count)
            if (length > 0.0).all():
                found.append(edges[own & (turn == int(length.argmin()))])
        return np.concatenate(found)

    def _region(self) -> Geometry | None:
        """Return what is within the outline, in places; None where the outline has none."""
        import shapely
        from shapely.affinity import translate

        count = float(self.count)
        every = shapely.box(0.0, 0.0, count, 1.0)
        found = shapely.Polygon()
        for loop in self.design.boundary_loops:
            place = self._places(loop)
            if place is None:
                return None
            around = np.round((place[-1] - place[0]) / [count, 1.0]).astype(int)
            if np.abs(around).sum() > 1 or (around[1] and not self.is_closed):
                return None
            if around[1]:
                place = _from_beginning(place)
            area = _area(place, around, count)
            first, last = _copies(place, [count, 1.0])
            for k in range(first[0], last[0] + 1):
                for row in range(first[1], last[1] + 1) if self.is_closed else (0,):
                    own = steady(shapely.intersection, translate(area, k * count, row), every)
                    found = steady(shapely.symmetric_difference, found, own)
        middle = centres(self.design)
        middle = middle[:: max(len(middle) // _SOME, 1)]
        turn, level, _ = self._located(middle)
        inside = shapely.contains_xy(found, turn % count, level)
        return found if inside.mean() > 0.5 else steady(shapely.difference, every, found)

    def _located(self, points: Array) -> tuple[Array, Array, Array]:
        """Return the places of points (n, 3): facets, lengths, and the distance from the axis."""
        away = points - self.body.origin
        height = away @ self.body.axis
        x, y = (away @ way for way in self.ways)
        radius = np.hypot(x, y)
        feet = Polylines.of(self.polygon, closed=False).nearest(np.stack([radius, height], axis=1))
        part = np.clip(feet.along, 0.0, 1.0)
        low, high = self.levels[feet.segment], self.levels[feet.segment + 1]
        level = low + part * (high - low)
        near = _AT_END * self.allowed / self.size
        if not self.is_closed:
            level = np.where(level <= near, 0.0, np.where(level >= 1.0 - near, 1.0, level))
        return np.arctan2(y, x) * self.count / (2.0 * np.pi), level, radius

    def _places(self, loop: Ints) -> Array | None:
        """Return places (k + 1, 2) around a boundary loop, back to its first vertex.

        They go on over whole turns. At a vertex on the axis there are two.
        """
        turn, level, radius = self._located(self.design.vertices[loop])
        on_axis = radius <= _ON_AXIS * self.allowed
        if on_axis.all():
            return None
        # From a vertex off the axis back to it.
        order = np.roll(np.arange(len(loop)), -int((~on_axis).argmax()))
        off = order[~on_axis[order]]
        step = turn[np.roll(off, -1)] - turn[off]
        step -= self.count * np.round(step / self.count)
        # The boundary turns at the axis with the surface on its right, as it is seen from outside.
        poles = np.flatnonzero(on_axis[(off + 1) % len(loop)])
        end = level[(off[poles] + 1) % len(loop)]
        way = np.where(end < 0.5, -1.0, 1.0)
        step[poles] = way * (way * step[poles] % self.count)
        place = np.stack([np.cumsum(np.r_[turn[off[0]], step]), level[np.r_[off, off[0]]]], axis=1)
        if self.is_closed:
            rise = np.diff(place[:, 1])
            place[1:, 1] = place[0, 1] + np.cumsum(rise - np.round(rise))
        ends = [np.stack([place[poles + k, 0], end], axis=1) for k in (0, 1)]
        added = np.stack(ends, axis=1).reshape(-1, 2)
        return np.insert(place, np.repeat(poles + 1, 2), added, axis=0)


def _from_beginning(place: Array) -> Array:
    """Let a line that closes around the profile begin and end where the profile does.

    The copies of its area then meet there. Elsewhere they would add corners to some facets only.
    """
    level = place[:, 1]
    whole = np.floor(level)
    k = int(np.flatnonzero(np.diff(whole))[0])
    end = max(whole[k], whole[k + 1])
    share = (end - level[k]) / (level[k + 1] - level[k])
    first = np.array([place[k, 0] + share * (place[k + 1, 0] - place[k, 0]), end])
    once = np.round(place[-1] - place[0])
    return np.concatenate([[first], place[k + 1 : -1], place[: k + 1] + once, [first + once]])


def _area(place: Array, around: Ints, count: float) -> Geometry:
    """Return the area within a line, or beside one that closes around the axis or the profile."""
    import shapely

    if around[0]:
        # Below it.
        place = np.concatenate([place, [[place[-1, 0], -3.0], [place[0, 0], -3.0]]])
    elif around[1]:
        low = -3.0 * count
        place = np.concatenate([place, [[low, place[-1, 1]], [low, place[0, 1]]]])
    valid = partial(shapely.make_valid, method="structure", keep_collapsed=False)
    return steady(valid, shapely.Polygon(place))


def _copies(place: Array, period: Sequence[float]) -> tuple[list[int], list[int]]:
    """Return the first and last numbers of periods by which a line is moved into the first one."""
    first = np.ceil(-place.max(axis=0) / period).astype(int).tolist()
    return first, np.floor(1.0 - place.min(axis=0) / period).astype(int).tolist()


def _without_repeats(ring: Ints) -> Ints:
    """Leave out corners that are the same as the one before."""
    return np.asarray(ring[ring != np.roll(ring, 1)])


def _polygons(rings: list[Ints], strip: Ints, rulings: Ints, creases: Ints) -> Polygons:
    none = np.empty((0, 3), np.int64)
    return Polygons(rings, strip, rulings, creases, lines=none, across=none)

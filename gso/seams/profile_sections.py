"""Profiles of bodies of revolution about a known axis: sections by half-planes, and their mean."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix, diags
from scipy.sparse.csgraph import depth_first_order

from gso import metrics
from gso.geometry.polygon import arc_lengths, densified
from gso.geometry.vectors import lengths, unit
from gso.linalg import spd
from gso.mesh import Mesh
from gso.mesh.polyline import Polylines
from gso.mesh.separation import centres
from gso.mesh.topology import edge_graph, label_components
from gso.seams.straightening import stops
from gso.typing import Array, Flags, Ints

#: Largest distance of the surface from that of its profile over the allowed one.
_SHARE = 0.5
#: Least distance from the axis of the vertex that sections begin at, over the largest one.
_FAR = 0.5
#: Angle of the first section from that vertex: sections through vertices meet edges at their ends.
_BESIDE = 0.3
#: Number of sections, how many of a part of a body are whole at least, and steps of the profile's
#: line over its length.
_SECTIONS, _WHOLE_ONES, _STEPS = 16, 3, 100
#: Share of the length of a section that its main part has at least.
_WHOLE = 0.95
#: Distance of points that are the same, over the length of the section.
_EQUAL = 1e-7
#: Weight of the squared second differences of the displacement of the profile.
_FAIR = 4.0
#: Weight of the displacement itself, for points without sections near them.
_NOTHING = 1e-9
#: Largest distance of the profile in fewer points, over the allowed distance and over the root mean
#: square distance of the sections.
_SIMPLE, _NOISE = 0.02, 0.2
#: Number of vertices whose distance from the profile is measured first, and in all.
_FEW, _MANY = 500, 5_000
#: Largest distance of sections in fewer points from themselves, over the allowed distance.
_FINE = 0.005
#: Sine of the angle up to which an edge is along a circle about the axis, or in a plane with it.
_ALONG = 0.05
#: Share of the boundary of a part of a body that is along circles and in planes with the axis, or
#: of sections that are nearly whole.
MOSTLY = 0.5
#: Length of sections, over that of the longest, from which on they are as long, or nearly.
_LONG, _NEARLY = 1.0 - 1e-6, 0.9


def directions(mesh: Mesh, origin: Array, axis: Array) -> tuple[Array, Array]:
    """Return two unit vectors perpendicular to an axis and to each other.

    The first is beside a vertex of the mesh, so that they turn with it.
    """
    away = mesh.vertices[mesh.used] - origin
    away = away - (away @ axis)[:, None] * axis
    far = lengths(away)
    one = unit(away[int((far > _FAR * far.max()).argmax())])
    two = np.cross(axis, one)
    c, s = np.cos(_BESIDE), np.sin(_BESIDE)
    return c * one + s * two, c * two - s * one


def aligned(mesh: Mesh, origin: Array, axis: Array) -> float:
    """Return the share of a boundary along circles about an axis and in planes with it."""
    he = mesh.half_edges
    rim = he.twin < 0
    a, b = (mesh.vertices[end[rim]] - origin for end in (he.origin, he.dest))
    size = lengths(b - a)
    round_it = unit(np.cross(axis, 0.5 * (a + b)))
    share = np.abs(np.einsum("kd,kd->k", b - a, round_it)) / np.maximum(size, 1e-300)
    known = (share <= _ALONG) | (share >= np.sqrt(1.0 - _ALONG**2))
    return float(size[known].sum() / max(float(size.sum()), 1e-300))


class Sections:
    """Sections of a triangle mesh by half-planes that begin at an axis."""

    def __init__(self, mesh: Mesh, origin: Array, axis: Array):
        self.mesh, self.origin, self.axis = mesh, origin, axis
        one, two = directions(mesh, origin, axis)
        local = mesh.vertices - origin
        self._x, self._y, self._z = local @ one, local @ two, local @ axis
        he = mesh.half_edges
        self._sides = mesh.edge_numbers(he.origin, he.dest).reshape(-1, 3)

    @cached_property
    def _places(self) -> Array:
        """Radius and height (n, 2) of all vertices."""
        return np.stack([np.hypot(self._x, self._y), self._z], axis=1)

    @cached_property
    def points(self) -> Array:
        """Radius and height (n, 2) of the vertices that are used."""
        return self._places[self.mesh.used]

    @cached_property
    def rim(self) -> Array:
        """Radius and height (k, 2) of the vertices on the boundary."""
        return self._places[self.mesh.half_edges.boundary_vertex]

    def profile(self, distance: float) -> tuple[Array, float] | None:
        """Return the profile of a body of revolution; None if it is none about this axis.

        Parameters
        ----------
        distance : float
            Half of it is how far the mesh may be from the body.

        Returns
        -------
        profile : ndarray, (p, 2)
            Radius and height, with the normals on the left.
        apart : float
            Largest distance of the mesh from the body.
        """
        near = _FINE * distance
        line = self.section(0.0, near)
        if line is None or self._is_off(line, distance):
            return None
        others = [self.section(turn, near) for turn in self._turns[1:]]
        known = [other for other in others if other is not None]
        if len(known) < len(others):
            return None
        found = self._mean(line, known, distance)
        if found is None or not self._ends_at(found[0][[0, -1]], _SHARE * distance):
            return None
        return self._simple(*found, distance)

    def part_profile(self, distance: float) -> tuple[Array, float] | None:
        """Return the profile of a body of which the mesh is a part, as :meth:`profile`.

        At least half of the boundary is along circles about the axis or in planes with it, such as
        that of a dome with a door, or most sections are nearly as long as the longest.
        """
        known = [self.section(turn, _FINE * distance) for turn in self._turns]
        lines = [line for line in known if line is not None]
        if len(lines) < _WHOLE_ONES:
            return None
        long = np.array([arc_lengths(line)[-1] for line in lines])
        line = lines[int((long >= _LONG * long.max()).argmax())]
        around = (long >= _NEARLY * long.max()).sum() >= MOSTLY * _SECTIONS
        if not around and aligned(self.mesh, self.origin, self.axis) < MOSTLY:
            return None
        if self._is_off(line, distance):
            return None
        found = self._mean(line, lines, distance)
        return None if found is None else self._simple(*found, distance)

    @property
    def _turns(self) -> list[float]:
        return [2.0 * np.pi * k / _SECTIONS for k in range(_SECTIONS)]

    def _is_off(self, line: Array, distance: float) -> bool:
        """Tell whether some vertex is farther from a section than from any profile."""
        return bool(_away(_some(self.points, _FEW), line).max() > 2.0 * _SHARE * distance)

    def _mean(self, line: Array, known: list[Array], distance: float) -> tuple[Array, Array] | None:
        """Return the mean of sections, and their distances from it; None if some are too far."""
        samples = np.concatenate([line, *known])
        line = self._ended(_averaged(line, samples), line[[0, -1], 0] == 0.0, _SHARE * distance)
        off = np.r_[_away(samples, line), _away(_some(self.points, _MANY), line).max()]
        return None if off.max() > _SHARE * distance else (line, off)

    def _ends_at(self, ends: Array, near: float) -> bool:
        """Tell whether every circle at an end is part of the boundary, which has no other parts."""
        if not len(self.rim):
            return True
        gaps = np.linalg.norm(self.rim[:, None] - ends, axis=2)
        free = ends[:, 0] > 0.0
        return bool(gaps.min(axis=1).max() <= near and (gaps.min(axis=0)[free] <= near).all())

    def _simple(self, line: Array, off: Array, distance: float) -> tuple[Array, float]:
        """Return a line in fewer points, with the normals on its left, and its distance."""
        simple = _SIMPLE * distance + _NOISE * float(np.sqrt((off[:-1] ** 2).mean()))
        profile = line[stops(line, simple, len(line))]
        if not self._on_left(profile):
            profile = profile[::-1]
        return profile, float(off.max())

    def _on_left(self, line: Array) -> bool:
        """Tell whether most normals of the mesh are on the left of a line (radius, height)."""
        middle = _some(centres(self.mesh), _MANY) - self.origin
        height = middle @ self.axis
        away = middle - height[:, None] * self.axis
        radius = lengths(away)
        normal = _some(metrics.face_normals(self.mesh), _MANY)
        across = np.einsum("md,md->m", normal, unit(away)), normal @ self.axis
        feet = Polylines.of(line, closed=False).nearest(np.stack([radius, height], axis=1))
        way = np.diff(line, axis=0)[feet.segment]
        return bool((across[1] * way[:, 0] - across[0] * way[:, 1]).sum() >= 0.0)

    def section(self, turn: float, near: float) -> Array | None:
        """Return the line (k, 2) of radius and height in a half-plane; None if it is not one.

        It has points in about equal steps, and a given largest distance from the section.

        It begins and ends at the boundary of the mesh or on the axis. A closed one begins at its
        least radius, and its first point is repeated at the end.
        """
        height = self._y * np.cos(turn) - self._x * np.sin(turn)
        height = np.where(height == 0.0, 1e-12 * self.mesh.diagonal, height)
        across = self._x * np.cos(turn) + self._y * np.sin(turn)
        a, b = self.mesh.edges.T
        crossed = (height[a] > 0.0) != (height[b] > 0.0)
        share = height[a] / np.where(crossed, height[a] - height[b], 1.0)
        points = np.stack([x[a] + share * (x[b] - x[a]) for x in (across, self._z)], axis=1)
        hit = crossed[self._sides]
        links = self._sides[hit.sum(axis=1) == 2][hit[hit.sum(axis=1) == 2]].reshape(-1, 2)
        inside = points[links, 0] > 0.0
        ends = links[inside.sum(axis=1) == 1]
        ends = np.where(points[ends[:, :1], 0] > 0.0, ends, ends[:, ::-1])
        one, two = points[ends[:, 0]], points[ends[:, 1]]
        place = one[:, 1] - one[:, 0] * (two[:, 1] - one[:, 1]) / (two[:, 0] - one[:, 0])
        middle = np.stack([np.zeros(len(ends)), place], axis=1)
        added = np.stack([ends[:, 0], len(points) + np.arange(len(ends))], axis=1)
        links = np.concatenate([links[inside.all(axis=1)], added])
        line = _line(np.concatenate([points, middle]), links)
        if line is None:
            return None
        return densified(line[stops(line, near, len(line))], arc_lengths(line)[-1] / _STEPS)

    def _ended(self, line: Array, on_axis: Flags, near: float) -> Array:
        """Move the ends of an open line onto the axis, or to where the boundary is near them."""
        line = line.copy()
        line[:, 0] = np.maximum(line[:, 0], 0.0)
        if np.array_equal(line[0], line[-1]):
            return line
        line[[0, -1], 0] = np.where(on_axis, 0.0, line[[0, -1], 0])
        gaps = np.linalg.norm(self.rim[:, None] - line[[0, -1]], axis=2)
        for number, end in enumerate((0, -1)):
            own = self.rim[(gaps.argmin(axis=1) == number) & (gaps[:, number] <= near)]
            if len(own) and not on_axis[number]:
                # Along the line only, whose distance from the axis is known better.
                way = unit(line[end] - line[end - 1 if end else 1])
                line[end] += ((np.median(own, axis=0) - line[end]) @ way) * way
        return line


def _line(points: Array, links: Ints) -> Array | None:
    """Return the points of the only long line that links (k, 2) between points make."""
    if len(links) < 2:
        return None
    used, ends = np.unique(links, return_inverse=True)
    points, ends = points[used], ends.reshape(-1, 2)
    label = label_components(len(points), *ends.T)[ends[:, 0]]
    size = np.bincount(label, np.linalg.norm(np.diff(points[ends], axis=1)[:, 0], axis=1))
    if size.max() < _WHOLE * size.sum():
        return None
    ends = ends[label == size.argmax()]
    single = np.flatnonzero(np.bincount(ends.ravel(), minlength=len(points)) == 1)
    if len(single):
        first, closed = int(single[0]), False
    else:
        first, closed = int(ends.ravel()[points[ends.ravel(), 0].argmin()]), True
        ends = np.delete(ends, np.flatnonzero((ends == first).any(axis=1))[0], axis=0)
    graph = edge_graph(len(points), *ends.T)
    order = depth_first_order(graph, first, directed=False, return_predecessors=False)
    if closed:
        order = np.r_[order, first]
    line = points[order]
    # Edges that meet in a vertex are crossed at the same point.
    apart = np.linalg.norm(np.diff(line, axis=0), axis=1) > _EQUAL * size.max()
    line = line[np.r_[True, apart]]
    line[-1] = points[order[-1]]
    return np.asarray(line)


def _some(points: Array, count: int) -> Array:
    """Return about as many of some points as are wanted."""
    return points[:: max(len(points) // count, 1)]


def _away(points: Array, line: Array) -> Array:
    """Return the distance (n,) of points (n, 2) from a line."""
    feet = Polylines.of(line, closed=False).nearest(points)
    return np.asarray(np.linalg.norm(points - feet.points, axis=1))


def _averaged(line: Array, samples: Array) -> Array:
    """Move the points of a line (k, 2) along its normals to the mean of points (n, 2) near it."""
    closed = np.array_equal(line[0], line[-1])
    count = len(line) - closed
    inner = np.arange(count) if closed else np.arange(1, count - 1)
    turn = np.stack([inner - 1, inner, inner + 1], axis=1) % count
    bent = _table(turn, np.tile([1.0, -2.0, 1.0], (len(inner), 1)), count)
    for _ in range(2):
        feet = Polylines.of(line, closed=False).nearest(samples)
        way = unit(np.diff(line, axis=0))
        normal = np.stack([way[:, 1], -way[:, 0]], axis=1)
        off = np.einsum("nd,nd->n", samples - feet.points, normal[feet.segment])
        share = np.clip(feet.along, 0.0, 1.0)
        places = np.stack([feet.segment, feet.segment + 1], axis=1) % count
        at = _table(places, np.stack([1.0 - share, share], axis=1), count)
        every = at.T @ at + _FAIR * (bent.T @ bent) + _NOTHING * diags(np.ones(count))
        moved = spd(every.tocsc())(at.T @ off)
        before = np.concatenate([normal[-1:] if closed else normal[:1], normal])
        after = np.concatenate([normal, normal[:1] if closed else normal[-1:]])
        line = line + moved[np.arange(len(line)) % count, None] * unit(before + after)
    return line


def _table(places: Ints, values: Array, count: int) -> csr_matrix:
    """Return the matrix (k, count) with some values (k, c) in given columns (k, c) of its rows."""
    rows = np.repeat(np.arange(len(places)), places.shape[1])
    return csr_matrix((values.ravel(), (rows, places.ravel())), shape=(len(places), count))

"""Bodies of revolution: their axis and their profile, found in a mesh with any faces.

The centroid of the surface lies on the axis, and the axis is a principal axis of it. Where these
are not unique, the normals say more: the normal lines of a surface of revolution meet its axis, so
that they belong to a linear complex of lines. The profile is a section by a half-plane, moved to
the mean of several sections.

Source: Pottmann and Wallner 2001, Computational Line Geometry.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix, diags
from scipy.sparse.csgraph import depth_first_order

from gso import metrics
from gso.geometry import doubled_areas
from gso.geometry.polygon import arc_lengths, densified
from gso.geometry.vectors import cross, lengths, unit
from gso.linalg import spd
from gso.mesh import Mesh
from gso.mesh.polyline import Polylines
from gso.mesh.separation import centres
from gso.mesh.topology import edge_graph, label_components
from gso.seams.straightening import stops
from gso.typing import Array, Flags, Ints

#: Largest root mean square of the normals' components along the circles about an axis, and the
#: ratio and difference to the least one of all axes up to which an axis is tried.
_TURNED, _RATIO, _EXTRA = 0.3, 2.0, 0.02
#: Difference of the second moments of an axis from the others, over the largest one, from which on
#: it is unique; the same of the least eigenvalue of the linear complex: a ratio.
_GAP, _UNIQUE, _ROUNDING = 0.02, 4.0, 1e-9
#: Largest distance of the surface from that of its profile over the allowed one.
_SHARE = 0.5
#: Least distance from the axis of the vertex that sections begin at, over the largest one.
_FAR = 0.5
#: Angle of the first section from that vertex: sections through vertices meet edges at their ends.
_BESIDE = 0.3
#: Number of sections, and steps of the profile's line over its length.
_SECTIONS, _STEPS = 16, 100
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


@dataclass(frozen=True, eq=False)
class Revolution:
    """A surface of revolution.

    Attributes
    ----------
    origin : ndarray, (3,)
        A point of its axis.
    axis : ndarray, (3,)
        Unit direction of the axis.
    profile : ndarray, (p, 2)
        Radius and height above the origin along the profile. With the radius to the right and the
        height up, the normals of the surface are on its left. The first point is repeated at the
        end of a closed profile, which begins where its radius is least.
    apart : float
        Largest distance of the surface from that of the profile, as far as it was measured: at
        vertices, up to some thousand of them, and along sections.
    """

    origin: Array
    axis: Array
    profile: Array
    apart: float

    @classmethod
    def of(cls, mesh: Mesh, distance: float) -> Revolution | None:
        """Find the axis and the profile of a mesh; None if it is no body of revolution.

        Parameters
        ----------
        mesh : Mesh
            One component; its boundary consists of circles about the axis.
        distance : float
            Half of it is how far the mesh may be from a body of revolution, in its unit.

        Examples
        --------
        >>> turn = np.exp(2j * np.pi * np.arange(24) / 24)
        >>> ring = np.stack([turn.real, turn.imag, 0.0 * turn.real], axis=1)
        >>> low = np.arange(24)
        >>> faces = np.stack([low, np.roll(low, -1), np.roll(low, -1) + 24, low + 24], axis=1)
        >>> cone = Mesh(np.concatenate([3.0 * ring, ring + [0.0, 0.0, 4.0]]), faces)
        >>> found = Revolution.of(cone, 0.1)
        >>> abs(found.axis).round(3).tolist(), sorted(found.profile[:, 0].round(1).tolist())
        ([0.0, 0.0, 1.0], [1.0, 3.0])
        """
        triangles = Mesh(mesh.vertices, mesh.triangles)
        if not len(triangles.faces) or len(np.unique(triangles.components)) > 1:
            return None
        for origin, axis in _axes(triangles):
            found = _Sections(triangles, origin, axis).body(distance)
            if found is not None:
                return found
        return None

    @cached_property
    def is_closed(self) -> bool:
        """Whether the profile is a closed line, as that of a torus."""
        return bool(np.array_equal(self.profile[0], self.profile[-1]))

    @cached_property
    def poles(self) -> int:
        """Number of ends of the profile on the axis."""
        return int((self.profile[[0, -1], 0] == 0.0).sum())

    @cached_property
    def reach(self) -> float:
        """How far the surface moves at most where all radii grow by their own length.

        This is the radius, times the cosine of the slope; a rim moves by its whole radius.
        """
        way = np.diff(self.profile, axis=0)
        steep = np.abs(way[:, 1]) / np.linalg.norm(way, axis=1)
        radius = np.maximum(self.profile[1:, 0], self.profile[:-1, 0])
        rims = 0.0 if self.is_closed else float(self.profile[[0, -1], 0].max())
        return max(float((steep * radius).max()), rims)

    def straightness(self) -> float:
        """Return the largest distance of the profile from the line between its ends."""
        way = self.profile[-1] - self.profile[0]
        away = self.profile - self.profile[0]
        share = np.clip(away @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
        return float(np.linalg.norm(away - share[:, None] * way, axis=1).max())


def _axes(mesh: Mesh) -> list[tuple[Array, Array]]:
    """Return axes to try: points and directions, the best first."""
    corners, area = mesh.vertices[mesh.faces], doubled_areas(mesh.vertices, mesh.faces)
    weight, middle, normal = area / area.sum(), centres(mesh), metrics.face_normals(mesh)
    centroid = weight @ middle
    # Second moments of triangles: a twelfth at the corners, three quarters at the centre.
    away = corners - centroid
    moments = np.einsum("m,mkd,mke->de", weight / 12.0, away, away)
    moments += 0.75 * np.einsum("m,md,me->de", weight, middle - centroid, middle - centroid)
    lines = np.concatenate([cross(middle - centroid, normal) / mesh.diagonal, normal], axis=1)
    spread, vectors = np.linalg.eigh((weight[:, None] * lines).T @ lines)
    complexes = vectors[:, :1].T if spread[1] > _UNIQUE * spread[0] + _ROUNDING else []
    level, principal = np.linalg.eigh(moments)
    gap = np.diff(level) > _GAP * level[-1]
    single = np.array([gap[0], gap[0] and gap[1], gap[1]])
    found = [(centroid, axis) for axis in principal.T[single]]
    for a in complexes:
        size = float(np.linalg.norm(a[:3]))
        if size > _ROUNDING:
            axis, moment = a[:3] / size, mesh.diagonal * a[3:] / size
            found.append((centroid + np.cross(axis, moment), axis))
    # A ball has an axis in every direction.
    found += [(centroid, axis) for axis in (*np.eye(3)[::-1], *principal.T[~single])]
    turned = []
    for origin, axis in found:
        round_it = unit(np.cross(axis, middle - origin))
        along = np.einsum("md,md->m", round_it, normal)
        turned.append(float(np.sqrt(weight @ along**2)))
    most = min(_TURNED, max(_RATIO * min(turned), min(turned) + _EXTRA))
    return [one for one, own in zip(found, turned, strict=True) if own <= most]


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


class _Sections:
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

    def body(self, distance: float) -> Revolution | None:
        """Return the body of revolution about the axis; None if the mesh is too far from it."""
        most, near = _SHARE * distance, _FINE * distance
        line = self.section(0.0, near)
        if line is None or _away(_some(self.points, _FEW), line).max() > 2.0 * most:
            return None
        turns = 2.0 * np.pi * np.arange(1, _SECTIONS) / _SECTIONS
        others = [self.section(turn, near) for turn in turns]
        known = [other for other in others if other is not None]
        if len(known) < len(others):
            return None
        samples = np.concatenate([line, *known])
        line = self._ended(_averaged(line, samples), line[[0, -1], 0] == 0.0)
        off = _away(samples, line)
        apart = max(float(off.max()), float(_away(_some(self.points, _MANY), line).max()))
        if apart > most:
            return None
        ends = line[[0, -1]]
        if len(self.rim):
            gaps = np.linalg.norm(self.rim[:, None] - ends, axis=2)
            free = ends[:, 0] > 0.0
            # Every circle at an end is part of the boundary, which has no other parts.
            if gaps.min(axis=1).max() > most or (gaps.min(axis=0)[free] > most).any():
                return None
        simple = _SIMPLE * distance + _NOISE * float(np.sqrt((off**2).mean()))
        profile = line[stops(line, simple, len(line))]
        if not self._on_left(profile):
            profile = profile[::-1]
        return Revolution(self.origin, self.axis, profile, apart)

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

    def _ended(self, line: Array, on_axis: Flags) -> Array:
        """Move the ends of an open line onto the axis, or to where the boundary is."""
        line = line.copy()
        line[:, 0] = np.maximum(line[:, 0], 0.0)
        if np.array_equal(line[0], line[-1]):
            return line
        line[[0, -1], 0] = np.where(on_axis, 0.0, line[[0, -1], 0])
        nearest = np.linalg.norm(self.rim[:, None] - line[[0, -1]], axis=2).argmin(axis=1)
        for number, end in enumerate((0, -1)):
            own = self.rim[nearest == number]
            if len(own) and not on_axis[number]:
                # Along the line only, whose distance from the axis is known better.
                way = unit(line[end] - line[end - 1 if end else 1])
                line[end] += ((own.mean(axis=0) - line[end]) @ way) * way
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

"""The pattern of a design that is flat or developable as it is: nothing is moved."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from gso.mesh import Mesh
from gso.mesh.topology import edge_keys, label_components
from gso.pattern import Folded, Pattern
from gso.quantities import Length, Strain
from gso.recognition import BendLine, Recognised, ShapeFace, recognise
from gso.seams.slicing import subdivided
from gso.typing import Array, Ints
from gso.unfolding.dual_edges import dual_edges
from gso.unfolding.join_patches import Joined, join_patches

#: Distance, relative to the size, within which points are on a line and edges equally long.
_SAME = 1e-7
#: Angles in radians from which on an edge between two faces is a fold: between facets, and where
#: one of them is a round surface, which meets its neighbour in the tessellation's accuracy.
_FOLD, _TANGENT = np.radians(0.05), np.radians(1.0)
#: Number of triangles up to which a design may be a polyhedron, and the angle from which on its
#: edges are sharp; a quarter of their length has to be.
_FEW, _SHARP = 1_000, np.radians(20.0)
#: Space between parts, relative to the size.
_APART = 0.02


@dataclass(frozen=True, eq=False)
class FoldedPattern:
    """A design in the plane, with the lines to fold, bend and roll it along.

    Attributes
    ----------
    surface : Mesh
        The design in triangles, with more vertices where bend lines cross edges.
    pattern : Pattern
        Its pattern. On cylinders and cones lengths are those of the round surface.
    folded : Folded
        Edges of the pattern on bend lines; the radius of a fold is 0.
    recognised : Recognised
        The faces of the design.
    parts : int
        Number of parts.
    strain : float
        Largest strain of a face that has no equation.
    """

    surface: Mesh
    pattern: Pattern
    folded: Folded
    recognised: Recognised
    parts: int
    strain: float


def folded_pattern(
    mesh: Mesh,
    *,
    max_strain: Strain = 1e-3,
    max_deviation: Length | None = None,
    cut: ArrayLike = (),
    sheet: tuple[float, float] | None = None,
    bend_step: float | None = None,
    press_radius: tuple[float, float] | None = None,
) -> FoldedPattern | None:
    """Unfold a design that consists of flat, rolled and conical faces.

    Parameters
    ----------
    mesh : Mesh
    max_strain : float or str
        Largest strain of a face that has no equation.
    max_deviation : float or str, optional
        Largest distance of vertices from the cylinder or cone that they are counted to; the
        accuracy of the coordinates when not given.
    cut : array_like of int, (k, 2)
        Edges that are cut in any case.
    sheet : (float, float), optional
        Length and width that a part may have, in the mesh's unit.
    bend_step : float, optional
        Largest angle between neighbouring bend lines, in degrees.
    press_radius : (float, float), optional
        Largest radii of cylinders that are bent by a press, at one line in the middle, where the
        surface is convex and where it is concave. Cylinders that turn by more than 180 degrees
        are rolled in any case.

    Returns
    -------
    FoldedPattern or None
        None if some face is not developable, unless the design is a polyhedron of few triangles
        with sharp edges.

    Examples
    --------
    >>> box = [[x, y, z] for z in (0, 2) for x, y in ((0, 0), (4, 0), (4, 3), (0, 3))]
    >>> sides = [[k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4] for k in range(4)]
    >>> found = folded_pattern(Mesh(box, [*sides, [3, 2, 1, 0], [4, 5, 6, 7]]))
    >>> found.parts, len(found.folded.edges), float(np.degrees(found.folded.angles).round(6).max())
    (1, 5, 90.0)
    """
    shape = recognise(mesh, max_deviation=max_deviation, max_strain=max_strain, bend_step=bend_step)
    if not shape.developable.all():
        if not _is_low_poly(shape):
            return None
        shape = _facets(shape)
    pressed = set() if press_radius is None else _pressed(shape, press_radius)
    flat = shape.flat()
    joined = join_patches(
        shape.vertices,
        shape.triangles,
        shape.face,
        flat,
        cut=np.concatenate([np.reshape(cut, (-1, 2)).astype(int), _unequal(shape, flat)]),
        sheet=sheet,
    )
    sliced = _Sliced.of(shape, joined)
    found: list[tuple[Ints, float, float]] = []
    for number, face in enumerate(shape.faces):
        if number in pressed:
            face = replace(face, bend_lines=(_middle_line(face),))
        found += _bent(sliced, number, face, flat, rolled=number not in pressed)
    found += _folds(sliced, shape)
    surface = Mesh(sliced.points, sliced.vertex[sliced.faces])
    # In the order of the surface's vertices, as patterns that are not cut have it.
    order = np.argsort(sliced.vertex, kind="stable")
    rank = np.argsort(order)
    pattern = Pattern(
        sliced.flat[order], rank[sliced.faces], sliced.vertex[order], rank[sliced.seams]
    )
    edges = rank[np.array([edge for edge, _, _ in found], np.int64).reshape(-1, 2)]
    angles, radii = (np.array([row[k] for row in found], float) for k in (1, 2))
    strain = max(face.strain for face in shape.faces)
    parts = int(joined.part.max()) + 1
    return FoldedPattern(surface, pattern, Folded(edges, angles, radii), shape, parts, strain)


def _is_low_poly(shape: Recognised) -> bool:
    """Tell whether a design is meant as a polyhedron: few triangles, and many sharp edges."""
    if len(shape.triangles) > _FEW:
        return False
    edges = dual_edges(shape.triangles, shape.vertices)
    a, b = shape.vertices[edges.ends].transpose(1, 0, 2)
    angle, length = np.abs(edges.angles), np.linalg.norm(b - a, axis=1)
    folded = angle > _FOLD
    return bool(length[folded & (angle > _SHARP)].sum() >= 0.25 * length[folded].sum() > 0)


def _facets(shape: Recognised) -> Recognised:
    """Return the design with each triangle as a face of its own."""
    flat = replace(shape, faces=(ShapeFace("free", np.arange(len(shape.triangles))),)).flat()
    faces = (ShapeFace("plane", np.array([k]), flat[k, None]) for k in range(len(flat)))
    return replace(shape, faces=tuple(faces))


def _unequal(shape: Recognised, flat: Array) -> Ints:
    """Find edges that are not equally long in the flat images of both sides: they must be cut."""
    edges = dual_edges(shape.triangles, shape.vertices)
    corners = flat.reshape(-1, 2)
    one, other = (
        np.linalg.norm(corners[ends[:, 0]] - corners[ends[:, 1]], axis=1)
        for ends in edges.corners()
    )
    return edges.ends[np.abs(one - other) > _SAME * _size(shape.vertices)]


def _size(points: Array) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0)))


@dataclass(eq=False)
class _Sliced:
    """A cut pattern whose triangles are divided along bend lines.

    Attributes
    ----------
    points : ndarray, (n, 3)
        Vertices of the surface.
    flat : ndarray, (p, 2)
    vertex : ndarray of int, (p,)
        Vertex of the surface of each vertex of the pattern.
    faces : ndarray of int, (t, 3)
    label : ndarray of int, (t,)
        Number of the shape's face of each triangle.
    seams : ndarray of int, (s, 2, 2)
    source : ndarray of int, (t,)
        Triangle of the shape that each is a part of.
    """

    points: Array
    flat: Array
    vertex: Ints
    faces: Ints
    label: Ints
    seams: Ints
    source: Ints

    @classmethod
    def of(cls, shape: Recognised, joined: Joined) -> _Sliced:
        """Join the corners of triangles across edges that are not cut; parts stand in a row."""
        edges, whole = joined.edges, joined.whole
        one, other = edges.corners()
        count = 3 * len(shape.triangles)
        names = label_components(count, one[whole].ravel(), other[whole].ravel())
        _, first, label = np.unique(names, return_index=True, return_inverse=True)
        corner = label.ravel()
        often = np.bincount(corner)
        flat = np.stack(
            [np.bincount(corner, joined.flat[..., d].ravel()) / often for d in (0, 1)], axis=1
        )
        part = np.repeat(joined.part, 3)[first]
        flat[:, 0] += _row(flat, part, _APART * _size(shape.vertices))[part]
        return cls(
            shape.vertices,
            flat,
            shape.triangles.ravel()[first],
            corner.reshape(-1, 3),
            shape.face,
            np.stack([corner[one[~whole]], corner[other[~whole]]], axis=1),
            np.arange(len(shape.triangles)),
        )

    def insert(self, edges: Ints, shares: Array) -> None:
        """Insert a vertex on each of some edges of the pattern, and on their copies at seams."""
        count, n = len(self.flat), len(self.points)
        copy = self._copies(edges)
        seamed = copy[:, 0] >= 0
        both = np.concatenate([edges, copy[seamed]])
        every = np.concatenate([shares, shares[seamed]])
        number = n + np.concatenate([np.arange(len(edges)), np.flatnonzero(seamed)])
        _, once = np.unique(edge_keys(both[:, 0], both[:, 1], count), return_index=True)
        once.sort()
        both, every, number = both[once], every[once], number[once]
        a, b = self.vertex[edges].T
        new = self.points[a] + shares[:, None] * (self.points[b] - self.points[a])
        p, q = self.flat[both].transpose(1, 0, 2)
        self.faces, owner = subdivided(self.faces, count, both)
        self.seams = self._halved(both, count)
        self.points = np.concatenate([self.points, new])
        self.flat = np.concatenate([self.flat, p + every[:, None] * (q - p)])
        self.vertex = np.concatenate([self.vertex, number])
        self.label, self.source = self.label[owner], self.source[owner]

    def _copies(self, edges: Ints) -> Ints:
        """Return the other copy (k, 2) of edges at seams, in their direction; -1 for others."""
        count, out = len(self.flat), np.full((len(edges), 2), -1)
        if not len(self.seams):
            return out
        sides = self.seams.transpose(1, 0, 2).reshape(-1, 2)
        others = self.seams[:, ::-1].transpose(1, 0, 2).reshape(-1, 2)
        place = _places(edge_keys(*sides.T, count), edge_keys(*edges.T, count))
        hit = place >= 0
        same = sides[place[hit], 0] == edges[hit, 0]
        out[hit] = np.where(same[:, None], others[place[hit]], others[place[hit], ::-1])
        return out

    def _halved(self, edges: Ints, count: int) -> Ints:
        """Replace seams whose edges are divided by their halves."""
        keys = edge_keys(*edges.T, count)
        middle = [_places(keys, edge_keys(*self.seams[:, side].T, count)) for side in (0, 1)]
        hit = middle[0] >= 0
        one, other = self.seams[hit].transpose(1, 0, 2)
        m, w = (count + part[hit] for part in middle)
        first = np.stack([np.c_[one[:, 0], m], np.c_[other[:, 0], w]], axis=1)
        second = np.stack([np.c_[m, one[:, 1]], np.c_[w, other[:, 1]]], axis=1)
        return np.concatenate([self.seams[~hit], first, second])

    def edges_of(self, number: int) -> Ints:
        """Return the edges (e, 2) of the triangles of a face, each once."""
        own, count = self.faces[self.label == number], len(self.flat)
        keys = np.unique(edge_keys(own, np.roll(own, -1, axis=1), count))
        return np.stack(np.divmod(keys, count), axis=1)

    def inner(self) -> Ints:
        """Return the keys of the edges that two triangles share."""
        keys = edge_keys(self.faces, np.roll(self.faces, -1, axis=1), len(self.flat)).ravel()
        found, often = np.unique(keys, return_counts=True)
        return np.asarray(found[often == 2])


def _places(keys: Ints, wanted: Ints) -> Ints:
    """Return the place of each wanted key among keys; -1 where it is not."""
    order = np.argsort(keys, kind="stable")
    at = np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)
    return np.where(keys[order][at] == wanted, order[at], -1)


def _row(flat: Array, part: Ints, gap: float) -> Array:
    """Return shifts that put parts side by side."""
    order = np.argsort(part, kind="stable")
    starts = np.flatnonzero(np.diff(part[order], prepend=-1))
    low = np.minimum.reduceat(flat[order, 0], starts)
    wide = np.maximum.reduceat(flat[order, 0], starts) - low + gap
    return np.asarray(np.cumsum(wide) - wide - low)


def _pressed(shape: Recognised, largest: tuple[float, float]) -> set[int]:
    """Return the numbers of the cylinders that are bent at one line."""
    found = set()
    for number, face in enumerate(shape.faces):
        radius = face.radius
        if radius is None or face.flat is None or not face.bend_lines:
            continue
        turn = float(np.ptp(face.flat[..., 0])) / radius
        if radius <= largest[int(face.bend_lines[0].up)] and turn <= np.pi + _TANGENT:
            found.add(number)
    return found


def _middle_line(face: ShapeFace) -> BendLine:
    """Return the ruling in the middle of a cylinder, with the whole angle."""
    if face.flat is None or face.radius is None:
        raise AssertionError("only a cylinder has a ruling in the middle")
    across, along = face.flat[..., 0], face.flat[..., 1]
    middle, angle = 0.5 * (across.min() + across.max()), float(np.ptp(across)) / face.radius
    start, end = (np.array([middle, y]) for y in (along.min(), along.max()))
    return BendLine(start, end, face.radius, face.radius, angle, face.bend_lines[0].up)


def _bent(
    sliced: _Sliced, number: int, face: ShapeFace, flat: Array, rolled: bool = True
) -> list[tuple[Ints, float, float]]:
    """Divide a face along its bend lines; return the edges on them, with angles and radii."""
    if not face.bend_lines:
        return []
    rows = _rows(sliced, number, face, flat) if rolled else None
    if rows is not None:
        return rows
    turn, shift = _motion(sliced, face, flat)
    lines = [np.stack([line.start, line.end]) @ turn + shift for line in face.bend_lines]
    near = _SAME * _size(sliced.points)
    for line in lines:
        edges = sliced.edges_of(number)
        away = _away(line, sliced.flat[edges])
        away[np.abs(away) < near] = 0.0
        hit = away[:, 0] * away[:, 1] < 0
        share = away[hit, 0] / (away[hit, 0] - away[hit, 1])
        p, q = sliced.flat[edges[hit]].transpose(1, 0, 2)
        at = _along(line, p + share[:, None] * (q - p))
        inside = (at > -near) & (at < np.linalg.norm(line[1] - line[0]) + near)
        if inside.any():
            sliced.insert(edges[hit][inside], share[inside])
    edges, out = sliced.edges_of(number), []
    inner = np.isin(edge_keys(edges[:, 0], edges[:, 1], len(sliced.flat)), sliced.inner())
    for line, bend in zip(lines, _weighted(face.bend_lines, lines, sliced, edges, inner, near)):
        on = inner & _on(line, sliced.flat[edges], near)
        angle = -bend.angle if bend.up else bend.angle
        for edge in edges[on]:
            middle = _along(line, sliced.flat[edge].mean(axis=0)[None])[0]
            share = float(np.clip(middle / np.linalg.norm(line[1] - line[0]), 0.0, 1.0))
            radius = bend.radius_start + share * (bend.radius_end - bend.radius_start)
            out.append((edge, angle, float(radius)))
    return out


def _rows(
    sliced: _Sliced, number: int, face: ShapeFace, flat: Array
) -> list[tuple[Ints, float, float]] | None:
    """Bend a round face along rulings that are rows of edges, if there are enough of them.

    The angle of a row is that from half-way to the row before to half-way to the next.
    """
    surface = face.surface
    if surface is None:
        return None
    corners = flat[face.triangles]
    cone = surface.slope > 0
    level = np.arctan2(corners[..., 1], corners[..., 0]) if cone else corners[..., 0]
    if cone:
        # Polar angles from the middle of the face, which does not close around.
        middle = np.angle((corners @ np.array([1.0, 1j])).mean())
        level = (level - middle + np.pi) % (2 * np.pi) - np.pi
    out = np.hypot(corners[..., 0], corners[..., 1])
    if cone and out.min() < _SAME * out.max():
        return None
    near = _SAME * (1.0 if cone else float(np.ptp(level)))
    apart = np.roll(level, -1, axis=1) - level
    row, k = np.nonzero(np.abs(apart) < near)
    if not len(row):
        return None
    at = level[row, k]
    order = np.argsort(at)
    group = np.cumsum(np.diff(at[order], prepend=-np.inf) > 2 * near) - 1
    levels = np.bincount(group, at[order]) / np.bincount(group)
    low, high = level.min(axis=1), level.max(axis=1)
    crossing = np.searchsorted(np.sort(low), levels - near) - np.searchsorted(
        np.sort(high), levels + near
    )
    clean = crossing == 0
    ends = float(low.min()), float(high.max())
    wanted = np.linspace(*ends, max(3, len(np.unique(_levels(face, cone).round(9)))))
    step = float(wanted[1] - wanted[0])
    inside = clean & (levels > ends[0] + near) & (levels < ends[1] - near)
    found = levels[inside]
    if not len(found):
        return None
    nearest = np.unique(np.abs(found[:, None] - wanted[1:-1]).argmin(axis=0))
    chosen = found[nearest]
    gaps = np.diff([ends[0], *chosen, ends[1]])
    if gaps.max() > 2.0 * step + near:
        return None
    # Edges of the pattern, by the triangles that were not divided yet.
    here = np.full(len(sliced.source), -1)
    here[face.triangles] = np.arange(len(face.triangles))
    if len(sliced.faces) != len(here):
        return None
    factor = 1.0 / np.tan(surface.half_angle) if cone else 1.0 / surface.radius
    name = np.empty(len(at), np.int64)
    name[order] = group
    own = sliced.faces[face.triangles]
    edges = np.stack([own[row, k], own[row, (k + 1) % 3]], axis=1)
    far = 0.5 * (out[row, k] + out[row, (k + 1) % 3])
    keys = edge_keys(*edges.T, len(sliced.flat))
    inner = np.isin(keys, sliced.inner())
    numbers = np.flatnonzero(inside)[nearest].tolist()
    bounds = [np.flatnonzero(np.abs(levels - end) <= 2 * near) for end in ends]
    limits = [
        int(own_end[0]) if len(own_end) and inner[name == own_end[0]].any() else None
        for own_end in bounds
    ]
    places = [ends[0], *chosen, ends[1]]
    weight = np.zeros(len(places))
    weight[:-1] += 0.5 * gaps
    weight[1:] += 0.5 * gaps
    for end, to in ((0, 1), (-1, -2)):
        if limits[end] is None:
            weight[to] += weight[end]
    every = [limits[0], *numbers, limits[1]]
    sign = -1.0 if face.bend_lines[0].up else 1.0
    bent = []
    for place, turn in zip(every, weight, strict=True):
        if place is None:
            continue
        mine = np.flatnonzero((name == place) & inner)
        _, once = np.unique(keys[mine], return_index=True)
        for e in mine[once]:
            radius = float(far[e] * surface.slope) if cone else surface.radius
            bent.append((edges[e], sign * float(turn) * factor, radius))
    return bent


def _levels(face: ShapeFace, cone: bool) -> Array:
    """Return the polar angle of each bend line of a cone, or its place along a cylinder's arc."""
    starts = np.array([line.end for line in face.bend_lines])
    return np.arctan2(starts[:, 1], starts[:, 0]) if cone else starts[:, 0]


def _motion(sliced: _Sliced, face: ShapeFace, flat: Array) -> tuple[Array, Array]:
    """Return how the flat image of a face was moved: p @ turn + shift."""
    rows = np.flatnonzero(np.isin(sliced.source, face.triangles))
    k = int(face.triangles[0])
    whole = rows[sliced.source[rows] == k]
    if len(whole) == 1:
        ends = sliced.flat[sliced.faces[whole[0]]]
    else:
        raise AssertionError("a triangle was divided before its face was placed")
    here = flat[k]
    one, two = here[1:] - here[0], ends[1:] - ends[0]
    turn = np.linalg.solve(one, two)
    return turn, ends[0] - here[0] @ turn


def _away(line: Array, points: Array) -> Array:
    """Return signed distances of points (..., 2) from the line through two points."""
    way = line[1] - line[0]
    way = way / np.linalg.norm(way)
    return np.asarray((points - line[0]) @ np.array([-way[1], way[0]]))


def _along(line: Array, points: Array) -> Array:
    way = line[1] - line[0]
    return np.asarray((points - line[0]) @ (way / np.linalg.norm(way)))


def _on(line: Array, ends: Array, near: float) -> Array:
    """Tell which edges, by their ends (e, 2, 2), lie on a piece of a line."""
    long = float(np.linalg.norm(line[1] - line[0]))
    along = _along(line, ends)
    inside = (along > -near) & (along < long + near)
    return np.asarray(((np.abs(_away(line, ends)) < 2 * near) & inside).all(axis=1))


def _weighted(
    bends: tuple[BendLine, ...],
    lines: list[Array],
    sliced: _Sliced,
    edges: Ints,
    inner: Array,
    near: float,
) -> list[BendLine]:
    """Give the angle of limiting lines on the outline to their neighbours."""
    out = list(bends)
    limits = [k for k, bend in enumerate(bends) if bend.limit]
    for k in limits:
        if (inner & _on(lines[k], sliced.flat[edges], near)).any():
            continue
        rest = [j for j in range(len(bends)) if not bends[j].limit]
        if rest:
            gap = [abs(_away(lines[j], lines[k].mean(axis=0)[None])[0]) for j in rest]
            close = min(gap)
            for j, g in zip(rest, gap, strict=True):
                if g <= close + near:
                    out[j] = replace(out[j], angle=out[j].angle + bends[k].angle)
    return out


def _folds(sliced: _Sliced, shape: Recognised) -> list[tuple[Ints, float, float]]:
    """Return the edges between two faces that are folded, with their angles."""
    edges = dual_edges(sliced.faces, np.pad(sliced.flat, ((0, 0), (0, 1))))
    one, other = (sliced.label[edges.triangles[:, side]] for side in (0, 1))
    border = one != other
    ends, pair = edges.ends[border], edges.triangles[border]
    middle = sliced.points[sliced.vertex[ends]].mean(axis=1)
    normals, smooth = [], np.zeros(len(ends), bool)
    for side in (0, 1):
        own = sliced.points[sliced.vertex[sliced.faces[pair[:, side]]]]
        normal = np.cross(own[:, 1] - own[:, 0], own[:, 2] - own[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        number = sliced.label[pair[:, side]]
        for k in np.unique(number):
            surface = shape.faces[k].surface
            if surface is not None:
                which = number == k
                exact = surface.normals(middle[which])
                sign = np.sign(np.einsum("kd,kd->k", exact, normal[which]))
                normal[which] = sign[:, None] * exact
                smooth |= which
        normals.append(normal)
    way = sliced.points[sliced.vertex[ends[:, 1]]] - sliced.points[sliced.vertex[ends[:, 0]]]
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
    sine = np.einsum("kd,kd->k", np.cross(*normals), way)
    angle = np.arctan2(sine, np.einsum("kd,kd->k", *normals))
    folded = np.abs(angle) > np.where(smooth, _TANGENT, _FOLD)
    return [(edge, float(turn), 0.0) for edge, turn in zip(ends[folded], angle[folded])]

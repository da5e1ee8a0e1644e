"""Strips cut along the outline of the design.

The outline and the holes of the design are projected to the strips, and the faces are clipped
with them in the parameters of :mod:`gso.ruled.embedding`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gso.mesh.closest_point import Nearest
from gso.ruled.embedding import plane
from gso.ruled.extended import Extended
from gso.ruled.layout import Strips
from gso.ruled.polygon import enclosed_area
from gso.ruled.unroll import Unrolled
from gso.ruled.vectors import cross, lengths, unit
from gso.typing import Array, Flags, Ints

#: Barycentric coordinates below this are on the opposite edge; nodes on an edge that are closer
#: to each other than this share of its length are one.
_EDGE = 1e-5
#: Grid of the parameters, to which intersections are rounded.
_GRID = 1e-9
#: Number of times that the intersection of a normal with the strips is corrected, and the
#: cosine of the angle between the normals below which it is not.
_TURNS, _STEEP = 5, 0.2
#: Distance from a normal at which a point is not on it.
_MISSED = 1e-6
#: Distance of outline points from the simplified outline, relative to the diagonal.
_STRAIGHT = 2e-4
#: Pieces of faces below this area, relative to the squared diagonal, are left out.
_SLIVER = 1e-10
#: Area, relative to the squared diagonal, of faces whose corners are on a line.
_EMPTY = 1e-14

#: Corners of the triangles of a face; of one that is divided along its other diagonal.
_HALVES = {False: ((0, 1, 3), (0, 3, 2)), True: ((0, 1, 2), (1, 3, 2))}


@dataclass(frozen=True)
class Trimmed:
    """Strips inside the outline of the design.

    Attributes
    ----------
    vertices : ndarray, (n, 3)
    faces : ndarray of int, (m, 4)
        Quads and triangles, -1 as the fourth index of the latter.
    face : ndarray of int, (m,)
        Face of the untrimmed strips that each belongs to.
    """

    vertices: Array
    faces: Ints
    face: Ints


def trimmed(target: Extended, strips: Strips, vertices: Array, unrolled: Unrolled) -> Trimmed:
    """Cut strips along the boundary loops of a design.

    The loops are moved to the strips along the design's normals.

    Parameters
    ----------
    target : Extended
        The design; its diagonal is one.
    strips, vertices
        Strips with planar faces.
    unrolled : Unrolled
        Their unrolling.
    """
    import shapely

    triangles, _ = strips.divided(vertices)
    place = plane(strips, triangles)
    design, normals = target.domain.mesh, target.normals
    step = float(np.median(lengths(np.diff(vertices[strips.sides], axis=1)[:, 0]))) / 3.0
    rings = []
    for loop in design.boundary_loops:
        both = _dense(np.concatenate([design.vertices[loop], normals[loop]], axis=1), step)
        which, shares = _along_normals(vertices, triangles, both[:, :3], both[:, 3:])
        rings.append(_enclosed(np.einsum("kj,kjd->kd", shares, place[triangles[which]])))
    outer = int(np.argmax(shapely.area(rings)))
    holes = [ring for k, ring in enumerate(rings) if k != outer]
    region = shapely.difference(rings[outer], shapely.union_all(holes)) if holes else rings[outer]
    c = strips.corners
    cells = shapely.polygons(place[c[:, [0, 1, 3, 2]]])
    pieces, which = shapely.get_parts(
        shapely.intersection(cells, region, grid_size=_GRID), return_index=True
    )
    kept = (shapely.get_type_id(pieces) == 3) & (shapely.area(pieces) > 0)
    nodes = _Nodes(strips, vertices, place)
    polygons = [
        (int(face), [nodes.ring(int(face), np.asarray(r.coords)[:-1]) for r in _rings(piece)])
        for piece, face in zip(pieces[kept], which[kept], strict=True)
    ]
    return _meshed(polygons, nodes, unrolled)


def _along_normals(
    vertices: Array, triangles: Ints, points: Array, normals: Array
) -> tuple[Ints, Array]:
    """Find where lines through points along normals meet triangles.

    The nearest point of the triangles is found first, and then, again and again, the nearest one
    to the intersection of the line and the plane of the last triangle. Returns triangles and
    barycentric coordinates; beyond the border, of the nearest points.
    """
    near = Nearest.of(vertices, triangles)
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    plane = unit(cross(b - a, c - a))
    which, shares, foot = nearest = near.locate(points)
    for _ in range(_TURNS):
        own = plane[which]
        slope = np.einsum("kd,kd->k", normals, own)
        height = np.einsum("kd,kd->k", foot - points, own)
        steep = np.abs(slope) < _STEEP
        far = np.where(steep, 0.0, height / np.where(steep, 1.0, slope))
        target = np.where(steep[:, None], foot, points + far[:, None] * normals)
        which, shares, foot = near.locate(target)

    def off(found: Array) -> Array:
        return lengths(cross(found - points, normals))

    # Lines that miss the triangles get the nearest points.
    missed = off(foot) > off(nearest[2]) + _MISSED
    which[missed], shares[missed] = nearest[0][missed], nearest[1][missed]
    return which, shares


def _enclosed(ring: Array) -> Any:
    """Return the region around which a closed polygon (n, 2) turns, as a Shapely polygon."""
    import shapely

    simple = shapely.Polygon(ring)
    if simple.is_valid:
        return simple
    parts = shapely.get_parts(shapely.polygonize([shapely.unary_union(shapely.LinearRing(ring))]))
    z = ring @ np.array([1.0, 1j])
    inside = []
    for part in parts:
        at = part.representative_point()
        way = z - complex(at.x, at.y)
        turns = np.angle(np.roll(way, -1) * way.conj()).sum() / (2.0 * np.pi)
        inside.append(abs(turns) > 0.5)
    return shapely.union_all(parts[np.array(inside, bool)])


def _dense(loop: Array, step: float) -> Array:
    """Interpolate values (n, 3 + d) at points along a closed polygon, which come first.

    The distance of the points is at most a step.
    """
    edge = np.roll(loop, -1, axis=0) - loop
    count = np.maximum(np.ceil(lengths(edge[:, :3]) / step), 1).astype(np.int64)
    at = np.repeat(np.arange(len(loop)), count)
    share = (np.arange(len(at)) - np.repeat(np.cumsum(count) - count, count)) / count[at]
    return loop[at] + share[:, None] * edge[at]


def _rings(piece: Any) -> list[Any]:
    return [piece.exterior, *piece.interiors]


class _Nodes:
    """Vertices of clipped faces: corners of the strips, points of their edges, inner points."""

    def __init__(self, strips: Strips, vertices: Array, place: Array):
        self.strips, self.vertices, self.place = strips, vertices, place
        self.points: list[Array] = []
        self._places: list[Array] = []
        self.inner: list[bool] = []
        self._known: dict[tuple[int, int], list[tuple[float, int]]] = {}
        self._corner: dict[int, int] = {}
        self._other = strips.other_diagonal(vertices)

    def ring(self, face: int, ring: Array) -> list[int]:
        """Return the nodes of a ring (k, 2) of a piece of a face."""
        c = self.strips.corners[face]
        best = np.full(len(ring), -np.inf)
        shares = np.zeros((len(ring), 3))
        ids = np.zeros((len(ring), 3), np.int64)
        for three in _HALVES[bool(self._other[face])]:
            corner = c[list(three)]
            if len(set(corner.tolist())) < 3:
                continue
            found = _barycentric(ring, self.place[corner])
            better = found.min(axis=1) > best
            best[better] = found[better].min(axis=1)
            shares[better], ids[better] = found[better], corner
        out: list[int] = []
        for xy, share, corner in zip(ring, shares, ids, strict=True):
            node = self._node(face, share, corner)
            if node == len(self._places):
                self._places.append(xy)
            if not out or (node != out[-1] and node != out[0]):
                out.append(node)
        return out

    def _node(self, face: int, share: Array, corner: Ints) -> int:
        share = np.where(np.abs(share) < _EDGE, 0.0, share)
        held = np.flatnonzero(share)
        if held.size == 1:
            vertex = int(corner[held[0]])
            if vertex not in self._corner:
                self._corner[vertex] = self._new(self.vertices[vertex], inner=False)
            return self._corner[vertex]
        if held.size == 2 and not self._is_diagonal(face, corner[held]):
            (a, x), (b, y) = sorted(zip(corner[held].tolist(), share[held].tolist(), strict=True))
            at = y / (x + y)
            known = self._known.setdefault((a, b), [])
            for other, node in known:
                if abs(other - at) < _EDGE:
                    return node
            point = (1.0 - at) * self.vertices[a] + at * self.vertices[b]
            known.append((at, self._new(point, inner=False)))
            return known[-1][1]
        share = share / share.sum()
        return self._new(share @ self.vertices[corner], inner=True)

    def parameters(self, ring: Ints) -> Array:
        """Return the parameters (k, 2) of nodes."""
        return np.array(self._places)[ring]

    def _is_diagonal(self, face: int, pair: Ints) -> bool:
        c = self.strips.corners[face]
        quad = c[0] != c[2] and c[1] != c[3]
        ends = c[[1, 2]] if self._other[face] else c[[0, 3]]
        return bool(quad and set(pair.tolist()) == set(ends.tolist()))

    def _new(self, point: Array, *, inner: bool) -> int:
        self.points.append(point)
        self.inner.append(inner)
        return len(self.points) - 1


def _barycentric(points: Array, triangle: Array) -> Array:
    a, b, c = triangle
    u, v, w = b - a, c - a, points - a
    det = u[0] * v[1] - u[1] * v[0]
    second = (w[:, 0] * v[1] - w[:, 1] * v[0]) / det
    third = (u[0] * w[:, 1] - u[1] * w[:, 0]) / det
    return np.stack([1.0 - second - third, second, third], axis=1)


def _meshed(
    polygons: list[tuple[int, list[list[int]]]], nodes: _Nodes, unrolled: Unrolled
) -> Trimmed:
    """Divide the pieces into quads and triangles, in the plane where they are unrolled."""
    points, inner = np.array(nodes.points), np.array(nodes.inner)
    faces: list[list[int]] = []
    owner: list[int] = []
    for face, rings in polygons:
        whole = [np.array(ring) for ring in rings if len(ring) >= 3]
        if not whole or len(rings[0]) < 3:
            continue
        flat = [unrolled.flat(np.full(len(ring), face), points[ring]) for ring in whole]
        kept = [_simplified(x, inner[ring]) for x, ring in zip(flat, whole, strict=True)]
        every = [ring[at] for ring, at in zip(whole, kept, strict=True)]
        flats = [x[at] for x, at in zip(flat, kept, strict=True)]
        if len(every[0]) < 3 or abs(enclosed_area(flats[0])) < _SLIVER:
            continue
        if enclosed_area(flats[0]) < 0:
            every[0], flats[0] = every[0][::-1], flats[0][::-1]
        found = _divided(every, flats, inner)
        if not found:
            # Simplified, the piece intersects itself.
            plane = [unrolled.flat(np.full(len(ring), face), points[ring]) for ring in whole]
            found = _triangles(whole, plane)
            found = found or _triangles(whole, [nodes.parameters(ring) for ring in whole])
        faces += found
        owner += [face] * len(found)
    table = np.array(faces)
    table, face_of = _connected(table, np.array(owner))
    large = _areas(points, table) > _EMPTY
    table, face_of = table[large], face_of[large]
    used = np.unique(table[table >= 0])
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    return Trimmed(points[used], np.where(table >= 0, number[table], -1), face_of)


def _areas(points: Array, table: Ints) -> Array:
    """Return the areas (m,) of planar faces."""
    a, b, c = points[table[:, :3].T]
    d = np.where((table[:, 3] >= 0)[:, None], points[table[:, 3]], a)
    return 0.5 * lengths(cross(c - a, d - b))


def _divided(rings: list[Ints], flats: list[Array], inner: Flags) -> list[list[int]]:
    """Divide a polygon with holes: a quad between its rulings if possible, and triangles."""
    if len(rings) > 1:
        whole = [k for k, ring in enumerate(rings) if k == 0 or len(ring) >= 3]
        return _triangles([rings[k] for k in whole], [flats[k] for k in whole])
    ring, flat = rings[0], flats[0]
    if len(ring) == 3:
        return [[*ring.tolist(), -1]]
    ends = np.flatnonzero(~inner[ring])
    if ends.size != 4 or not _convex(flat[ends]):
        return _triangles(rings, flats)
    out = [ring[ends].tolist()]
    for a, b in zip(ends, np.roll(ends, -1), strict=True):
        side = np.arange(a, (b if b > a else b + len(ring)) + 1) % len(ring)
        if side.size == 2:
            continue
        if enclosed_area(flat[side]) < _SLIVER or not _outside(flat, side):
            return _triangles(rings, flats)
        more = _triangles([ring[side]], [flat[side]])
        if not more:
            return _triangles(rings, flats)
        out += more
    return out


def _outside(flat: Array, side: Ints) -> bool:
    """Return whether a chain of nodes stays to the right of the line between its ends."""
    way, off = flat[side[-1]] - flat[side[0]], flat[side[1:-1]] - flat[side[0]]
    return bool((way[0] * off[:, 1] - way[1] * off[:, 0] < 0).all())


def _triangles(rings: list[Ints], flats: list[Array]) -> list[list[int]]:
    """Triangulate a polygon with holes; nothing if it intersects itself."""
    import shapely

    piece = shapely.Polygon(flats[0], flats[1:])
    if not piece.is_valid:
        return []
    places = np.concatenate(flats).tolist()
    node = {tuple(xy): k for xy, k in zip(places, np.concatenate(rings).tolist(), strict=True)}
    out = []
    for triangle in shapely.get_parts(shapely.constrained_delaunay_triangles(piece)):
        xy = np.asarray(triangle.exterior.coords)[:3]
        three = [node[tuple(p)] for p in xy.tolist()]
        if abs(enclosed_area(xy)) > 1e-4 * _SLIVER:
            out.append([*(three if enclosed_area(xy) > 0 else three[::-1]), -1])
    return out


def _connected(table: Ints, owner: Ints) -> tuple[Ints, Ints]:
    """Keep the largest set of faces that are joined by edges."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    four = np.where(table >= 0, table, table[:, :1])
    sides = np.stack([four, np.roll(four, -1, axis=1)], axis=2).reshape(-1, 2)
    face = np.repeat(np.arange(len(table)), 4)
    kept = sides[:, 0] != sides[:, 1]
    low, high = sides[kept].min(axis=1), sides[kept].max(axis=1)
    _, edge = np.unique(low * (table.max() + 1) + high, return_inverse=True)
    shape = (len(table), int(edge.max()) + 1)
    meets = coo_matrix((np.ones(len(edge)), (face[kept], edge)), shape=shape).tocsr()
    _, label = connected_components(meets @ meets.T, directed=False)
    most = label == np.bincount(label).argmax()
    return table[most], owner[most]


def _simplified(flat: Array, inner: Flags) -> Ints:
    """Leave out inner nodes of a ring that are on a straight line (Douglas and Peucker 1973)."""
    n = len(flat)
    fixed = np.flatnonzero(~inner)
    if fixed.size == n:
        return np.arange(n)
    if fixed.size < 2:
        far = int(np.abs((flat - flat[0]) @ np.array([1.0, 1j])).argmax())
        fixed = np.unique(np.r_[fixed, 0, far])
    kept = set(fixed.tolist())
    todo = [(int(a), int(b)) for a, b in zip(fixed, np.roll(fixed, -1), strict=True)]
    while todo:
        a, b = todo.pop()
        between = np.arange(a + 1, b if b > a else b + n)
        if between.size == 0:
            continue
        way = flat[b] - flat[a]
        off = flat[between % n] - flat[a]
        size = float(np.hypot(*way))
        if size > 0:
            along = np.clip(off @ way / size**2, 0.0, 1.0)
            off = off - along[:, None] * way
        gap = np.hypot(off[:, 0], off[:, 1])
        worst = int(gap.argmax())
        if gap[worst] > _STRAIGHT:
            at = int(between[worst] % n)
            kept.add(at)
            todo += [(a, at), (at, b)]
    return np.array(sorted(kept))


def _convex(flat: Array) -> bool:
    edge = np.roll(flat, -1, axis=0) - flat
    after = np.roll(edge, -1, axis=0)
    return bool((edge[:, 0] * after[:, 1] - edge[:, 1] * after[:, 0] > 0).all())

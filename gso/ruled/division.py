"""Division of clipped faces into quads between rulings, and triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso import geometry
from gso.errors import MeshError
from gso.geometry.polygon import signed_area
from gso.geometry.vectors import lengths
from gso.mesh import topology
from gso.ruled.copies import with_copies
from gso.ruled.nodes import Nodes
from gso.ruled.unroll import Unrolled
from gso.typing import Array, Flags, Ints

#: Distance of outline points from the simplified outline, relative to the diagonal.
_STRAIGHT = 1e-4
#: Pieces of faces below this area, relative to the squared diagonal, are left out.
_SLIVER = 1e-10
#: Area, relative to the squared diagonal, of faces whose corners are on a line. It is larger than
#: what meshes refuse, as the parts of a pattern are larger together than the design.
_EMPTY = 1e-11


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


def meshed(
    polygons: list[tuple[int, list[list[int]]]], nodes: Nodes, unrolled: Unrolled
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
        if len(every[0]) < 3 or abs(signed_area(flats[0])) < _SLIVER:
            continue
        if signed_area(flats[0]) < 0:
            every[0], flats[0] = every[0][::-1], flats[0][::-1]
        found = _divided(every, flats, inner)
        if not found:
            # Simplified, the piece intersects itself.
            found = _triangles(whole, flat)
            found = found or _triangles(whole, [nodes.parameters(ring) for ring in whole])
        faces += found
        owner += [face] * len(found)
    if not faces:
        raise MeshError(
            "the strips and the surface have no part in common; it may be folded or too irregular "
            "for the formulation 'ruled': take 'curvature'"
        )
    table = np.array(faces)
    table, face_of = _connected(table, np.array(owner))
    vectors = geometry.quad_area_vectors(points, topology.four_corners(table))
    large = 0.5 * lengths(vectors) > _EMPTY
    table, face_of = table[large], face_of[large]
    vertices, table = with_copies(points, table)
    return Trimmed(vertices, table, face_of)


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
        if signed_area(flat[side]) < _SLIVER or not _outside(flat, side):
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
    """Triangulate a polygon with holes; nothing if it intersects itself, or nearly."""
    import shapely

    piece = shapely.Polygon(flats[0], flats[1:])
    if not piece.is_valid:
        return []
    places = np.concatenate(flats).tolist()
    node = {tuple(xy): k for xy, k in zip(places, np.concatenate(rings).tolist(), strict=True)}
    out = []
    try:
        found = shapely.constrained_delaunay_triangles(piece)
    except shapely.GEOSException:
        return []
    for triangle in shapely.get_parts(found):
        xy = np.asarray(triangle.exterior.coords)[:3]
        three = [node[tuple(p)] for p in xy.tolist()]
        if abs(signed_area(xy)) > 1e-4 * _SLIVER:
            out.append([*(three if signed_area(xy) > 0 else three[::-1]), -1])
    return out


def _connected(table: Ints, owner: Ints) -> tuple[Ints, Ints]:
    """Keep the largest set of faces that are joined by edges."""
    four = topology.four_corners(table)
    sides = np.stack([four, np.roll(four, -1, axis=1)], axis=2).reshape(-1, 2)
    face = np.repeat(np.arange(len(table)), 4)
    kept = sides[:, 0] != sides[:, 1]
    low, high = sides[kept].min(axis=1), sides[kept].max(axis=1)
    _, edge = np.unique(low * (table.max() + 1) + high, return_inverse=True)
    # Faces and their edges are the nodes of one graph.
    count = len(table)
    label = topology.label_components(count + int(edge.max()) + 1, face[kept], count + edge)[:count]
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

"""Division of triangles into parts that are manifold, and faces inside bodies."""

from __future__ import annotations

import numpy as np

from gso.errors import MeshError
from gso.geometry.vectors import unit
from gso.mesh.topology import edge_keys, label_components, tree_parity
from gso.typing import Array, Flags, Ints

#: Volume, relative to the cube of the size, from which on a region of space is closed.
_CLOSED = 1e-9
#: Cosine of the angle at an edge between two triangles that go on nearly straight: the surface
#: bends by less than 60 degrees.
_STRAIGHT = -0.5


def divided(
    points: Array, triangles: Ints, names: Ints, sheets: bool = False
) -> tuple[Ints, Ints, str] | None:
    """Divide triangles (t, 3) where they are not manifold.

    Around an edge of more than two, those that bound the same body stay joined.

    Parameters
    ----------
    points : ndarray, (n, 3)
    triangles : ndarray of int, (t, 3)
    names : ndarray of int, (t,)
        The given face of each triangle.
    sheets : bool
        As for :func:`manifold_mesh`.

    Returns
    -------
    (ndarray of int (t, 3), ndarray of int (m,), str) or None
        The triangles, the given vertex of each vertex, and a note; None if they are manifold.

    Raises
    ------
    MeshError
        A body has faces inside, and `sheets` is not set.
    """
    origin, dest = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    key = edge_keys(origin, dest, len(points))
    order = np.argsort(key, kind="stable")
    _, start, often = np.unique(key[order], return_index=True, return_counts=True)
    pair = start[often == 2]
    pairs = np.stack([order[pair], order[pair + 1]])
    crowded = often > 2
    cuts = np.empty(0, np.int64)
    if crowded.any():
        halves = order[np.repeat(crowded, often)]
        more = _around(points, triangles, halves, None if sheets else names)
        pairs = np.concatenate([pairs, more], axis=1)
        if sheets:
            more = _straight_on(points, triangles, np.setdiff1d(halves, more))
            pairs = np.concatenate([pairs, more], axis=1)
    if sheets:
        whole = _two_sided(origin, names, pairs)
        cuts = pairs[0, ~whole]
        pairs = pairs[:, whole]
    fan = _fans(origin, pairs)
    if sheets:
        fan = _apart(origin, names, pairs, fan)
    owner = origin[np.unique(fan, return_index=True)[1]]
    if len(owner) == len(np.unique(origin)):
        return None
    rank = np.argsort(owner, kind="stable")
    copies = rank[np.flatnonzero(np.diff(owner[rank], prepend=-1) == 0)]
    # The first fan of a vertex keeps its number.
    number = owner.copy()
    number[copies] = len(points) + np.arange(len(copies))
    vertex = np.r_[np.arange(len(points)), owner[copies]]
    note = (
        f"the surface was divided at {len(np.unique(owner[copies]))} vertices where its "
        f"parts share no edge with two faces (the first is vertex {owner[copies[0]]})"
    )
    if crowded.any():
        edge = int(order[start[crowded][0]])
        note += (
            f"; {int(crowded.sum())} edges have more than two faces (the first is "
            f"{origin[edge]}-{dest[edge]})"
        )
    if len(cuts):
        note += (
            f"; it is one-sided and was cut along {len(cuts)} edges (the first is "
            f"{origin[cuts[0]]}-{dest[cuts[0]]})"
        )
    return number[fan].reshape(triangles.shape), vertex, note


def _next_corner(count: int) -> Ints:
    """Return the next corner (c,) of each corner in its triangle, which is the end of its edge."""
    corner = np.arange(count)
    return np.asarray(corner // 3 * 3 + (corner + 1) % 3)


def _fans(origin: Ints, pairs: Ints) -> Ints:
    """Number the fans of triangles around vertices: the fan of each corner (c,).

    The corners at both ends of an edge with a pair of half-edges (2, p) are joined.
    """
    ahead = _next_corner(len(origin))
    one, other = pairs
    same = origin[one] == origin[other]
    a = np.r_[one, ahead[one]]
    b = np.r_[np.where(same, other, ahead[other]), np.where(same, ahead[other], other)]
    return label_components(len(origin), a, b)


def _apart(origin: Ints, names: Ints, pairs: Ints, fan: Ints) -> Ints:
    """Divide the fans that still meet at an edge of more than two triangles, face by face."""
    ahead = _next_corner(len(origin))
    while True:
        low, high = np.minimum(fan, fan[ahead]), np.maximum(fan, fan[ahead])
        key = low * len(origin) + high
        edges, often = np.unique(key, return_counts=True)
        bad = np.unique(edges[often > 2] // len(origin))
        if not len(bad):
            return fan
        one, other = pairs
        met = np.isin(fan[one], bad) | np.isin(fan[ahead[one]], bad)
        pairs = pairs[:, ~met | (names[one // 3] == names[other // 3])]
        fan = _fans(origin, pairs)


def _two_sided(origin: Ints, names: Ints, pairs: Ints) -> Flags:
    """Mark the pairs of half-edges (2, p) at which an orientation of all faces fits.

    The triangles of a face are oriented alike.
    """
    face = np.unique(names, return_inverse=True)[1].reshape(-1)
    one, other = pairs
    a, b = face[one // 3], face[other // 3]
    odd = origin[one] == origin[other]
    between = a != b
    flip, _ = tree_parity(int(face.max()) + 1, a[between], b[between], odd[between])
    return np.asarray(~between | ((flip[a] ^ flip[b]) == odd))


def _straight_on(points: Array, triangles: Ints, halves: Ints) -> Ints:
    """Pair the half-edges of each edge whose triangles are nearest to one plane, those first."""
    origin, dest = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    way = unit(points[dest[halves]] - points[origin[halves]])
    inward = points[np.roll(triangles, 1, axis=1).ravel()[halves]] - points[origin[halves]]
    inward = unit(inward - (inward * way).sum(axis=1, keepdims=True) * way)
    key = edge_keys(origin[halves], dest[halves], len(points))
    order = np.argsort(key, kind="stable")
    pairs: list[tuple[int, int]] = []
    for group in np.split(order, np.flatnonzero(np.diff(key[order])) + 1):
        cosine = inward[group] @ inward[group].T
        for flat in np.argsort(cosine, axis=None, kind="stable").tolist():
            a, b = divmod(flat, len(group))
            if cosine[a, b] >= _STRAIGHT:
                break
            if group[a] >= 0 and group[b] >= 0:
                pairs.append((int(halves[group[a]]), int(halves[group[b]])))
                group[[a, b]] = -1
    found: Ints = np.array(pairs, np.int64).reshape(-1, 2).T
    return found


def _around(points: Array, triangles: Ints, halves: Ints, names: Ints | None) -> Ints:
    """Pair the half-edges at edges of more than two triangles that bound the same body.

    Both sides of each triangle belong to regions of space: around an edge, the sides that face
    each other belong to one. Closed regions have a volume above zero, and the space outside of
    them one below zero.

    Edges of triangles with different closed regions on both sides have no pairs.

    Raises
    ------
    MeshError
        There are such triangles, and `names` are given: the given face of each one.
    """
    count, t = len(points), len(triangles)
    p = points[triangles]
    origin, dest = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    key = edge_keys(origin, dest, count)
    forward = origin < dest
    way = unit(np.where(forward, 1.0, -1.0)[:, None] * (points[dest] - points[origin]))
    inward = p[:, [2, 0, 1]].reshape(-1, 3) - points[origin]
    least = np.eye(3)[np.abs(way).argmin(axis=1)]
    x = unit(np.cross(least, way))
    angle = np.arctan2((np.cross(way, x) * inward).sum(axis=1), (x * inward).sum(axis=1))
    order = np.lexsort((angle, key))
    last = np.flatnonzero(np.diff(key[order], append=-1) != 0)
    first = np.r_[0, last[:-1] + 1]
    after = np.r_[order[1:], order[:1]]
    after[last] = order[first]
    # Anticlockwise about the edge is the front of a triangle that runs along it.
    triangle = order // 3
    left = triangle + t * ~forward[order]
    right = after // 3 + t * forward[after]
    region = label_components(2 * t, left, right)
    middle = points - points[np.unique(triangles)].mean(axis=0)
    q = middle[triangles]
    volume = np.einsum("td,td->t", q[:, 0], np.cross(q[:, 1], q[:, 2])) / 6.0
    size = np.bincount(region, np.r_[-volume, volume])
    closed: Flags = size > _CLOSED * float(np.ptp(points[origin], axis=0).max()) ** 3
    front, back = region[:t], region[t:]
    walls = closed[front] & closed[back]
    inner = np.flatnonzero(walls & (front != back))
    if len(inner) and names is not None:
        some = np.unique(names[inner])
        place = ", ".join(f"{x:.6g}" for x in p[inner[0]].mean(axis=0))
        raise MeshError(
            f"face {some[0]} at ({place}) is inside a body, with parts of it on both sides "
            f"({len(some)} such faces); delete them, or separate the bodies"
        )
    solid = closed[region[left]] & np.isin(order, halves)
    if names is None:
        solid &= ~np.isin(key[order], key[np.repeat(walls, 3)])
    return np.stack([order[solid], after[solid]])

"""Triangle meshes on a subset of the vertices of another mesh.

Vertices are removed in rounds. In each round an independent set of vertices is collapsed, each
into a neighbour, so that the whole round is a few operations on arrays. A vertex goes where the
new triangles have the best shapes, and stays where one of them would fold or where the surface
would change its topology. Density thus falls evenly, and all vertices that remain are vertices of
the design. This is the hierarchy of Dobkin and Kirkpatrick 1985 (Algorithms 6:381), with half-edge
collapses in place of retriangulations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gso import geometry
from gso.mesh.topology import edge_keys
from gso.typing import Array, Flags, Ints

#: Largest number of rounds. Shapes may become worse after a round that removes less than this
#: share of the vertices.
_ROUNDS, _FEW = 60, 0.05
#: Sweeps of the search for an independent set in a round.
_SWEEPS = 3
#: Smallest cosine of the angle by which a triangle's normal may turn in a collapse, and by which
#: those of two triangles may differ from their mean where the edge between them is flipped.
_TURN, _FLIP_TURN = 0.5, 0.8
#: Smallest shape of a new triangle, 1 if equilateral and 0 if without area, in the first rounds
#: and at last.
_SHAPE, _LEAST = 0.25, 0.05
#: Smallest cosine of the angle by which the boundary may turn at a vertex that is removed.
_STRAIGHT = 0.7


class Thinned(NamedTuple):
    """A coarser triangle mesh of some vertices of a finer one.

    Attributes
    ----------
    ids : ndarray of int, (m,)
        Its vertices among those of the finer mesh, in increasing order.
    faces : ndarray of int, (t, 3)
        Its triangles, in its own numbering.
    lines : ndarray of int, (k, 2)
        What is left of the given lines, in its own numbering.
    """

    ids: Ints
    faces: Ints
    lines: Ints


def thinned(
    points: Array,
    triangles: Ints,
    count: int,
    keep: Ints | None = None,
    lines: Ints | None = None,
) -> Thinned:
    """Remove vertices of a triangle mesh until about `count` remain.

    Boundary vertices are removed along the boundary only; its corners stay. So it is with lines.
    More than `count` vertices remain where no other one can be removed without folding a triangle.

    Parameters
    ----------
    points : ndarray, (n, 3)
        Vertices.
    triangles : ndarray of int, (t, 3)
        Consistently oriented.
    count : int
        Number of vertices to reach.
    keep : ndarray of int, optional
        Vertices that are not removed.
    lines : ndarray of int, (k, 2), optional
        Edges of triangles that form lines, such as creases. Their ends and junctions stay.

    Examples
    --------
    >>> from gso.mesh import Mesh
    >>> x, y = np.meshgrid(np.linspace(0, 1, 33), np.linspace(0, 1, 33), indexing="ij")
    >>> mesh = Mesh.from_grid(np.dstack([x, y, x * y]))
    >>> light = thinned(mesh.vertices, mesh.triangles, 200)
    >>> len(light.ids), bool(np.isin([0, 32, 32 * 33, 33 * 33 - 1], light.ids).all())
    (200, True)
    """
    ids, faces = np.unique(triangles, return_inverse=True)
    faces = faces.reshape(-1, 3).astype(np.int64)
    held = np.zeros(len(points), bool)
    held[[] if keep is None else keep] = True
    left_lines = np.empty((0, 2), np.int64)
    if lines is not None and len(lines):
        left_lines = np.searchsorted(ids, np.asarray(lines, np.int64))
    # A fixed seed: the same mesh has the same coarser meshes.
    order = np.random.default_rng(0).permutation(len(points))
    least = _SHAPE
    for _ in range(_ROUNDS):
        surplus = len(ids) - count
        if surplus <= 0:
            break
        guides = _guides(left_lines, len(ids))
        stay = held[ids] | guides.fixed
        into = _collapsed(points[ids], faces, order[ids], stay, surplus, least, guides)
        left = into == np.arange(len(ids))
        removed = len(ids) - int(left.sum())
        if removed < _FEW * min(surplus, len(ids)):
            if least <= _LEAST:
                break
            least = max(0.5 * least, _LEAST)
        faces = into[faces]
        whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
        number = np.cumsum(left) - 1
        faces, ids = number[faces[whole]], ids[left]
        if len(left_lines):
            left_lines = number[into[left_lines]]
            left_lines = np.unique(np.sort(left_lines, axis=1), axis=0)
            left_lines = left_lines[left_lines[:, 0] != left_lines[:, 1]]
        faces = flipped(points[ids], faces, left_lines)
    return Thinned(ids, faces, left_lines)


def flipped(points: Array, faces: Ints, keep: Ints | None = None) -> Ints:
    """Flip edges of a triangle mesh towards a Delaunay triangulation, in one pass.

    An edge is flipped where its opposite angles sum to more than 180 degrees, unless the new
    triangles would turn away from the old ones, or it is to be kept (k, 2). No triangle takes part
    in two flips.
    """
    n, count = len(points), len(faces)
    origin, dest, apex = (np.roll(faces, -k, axis=1).ravel() for k in range(3))
    low, high = np.minimum(origin, dest), np.maximum(origin, dest)
    key = low * n + high
    order = np.argsort(key)
    ranked = key[order]
    (at,) = np.nonzero(ranked[1:] == ranked[:-1])
    one, two = order[at], order[at + 1]
    a, b, c, d = origin[one], dest[one], apex[one], apex[two]
    p, q, r, s = (points[x] for x in (a, b, c, d))
    first, second = (_dot(p - x, q - x) for x in (r, s))
    left, right = _cross(q - p, r - p), _cross(p - q, s - q)
    size = [np.sqrt(_dot(x, x)) for x in (left, right)]
    # The sine of the sum of both angles is negative.
    excess = -(first * size[1] + second * size[0])
    lengths = _dot(q - p, q - p)
    (wanted,) = np.nonzero(excess > 1e-6 * lengths**2)
    wanted = wanted[(c != d)[wanted]]
    if keep is not None and len(keep):
        wanted = wanted[~np.isin(key[one[wanted]], edge_keys(keep[:, 0], keep[:, 1], n))]
    p, q, r, s = (x[wanted] for x in (p, q, r, s))
    normal = left[wanted] + right[wanted]
    turned = [_cross(p - r, s - r), _cross(q - s, r - s)]
    whole = np.sqrt(_dot(normal, normal))
    fine = np.ones(len(wanted), bool)
    for new in turned:
        fine &= _dot(new, normal) > _FLIP_TURN * np.sqrt(_dot(new, new)) * whole
    for old in (left[wanted], right[wanted]):
        fine &= _dot(old, normal) > _FLIP_TURN * np.sqrt(_dot(old, old)) * whole
    made = edge_keys(c[wanted], d[wanted], n)
    fine &= ~_among(ranked, made)
    wanted, made = wanted[fine], made[fine]
    # Each triangle, and each new edge, goes to the flip that gains most.
    rank = np.argsort(np.argsort(-excess[wanted], kind="stable"))
    t, u = one[wanted] // 3, two[wanted] // 3
    best = np.full(count, len(wanted))
    np.minimum.at(best, t, rank)
    np.minimum.at(best, u, rank)
    chosen = (best[t] == rank) & (best[u] == rank)
    _, once = np.unique(made[chosen], return_index=True)
    wanted = wanted[np.flatnonzero(chosen)[once]]
    out: Ints = faces.copy()
    a, b, c, d = a[wanted], b[wanted], c[wanted], d[wanted]
    out[one[wanted] // 3] = np.stack([c, a, d], axis=1)
    out[two[wanted] // 3] = np.stack([d, b, c], axis=1)
    return out


class _Guides(NamedTuple):
    """The lines along which vertices may be removed.

    Attributes
    ----------
    before, after : ndarray of int, (n,)
        Neighbours on a line, -1 for vertices on none.
    fixed : ndarray of bool, (n,)
        Ends and junctions of lines.
    """

    before: Ints
    after: Ints
    fixed: Flags


def _guides(lines: Ints, n: int) -> _Guides:
    number = np.bincount(lines.ravel(), minlength=n)
    before, after = np.full(n, -1), np.full(n, -1)
    ends = np.concatenate([lines, lines[:, ::-1]])
    ends = ends[np.argsort(ends[:, 0], kind="stable")]
    inner = ends[number[ends[:, 0]] == 2]
    before[inner[::2, 0]] = inner[::2, 1]
    after[inner[1::2, 0]] = inner[1::2, 1]
    return _Guides(before, after, (number > 0) & (number != 2))


class _Links(NamedTuple):
    """The half-edges of triangles, sorted by their origins, then by their ends.

    Attributes
    ----------
    start : ndarray of int, (n + 1,)
        First half-edge of each vertex.
    origin, dest, apex : ndarray of int, (3 t,)
        Both ends, and the third vertex of the triangle.
    key : ndarray of int, (3 t,)
        ``origin * n + dest``.
    open_out, open_in : ndarray of int, (n,)
        The boundary's next and previous vertex, -1 inside.
    """

    start: Ints
    origin: Ints
    dest: Ints
    apex: Ints
    key: Ints
    open_out: Ints
    open_in: Ints


def _links(faces: Ints, n: int) -> _Links:
    origin, dest, apex = (np.roll(faces, -k, axis=1).ravel() for k in range(3))
    key = origin * n + dest
    order = np.argsort(key)
    origin, dest, apex, key = origin[order], dest[order], apex[order], key[order]
    start = np.searchsorted(origin, np.arange(n + 1))
    border = ~_among(key, dest * n + origin)
    open_out, open_in = np.full(n, -1), np.full(n, -1)
    open_out[origin[border]] = dest[border]
    open_in[dest[border]] = origin[border]
    return _Links(start, origin, dest, apex, key, open_out, open_in)


def _among(sorted_keys: Ints, keys: Ints) -> Flags:
    """Return which keys are among sorted ones."""
    at = np.minimum(np.searchsorted(sorted_keys, keys), len(sorted_keys) - 1)
    return np.asarray(sorted_keys[at] == keys)


def _collapsed(
    points: Array,
    faces: Ints,
    order: Ints,
    held: Flags,
    most: int,
    least: float,
    guides: _Guides,
) -> Ints:
    """Return the vertex (n,) that each one is collapsed into; itself where it stays."""
    n = len(points)
    links = _links(faces, n)
    into = np.arange(n)
    border = links.open_out >= 0
    may = ~held & (np.diff(links.start) > 1)
    may &= ~border | _straight(points, links.open_in, links.open_out, border)
    guided = guides.before >= 0
    may &= ~guided | (_straight(points, guides.before, guides.after, guided) & ~border)
    centre = np.flatnonzero(_independent(links, order, may, n))
    if not len(centre):
        return into
    centre, target, shape = _best_targets(points, links, centre, border, least, guides)
    centre, target, shape = _safe(links, centre, target, shape, border, n)
    if len(centre) > most:
        first = np.argsort(-shape, kind="stable")[:most]
        centre, target = centre[first], target[first]
    into[centre] = target
    return into


def _straight(points: Array, previous: Ints, following: Ints, on: Flags) -> Flags:
    """Return at which vertices a line through them does not turn."""
    before = points - points[previous]
    after = points[following] - points
    along = np.einsum("nd,nd->n", before, after)
    sizes = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    return np.asarray(on & (along > _STRAIGHT * sizes))


def _independent(links: _Links, order: Ints, may: Flags, n: int) -> Flags:
    """Return a set of vertices that are not neighbours, nearly as large as possible."""
    chosen = np.zeros(n, bool)
    open_to = may.copy()
    border = links.open_out >= 0
    for _ in range(_SWEEPS):
        rank = np.where(open_to, order, order.max() + 1 + np.arange(n))
        lowest = np.minimum.reduceat(rank[links.dest], links.start[:-1])
        # A boundary vertex has a neighbour to which no half-edge leads from it.
        lowest[border] = np.minimum(lowest[border], rank[links.open_in[border]])
        new = open_to & (rank < lowest)
        chosen |= new
        near = np.zeros(n, bool)
        near[links.origin[new[links.dest]]] = True
        near[links.dest[new[links.origin]]] = True
        open_to &= ~(new | near)
    return chosen


def _best_targets(
    points: Array, links: _Links, centre: Ints, border: Flags, least: float, guides: _Guides
) -> tuple[Ints, Ints, Array]:
    """Return vertices that can be removed, their best target, and the worst new shape there."""
    degree = np.diff(links.start)[centre]
    first = links.start[centre]
    # One row for each target and each triangle of the star: degree^2 rows a vertex.
    targets = degree + border[centre]
    which = np.repeat(np.arange(len(centre)), targets)
    place = np.arange(len(which)) - np.repeat(np.cumsum(targets) - targets, targets)
    inner = place < degree[which]
    target = links.dest[first[which] + np.minimum(place, degree[which] - 1)]
    target = np.where(inner, target, links.open_in[centre[which]])
    if border[centre].any():
        # Along the boundary only.
        v = centre[which]
        allowed = ~border[v] | (target == links.open_out[v]) | (target == links.open_in[v])
        which, target = which[allowed], target[allowed]
    if (guides.before[centre] >= 0).any():
        v = centre[which]
        allowed = (target == guides.before[v]) | (target == guides.after[v])
        allowed |= guides.before[v] < 0
        which, target = which[allowed], target[allowed]
    count = degree[which]
    pair = np.repeat(np.arange(len(which)), count)
    step = np.arange(len(pair)) - np.repeat(np.cumsum(count) - count, count)
    edge = first[which[pair]] + step
    p, q, j = links.dest[edge], links.apex[edge], target[pair]
    v = centre[which[pair]]
    gone = (j == p) | (j == q)
    a, b = points[p], points[q]
    side = b - a
    old, new = _cross(side, points[v] - a), _cross(side, points[j] - a)
    area = np.sqrt(np.einsum("kd,kd->k", new, new))
    turn = np.einsum("kd,kd->k", old, new)
    bent = turn < _TURN * area * np.sqrt(np.einsum("kd,kd->k", old, old))
    shape = _shape(area, side, points[j] - a, points[j] - b)
    shape[bent] = 0.0
    shape[gone] = 2.0
    at = np.cumsum(count) - count
    worst = np.minimum.reduceat(shape, at)
    # The best target of each vertex: the last one in increasing order of shape.
    ranked = np.lexsort([worst, which])
    last = ranked[np.r_[which[ranked][1:] != which[ranked][:-1], True]]
    good = (worst[last] > least) & (worst[last] <= 1.0)
    last = last[good]
    return centre[which[last]], target[last], worst[last]


def _shape(area: Array, *sides: Array) -> Array:
    """Return the shapes of triangles from their doubled areas and their sides (k, 3)."""
    squares = sum(np.einsum("kd,kd->k", x, x) for x in sides)
    return np.asarray(2.0 * np.sqrt(3.0) * area / np.maximum(squares, 1e-300))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("kd,kd->k", a, b))


def _cross(a: Array, b: Array) -> Array:
    return np.stack(geometry.cross(tuple(a.T), tuple(b.T)), axis=1)


def _safe(
    links: _Links, centre: Ints, target: Ints, shape: Array, border: Flags, n: int
) -> tuple[Ints, Ints, Array]:
    """Keep the collapses that make no edge twice, and none across the surface."""
    degree = np.diff(links.start)[centre]
    ends = degree + border[centre]
    which = np.repeat(np.arange(len(centre)), ends)
    place = np.arange(len(which)) - np.repeat(np.cumsum(ends) - ends, ends)
    inner = place < degree[which]
    edge = links.start[centre[which]] + np.minimum(place, degree[which] - 1)
    ring = np.where(inner, links.dest[edge], links.open_in[centre[which]])
    j = target[which]
    # Both neighbours of the target in the ring are joined to it already.
    beside = (links.apex[edge] == j) & inner | (ring == j)
    here = np.searchsorted(links.key, centre[which] * n + j)
    here = np.minimum(here, len(links.key) - 1)
    after = links.apex[here]
    beside |= (ring == after) & (links.key[here] == centre[which] * n + j)
    new = ~beside
    low, high = np.minimum(j, ring), np.maximum(j, ring)
    key = low * n + high
    bad = new & (_among(links.key, key) | _among(links.key, high * n + low))
    # Of collapses that make the same edge the first one stays.
    fresh = np.flatnonzero(new)
    _, once = np.unique(key[fresh], return_index=True)
    again = np.ones(len(fresh), bool)
    again[once] = False
    bad[fresh[again]] = True
    safe = np.ones(len(centre), bool)
    safe[which[bad]] = False
    return centre[safe], target[safe], shape[safe]

"""Rulings of each strip on its own, conjugate to its creases.

The rulings of a mesh run on across creases, which is right only where its lines are conjugate.
Here a dynamic program chooses those of each strip among all pairs of vertices on its two sides, so
that the planes of successive rulings have the design's normals. Between them are planar quads, and
triangles where several rulings meet in one vertex.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gso.geometry.vectors import cross, lengths, unit
from gso.ruled.lines.polygons import Polygons
from gso.ruled.lines.strip_cells import Cells
from gso.typing import Array, Flags, Ints

#: Cost of a triangle's area, and of that of a slanted quad, relative to squared errors of normals.
_TRIANGLE, _SLANTED = 2e-3, 1e-4
#: Sine of the angle between a side and a ruling below which triangles are avoided.
_NARROW = 0.1
#: Distance of the end of a strip from its chord, relative to that, up to which it is one edge.
_STRAIGHT = 0.15
#: Numbers of vertices by which the first ruling of a closed strip is moved to either side.
_TURNED = 6


def free_rulings(cells: Cells, points: Array, normals: Array) -> Polygons:
    """Choose rulings strip by strip.

    Parameters
    ----------
    cells : Cells
        Strips with the rulings of a mesh.
    points, normals : ndarray, (n, 3)
        The mesh's vertices, and unit normals there.
    """
    own = cells.polygons
    owner, loops = cells.outlines
    rings: list[Ints] = []
    strip: list[int] = []
    rulings: list[Ints] = []
    cell_strip, of_ruling = own.strip, cells.strip_of_ruling
    for k in range(int(cell_strip.max()) + 1):
        sides = _sides([loops[i] for i in np.flatnonzero(owner == k)], cells, k, points)
        found: list[tuple[int, int]] = []
        if sides is not None:
            found = _path(sides, points, normals)
        if sides is None or not found:
            rings += [own.rings[i] for i in np.flatnonzero(cell_strip == k)]
            rulings.append(own.rulings[of_ruling == k])
        else:
            more, lines = _cells(sides, found)
            rings += more
            rulings.append(lines)
        strip += [k] * (len(rings) - len(strip))
    return own.with_rulings(rings, np.array(strip), np.concatenate(rulings))


def single(cells: Cells, points: Array) -> tuple[Polygons, Ints] | None:
    """Return a single strip between the rulings of a mesh, from its first to its last polygon.

    Parameters
    ----------
    cells : Cells
    points : ndarray, (n, 3)
        The mesh's vertices.

    Returns
    -------
    polygons : Polygons
    ends : ndarray of int, (r, 2)
        The ends of all rulings, those before the first and after the last polygon included.
        None where the strip closes around or branches, or rulings are missing.
    """
    own, (owner, loops) = cells.polygons, cells.outlines
    if owner.any() or own.strip.any():
        return None
    sides = _sides(loops, cells, 0, points)
    if sides is None or sides.closed or len(sides.one) != len(sides.two):
        return None
    ends = np.stack([sides.one, sides.two], axis=1)
    one, two = (np.unique(np.sort(e, axis=1), axis=0) for e in (ends[1:-1], own.rulings))
    if not np.array_equal(one, two):
        return None
    rings, rulings = _cells(sides, [(k, k) for k in range(len(ends))])
    return own.with_rulings(rings, np.zeros(len(rings), np.int64), rulings), ends


@dataclass(frozen=True)
class _Sides:
    """The vertices on both sides of a strip, in one direction.

    Attributes
    ----------
    one, two : ndarray of int
        The strip is to the left of `one`.
    closed : bool
        Whether the strip closes around.
    begin, end : ndarray of int
        Vertices between both sides where they begin and end.
    """

    one: Ints
    two: Ints
    closed: bool
    begin: Ints
    end: Ints


def _sides(loops: list[Ints], cells: Cells, strip: int, points: Array) -> _Sides | None:
    """Return the sides of a strip; None where it branches."""
    none = np.empty(0, np.int64)
    degree = cells.neighbours
    mine = np.flatnonzero(cells.strip == strip)
    if len(loops) == 2 and (degree[mine] == 2).all():
        one, two = loops[0], loops[1][::-1]
        starts = cells.ends[cells.strip_of_ruling == strip]
        partner = dict(np.concatenate([starts, starts[:, ::-1]]).tolist())
        if int(one[0]) not in partner or partner[int(one[0])] not in two:
            return None
        at = int(np.flatnonzero(two == partner[int(one[0])])[0])
        return _Sides(one, np.roll(two, -at), True, none, none)
    last = mine[degree[mine] == 1]
    if len(loops) != 1 or len(last) != 2 or (degree[mine] > 2).any():
        return None
    (loop,) = loops
    if len(np.unique(loop)) < len(loop):
        return None
    place = {int(v): i for i, v in enumerate(loop)}
    ends = []
    for cell in last:
        ring = cells.rings[cell]
        x, y = cells.end_ruling(int(cell))
        ring = np.roll(ring, -int(np.flatnonzero(ring == x)[0]))
        # From one end of the ruling around the outside to the other.
        inner = ring[1:-1] if ring[-1] == y else ring[2:]
        if not len(inner):
            return None
        if not _is_straight(points[inner]):
            half = len(inner) // 2
            inner = inner[len(inner) - 1 - half : half + 1]
        ends.append(inner)
    begin, end = ends
    one = _between(loop, place[int(begin[-1])], place[int(end[0])])
    two = _between(loop, place[int(end[-1])], place[int(begin[0])])[::-1]
    return _Sides(one, two, False, begin[1:-1], end[1:-1])


def _is_straight(points: Array) -> bool:
    """Return whether a polyline is nearly straight."""
    way = points[-1] - points[0]
    size = float(lengths(way))
    off = lengths(cross(np.broadcast_to(unit(way), points.shape), points - points[0]))
    return len(points) > 1 and float(off.max()) < _STRAIGHT * size


def _between(loop: Ints, first: int, last: int) -> Ints:
    return loop[np.arange(first, last + 1 if last >= first else last + len(loop) + 1) % len(loop)]


def _path(sides: _Sides, points: Array, normals: Array) -> list[tuple[int, int]]:
    """Return the successive rulings between two sides, as positions on these; none if there are no.

    Those at both ends of an open strip are included.
    """
    one, two = sides.one, sides.two
    if not sides.closed:
        return _cheapest(one, two, points, normals)[1]
    tried = []
    most = min(_TURNED, len(two) // 4)
    for turn in range(-most, most + 1):
        ends = np.r_[one, one[:1]], np.r_[np.roll(two, -turn), np.roll(two, -turn)[:1]]
        cost, path = _cheapest(*ends, points, normals)
        tried.append((cost, abs(turn), turn, path))
    _, _, turn, path = min(tried)
    return [(i % len(one), (j + turn) % len(two)) for i, j in path]


def _cheapest(
    one: Ints, two: Ints, points: Array, normals: Array
) -> tuple[float, list[tuple[int, int]]]:
    """Return the cost and the positions of the rulings from the first ends to the last."""
    p, q, m, n = points[one], points[two], normals[one], normals[two]
    first = _errors(p, m, q, n)
    second = _errors(q, n, p, m, turned=True).T
    same = one[:, None] == two[None]
    first[same[:-1] | same[1:]] = np.inf
    second[same[:, :-1] | same[:, 1:]] = np.inf
    quad = _quads(p, q, first, second, same)
    na, nb = len(p), len(q)
    total = np.full((na, nb), np.inf)
    step = np.zeros((na, nb), np.int8)
    total[0, 0] = 0.0
    for d in range(1, na + nb - 1):
        i = np.arange(max(0, d - nb + 1), min(d, na - 1) + 1)
        j = d - i
        tried = np.full((3, len(i)), np.inf)
        a, b = i > 0, j > 0
        c = a & b
        tried[0, c] = total[i[c] - 1, j[c] - 1] + quad[i[c] - 1, j[c] - 1]
        tried[1, a] = total[i[a] - 1, j[a]] + first[i[a] - 1, j[a]]
        tried[2, b] = total[i[b], j[b] - 1] + second[i[b], j[b] - 1]
        step[i, j] = tried.argmin(axis=0)
        total[i, j] = tried.min(axis=0)
    if not np.isfinite(total[-1, -1]):
        return np.inf, []
    row, column = na - 1, nb - 1
    path = [(row, column)]
    while row > 0 or column > 0:
        kind = int(step[row, column])
        row, column = row - (kind != 2), column - (kind != 1)
        path.append((row, column))
    return float(total[-1, -1]), path[::-1]


def _errors(p: Array, m: Array, q: Array, n: Array, *, turned: bool = False) -> Array:
    """Return the costs (na - 1, nb) of triangles on a side and opposite vertices."""
    way = p[1:] - p[:-1]
    normal = cross(np.broadcast_to(way[:, None], (len(way), len(q), 3)), q[None] - p[:-1][:, None])
    if turned:
        normal = -normal
    area = 0.5 * lengths(normal)
    design = unit(0.25 * (m[1:] + m[:-1])[:, None] + 0.5 * n[None])
    error = unit(normal) - design
    # Only the part of the error along the side tells whether the ruling is conjugate.
    along = np.einsum("ijd,id->ij", error, unit(way)) ** 2
    upright = np.einsum("ijd,ijd->ij", normal, design)
    # The smallest angle decides: a triangle with its corners on a line is none.
    size = lengths(way)[:, None] * np.minimum(
        lengths(q[None] - p[:-1][:, None]), lengths(q[None] - p[1:][:, None])
    )
    narrow = size * (upright < _NARROW * size)
    return np.asarray(area * (along + _TRIANGLE) + narrow)


def _quads(p: Array, q: Array, first: Array, second: Array, same: Flags) -> Array:
    """Return the costs (na - 1, nb - 1) of quads between two rulings."""
    na, nb = len(p), len(q)
    one, two = first[:, :-1] + second[1:], second[:-1] + first[:, 1:]
    # Where an end is one vertex the quad is the other triangle.
    out = np.where(np.isfinite(one) & np.isfinite(two), 0.5 * (one + two), np.minimum(one, two))
    begins, ends = same[:-1, :-1], same[1:, 1:]
    out[begins] = _corner(p, q, begins, 0)
    out[ends] = _corner(p, q, ends, 1)
    side = 0.5 * (p[1:] - p[:-1])[:, None] + 0.5 * (q[1:] - q[:-1])[None]
    ruling = 0.5 * (q[None, :-1] + q[None, 1:] - p[:-1, None] - p[1:, None])
    area = lengths(cross(side, ruling))
    slant = np.einsum("ijd,ijd->ij", unit(side), unit(ruling)) ** 2
    # Triangles pay for themselves; those of a quad do not.
    return np.asarray(out + area * (_SLANTED * slant - _TRIANGLE)).reshape(na - 1, nb - 1)


def _corner(p: Array, q: Array, where: Flags, end: int) -> Array:
    """Return costs of the triangles at common ends of both sides."""
    i, j = np.nonzero(where)
    if end:
        a, b, c = p[i + 1], p[i], q[j]
    else:
        a, b, c = p[i], p[i + 1], q[j + 1]
    double, size = lengths(cross(b - a, c - a)), lengths(b - a) * lengths(c - a)
    return np.asarray(_TRIANGLE * 0.5 * double + size * (double < _NARROW * size))


def _cells(sides: _Sides, path: list[tuple[int, int]]) -> tuple[list[Ints], Ints]:
    """Return the polygons, anticlockwise, and the rulings of a path."""
    pairs = [(int(sides.one[i]), int(sides.two[j])) for i, j in path]
    rings, last = [], len(pairs) - 2
    for k, ((a, b), (c, d)) in enumerate(pairwise(pairs)):
        begin = sides.begin.tolist() if k == 0 else []
        end = sides.end.tolist() if k == last else []
        ring = [a, c, *end, d, b, *begin]
        rings.append(np.array([v for i, v in enumerate(ring) if v != ring[i - 1]]))
    lines = pairs[:-1] if sides.closed else pairs[1:-1]
    return rings, np.array(lines, np.int64).reshape(-1, 2)

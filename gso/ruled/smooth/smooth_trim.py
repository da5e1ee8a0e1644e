"""The outline of a ruled surface on the patches of a smooth one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gso.geometry.steady import steady
from gso.geometry.vectors import lengths, unit
from gso.mesh import Mesh, Nearest
from gso.ruled.polygon import turning
from gso.ruled.smooth.patches import Patch
from gso.spline.trimmed import Loop
from gso.typing import Array, Flags, Ints

#: Length of outline segments that cross sides of patches, relative to the diagonal.
_SHORT = 1e-6
#: Turn of the outline that is a corner, in radians.
_CORNER = 0.3
#: Distance of parameters within which points are the same.
_SAME = 1e-7
#: Digits of the parameters of outlines.
_DIGITS = 10
#: Areas of parts and of holes, relative to the squared diagonal, that are left out: they come from
#: an outline that crosses itself.
_TINY = 1e-6, 1e-5
#: Turn of the outline, in radians, from which it goes back.
_BACK = 2.5
#: Shares of the corners of a triangle below this are zero.
_EDGE = 1e-9


class _Places:
    """Places of points on patches."""

    def __init__(self, patches: Sequence[Patch]):
        self.patches = patches
        parts = [p.triangles() for p in patches]
        start = np.r_[0, np.cumsum([len(uv) for uv, _ in parts])[:-1]]
        self._uv = np.concatenate([uv for uv, _ in parts])
        points = [p.points(uv) for p, (uv, _) in zip(patches, parts, strict=True)]
        self._triangles = np.concatenate([t + s for (_, t), s in zip(parts, start, strict=True)])
        self._owner = np.repeat(np.arange(len(parts)), [len(t) for _, t in parts])
        self._near = Nearest.of(np.concatenate(points), self._triangles)

    def locate(self, points: Array) -> tuple[Ints, Array]:
        """Return the patches (k,) of the nearest points, and the parameters (k, 2)."""
        which, shares, _ = self._near.locate(points)
        uv = np.einsum("kj,kjd->kd", shares, self._uv[self._triangles[which]])
        owner = self._owner[which]
        for k in np.unique(owner):
            own = owner == k
            uv[own] = self.patches[k].nearest(points[own], uv[own])
        return owner, uv


def trimmed(patches: Sequence[Patch], mesh: Mesh) -> list[Patch]:
    """Return the patches with the outlines of what is inside a mesh; others are left out.

    Parameters
    ----------
    patches : sequence of Patch
    mesh : Mesh
        A surface close to the patches; its diagonal is one.
    """
    places = _Places(patches)
    arcs: list[list[tuple[Array, Flags]]] = [[] for _ in patches]
    for loop in mesh.boundary_loops:
        points = mesh.vertices[loop]
        sharp = _corners(points)
        for k, uv, corner in _divided(patches, *_traced(places, points, sharp)):
            arcs[k].append((uv, corner))
    inside = _Inside(mesh)
    out = []
    for patch, own in zip(patches, arcs, strict=True):
        faces = _faces(patch, own, inside)
        if faces:
            out.append(replace(patch, faces=tuple(faces)))
    return out


def _corners(points: Array) -> Flags:
    """Return which points of a closed polygon (n, 3) are corners."""
    way = unit(np.roll(points, -1, axis=0) - points)
    turn = np.einsum("kd,kd->k", way, np.roll(way, 1, axis=0))
    return np.asarray(turn < np.cos(_CORNER))


def _traced(places: _Places, points: Array, sharp: Flags) -> tuple[Ints, Array, Flags, Flags]:
    """Locate a closed polygon on the patches.

    Segments between different patches are halved until they are short. The last array marks the
    points that were given.
    """
    owner, uv = places.locate(points)
    flag, given = sharp, np.ones(len(points), bool)
    while True:
        after = np.roll(points, -1, axis=0)
        k = np.flatnonzero((owner != np.roll(owner, -1)) & (lengths(after - points) > _SHORT))
        if not k.size:
            return owner, uv, flag, given
        middle = 0.5 * (points[k] + after[k])
        more = places.locate(middle)
        points = np.insert(points, k + 1, middle, axis=0)
        owner, uv = np.insert(owner, k + 1, more[0]), np.insert(uv, k + 1, more[1], axis=0)
        flag, given = (np.insert(x, k + 1, False) for x in (flag, given))


def _divided(
    patches: Sequence[Patch], owner: Ints, uv: Array, sharp: Flags, given: Flags
) -> list[tuple[int, Array, Flags]]:
    """Divide a closed polygon at the sides of patches.

    Returns
    -------
    list of (int, ndarray (k, 2), ndarray of bool (k,))
        Patch, parameters, and which points are corners; the first and the last one are on sides,
        unless the polygon is within a patch.
    """
    change = np.flatnonzero(owner != np.roll(owner, 1))
    if not change.size:
        k = int(owner[0])
        first = int(sharp.argmax())
        ring, own = np.roll(uv, -first, axis=0), np.roll(sharp, -first)
        own[0] = True
        return [(k, np.vstack([ring, ring[:1]]), np.r_[own, True])]
    first = -int(change[0])
    owner, uv = np.roll(owner, first), np.roll(uv, first, axis=0)
    sharp, given = np.roll(sharp, first), np.roll(given, first)
    starts = np.flatnonzero(owner != np.roll(owner, 1))
    parts = [np.arange(a, b) for a, b in zip(starts, np.r_[starts[1:], len(owner)], strict=True)]
    crossings = [
        _crossing(patches[owner[a[-1]]], uv[a[-1]], patches[owner[b[0]]], uv[b[0]])
        for a, b in zip(parts, [*parts[1:], parts[0]], strict=True)
    ]
    out = []
    for n, rows in enumerate(parts):
        begin, end = crossings[n - 1][1], crossings[n][0]
        inner = rows[given[rows]]
        near = [min(_apart(uv[r], begin), _apart(uv[r], end)) > _SAME for r in inner]
        inner = inner[near]
        line = np.vstack([begin[None], uv[inner].reshape(-1, 2), end[None]])
        out.append((int(owner[rows[0]]), line, np.r_[True, sharp[inner], True]))
    return out


def _apart(a: Array, b: Array) -> float:
    return float(np.abs(a - b).max())


def _crossing(one: Patch, a: Array, two: Patch, b: Array) -> tuple[Array, Array]:
    """Return the parameters in both patches of the point between points a and b of two patches."""
    best: tuple[float, Array, Array] | None = None
    for side in one.sides:
        for other in two.sides:
            if side.name != other.name:
                continue
            shares, far = [], 0.0
            for s, x in ((side, a), (other, b)):
                way = s.end - s.start
                share = float(np.clip((x - s.start) @ way / (way @ way), 0.0, 1.0))
                far = max(far, _apart(s.start + share * way, x))
                shares.append(share)
            t = 0.5 * (shares[0] + shares[1])
            places = [s.start + t * (s.end - s.start) for s in (side, other)]
            if best is None or far < best[0]:
                best = far, places[0], places[1]
    if best is None:
        # The outline leaves the surface at a point where several patches meet.
        return _on_border(one.domain, a), _on_border(two.domain, b)
    return best[1], best[2]


def _on_sides(domain: Array, x: Array) -> tuple[Array, Array]:
    """Return the nearest points (s, 2) of the sides of a domain, and the shares (s,) of each."""
    way = np.roll(domain, -1, axis=0) - domain
    share = np.clip(((x - domain) * way).sum(axis=1) / (way**2).sum(axis=1), 0.0, 1.0)
    return domain + share[:, None] * way, share


def _on_border(domain: Array, x: Array) -> Array:
    """Return the nearest point of the border of a domain."""
    points, _ = _on_sides(domain, x)
    return np.asarray(points[lengths(points - x).argmin()])


class _Inside:
    """Whether points near a mesh are inside its outline."""

    def __init__(self, mesh: Mesh):
        triangles = mesh.triangles
        self._near = Nearest(mesh)
        he = mesh.half_edges
        rim = np.flatnonzero(he.twin < 0)
        size = len(mesh.vertices)
        key = he.origin[rim] * size + he.dest[rim]
        sides = triangles[:, [1, 2, 0]] * size + triangles[:, [2, 0, 1]]
        self._rim = np.isin(sides, key)

    def __call__(self, points: Array) -> Flags:
        which, shares, _ = self._near.locate(points)
        outside = np.asarray((shares < _EDGE) & self._rim[which]).any(axis=1)
        return np.logical_not(outside)


def _faces(
    patch: Patch, arcs: list[tuple[Array, Flags]], inside: _Inside
) -> list[tuple[Loop, ...]]:
    """Return the outlines of the parts of a patch inside a mesh."""
    import shapely

    arcs = [(np.round(uv, _DIGITS), sharp) for uv, sharp in arcs]
    border = _border(patch.domain, [x for uv, _ in arcs for x in (uv[0], uv[-1])])
    corner = {tuple(x) for x in border.tolist()}
    # Holes of the design that are wholly inside the patch.
    whole = {tuple(uv[0].tolist()) for uv, _ in arcs if (uv[0] == uv[-1]).all()}
    for uv, sharp in arcs:
        corner |= {tuple(x) for x in uv[sharp].tolist()}
    lines = [shapely.LineString(pair) for pair in zip(border, np.roll(border, -1, axis=0))]
    lines += [shapely.LineString(uv) for uv, _ in arcs if len(uv) > 1]
    out = []
    for cell in shapely.get_parts(shapely.polygonize([steady(shapely.unary_union, lines)])):
        at = np.array(cell.representative_point().coords)
        if not inside(patch.points(at))[0]:
            continue
        loops: list[Loop] = []
        for k, ring in enumerate([cell.exterior, *cell.interiors]):
            uv = np.asarray(ring.coords)[:-1]
            own = any(tuple(x) in whole for x in uv.tolist())
            if not own and patch.area(uv) < _TINY[min(k, 1)]:
                if k == 0:
                    break
                continue
            uv = _without_spikes(uv, corner)
            loops.append(_chain(uv if shapely.is_ccw(ring) == (k == 0) else uv[::-1], corner))
        if loops:
            out.append(tuple(loops))
    return out


def _without_spikes(ring: Array, corner: set[tuple[float, ...]]) -> Array:
    """Leave out points of a ring (k, 2), other than corners, where it nearly turns back.

    Close to the common point of a fan of rulings the outline may go back and forth.
    """
    while len(ring) > 4:
        turn = np.abs(turning(ring))
        turn[[tuple(x) in corner for x in ring.tolist()]] = 0.0
        if turn.max() < _BACK:
            break
        ring = np.delete(ring, int(turn.argmax()), axis=0)
    return ring


def _border(domain: Array, points: list[Array]) -> Array:
    """Return the corners of a domain and points on its border, in their order around it."""
    keys, found = [float(k) for k in range(len(domain))], list(domain)
    for x in points:
        places, share = _on_sides(domain, x)
        far = np.abs(places - x).max(axis=1)
        k = int(far.argmin())
        if far[k] < 1e-9:
            keys.append(k + float(share[k]))
            found.append(x)
    order = np.argsort(keys, kind="stable")
    out = np.array(found)[order]
    new: Array = out[(out != np.roll(out, 1, axis=0)).any(axis=1)]
    return new


def _chain(ring: Array, corner: set[tuple[float, ...]]) -> Loop:
    """Divide a ring (k, 2) at corners."""
    at = [k for k, x in enumerate(ring.tolist()) if tuple(x) in corner]
    if not at:
        at = [int(np.abs(turning(ring)).argmax())]
    ring = np.roll(ring, -at[0], axis=0)
    ends = [k - at[0] for k in at[1:]] + [len(ring)]
    closed = np.vstack([ring, ring[:1]])
    return tuple(closed[a : b + 1] for a, b in zip([0, *ends[:-1]], ends, strict=True))

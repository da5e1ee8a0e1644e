"""Flat images of developable faces: from the equations of their surface, or facet by facet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.mesh import topology
from gso.recognition.round_surface import RoundSurface
from gso.typing import Array, Flags, Ints

#: Distance from the axis, relative to the largest, below which a point is the apex.
_APEX = 1e-4


@dataclass(frozen=True)
class Part:
    """Triangles of one face as a mesh of their own.

    Attributes
    ----------
    points : ndarray, (n, 3)
        Vertices of the whole mesh.
    triangles : ndarray of int, (k, 3)
    pairs : ndarray of int, (e, 2)
        Neighbours among them.
    ends : ndarray of int, (e, 2)
        Vertices of the edge between neighbours.
    """

    points: Array
    triangles: Ints
    pairs: Ints
    ends: Ints

    @classmethod
    def of(cls, points: Array, triangles: Ints) -> Part:
        """Find the neighbours among triangles."""
        he = topology.half_edges(triangles, len(points))
        one = he.interior
        pairs = np.stack([he.face[one], he.face[he.twin[one]]], axis=1)
        return cls(points, triangles, pairs, np.stack([he.origin[one], he.dest[one]], axis=1))

    def corner(self, side: int, end: int) -> Ints:
        """Return the corner of each pair's triangle that is at an end of their edge, (e,)."""
        found = self.triangles[self.pairs[:, side]] == self.ends[:, end, None]
        return np.asarray(found.argmax(axis=1))


def plane_image(part: Part) -> Array:
    """Project triangles of a plane onto it, seen from the side of their normals; (k, 3, 2)."""
    corners = part.points[part.triangles]
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = doubled.sum(axis=0)
    normal = normal / np.linalg.norm(normal)
    least = np.eye(3)[np.abs(normal).argmin()]
    e1 = np.cross(least, normal)
    e1 /= np.linalg.norm(e1)
    frame = np.stack([e1, np.cross(normal, e1)], axis=1)
    return np.asarray((corners - corners[0, 0]) @ frame)


def developed(part: Part, joined: Flags) -> tuple[Array, Flags]:
    """Lay triangles side by side in the plane, each with its true lengths.

    Parameters
    ----------
    part : Part
    joined : ndarray of bool, (e,)
        Pairs that may stay together.

    Returns
    -------
    flat : ndarray, (k, 3, 2)
    together : ndarray of bool, (e,)
        Pairs that are joined in the plane, within 1e-6 of the size.
    """
    corners = part.points[part.triangles]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    length = np.maximum(np.linalg.norm(a, axis=1), 1e-300)
    x = np.einsum("kd,kd->k", a, b) / length
    y = np.linalg.norm(np.cross(a, b), axis=1) / length
    local = np.stack([np.zeros(len(a)), length, x + 1j * y], axis=1)
    child, parent, pair = _tree(len(corners), part.pairs, joined)
    turn, shift = np.ones(len(corners), complex), np.zeros(len(corners), complex)
    to = np.arange(len(corners))
    side = (part.pairs[pair, 0] == parent).astype(int)
    p, q = (_at(part, local, pair, 1 - side, end) for end in (0, 1))
    p2, q2 = (_at(part, local, pair, side, end) for end in (0, 1))
    rotation = (q - p) / (q2 - p2)
    rotation /= np.abs(rotation)
    turn[child], shift[child], to[child] = rotation, p - rotation * p2, parent
    while (to != to[to]).any():
        shift = turn[to] * shift + shift[to]
        turn = turn * turn[to]
        to = to[to]
    flat = turn[:, None] * local + shift[:, None]
    gap = np.zeros(len(part.pairs))
    every = np.arange(len(part.pairs))
    for end in (0, 1):
        here, there = (_at(part, flat, every, np.full(len(every), s), end) for s in (0, 1))
        gap = np.maximum(gap, np.abs(here - there))
    size = float(np.abs(flat - flat.mean()).max())
    return np.stack([flat.real, flat.imag], axis=-1), gap <= 1e-6 * size


def _at(part: Part, values: Array, pair: Ints, side: Ints, end: int) -> Array:
    """Return the value (complex) at an end of pairs' edges in the triangle of a side."""
    triangle = part.pairs[pair, side]
    corner = (part.triangles[triangle] == part.ends[pair, end, None]).argmax(axis=1)
    return np.asarray(values[triangle, corner])


def _tree(count: int, pairs: Ints, joined: Flags) -> tuple[Ints, Ints, Ints]:
    """Span the graph of triangles by trees: child, parent and pair of each of their edges."""
    from scipy.sparse.csgraph import breadth_first_order

    which = np.flatnonzero(joined)
    a, b = pairs[which].T
    graph = topology.edge_graph(count, np.concatenate([a, b]), np.concatenate([b, a]))
    label = topology.label_components(count, a, b)
    before = np.full(count, -1)
    for root in np.unique(label, return_index=True)[1]:
        order, ahead = breadth_first_order(graph, int(root), return_predecessors=True)
        before[order[1:]] = ahead[order[1:]]
    child = np.flatnonzero(before >= 0)
    parent = before[child]
    low, high = np.minimum(a, b), np.maximum(a, b)
    keys = topology.edge_keys(low, high, count)
    order = np.argsort(keys, kind="stable")
    wanted = topology.edge_keys(np.minimum(child, parent), np.maximum(child, parent), count)
    return child, parent, which[order[np.searchsorted(keys[order], wanted)]]


@dataclass(frozen=True)
class RoundImage:
    """Flat image of triangles on a cylinder or cone.

    Attributes
    ----------
    angle : ndarray, (k, 3)
        Angle of each corner around the axis, continuous over the face.
    flat : ndarray, (k, 3, 2)
    together : ndarray of bool, (e,)
        Pairs of neighbours that are joined in the plane; the others are along the seam.
    sign : float
        1 where angles run anticlockwise in the plane, otherwise -1.
    """

    angle: Array
    flat: Array
    together: Flags
    sign: float


def round_image(part: Part, surface: RoundSurface, seam: float | None = None) -> RoundImage:
    """Unroll triangles of a cylinder or cone by its equation.

    On a cylinder a corner is at (radius * angle, height), on a cone at its distance from the apex
    and the angle around the axis times the sine of the half angle. Lengths are those of the
    surface: two vertices of a circle are as far apart as the arc is long. A face that closes
    around the axis is opened at an angle, along the ruling or the edges nearest to it.
    """
    theta, rho, _ = surface.coordinates(part.points)
    angle = continuous(part, theta, rho)
    if seam is None:
        angle = angle + 2 * np.pi * turns(part, angle, rho)[0][:, None]
    else:
        middle = angle.mean(axis=1)
        angle = angle - 2 * np.pi * np.floor((middle - seam) / (2 * np.pi))[:, None]
    return placed(part, surface, angle)


def placed(part: Part, surface: RoundSurface, angle: Array) -> RoundImage:
    """Place triangles of a round surface in the plane by the angles (k, 3) of their corners."""
    _, rho, height = surface.coordinates(part.points)
    t = part.triangles
    if surface.slope:
        sine, cosine = np.sin(surface.half_angle), np.cos(surface.half_angle)
        along = rho * sine + (height + surface.radius / surface.slope) * cosine
        centred = (angle - angle.mean()) * sine
        flat = along[t][..., None] * np.stack([np.cos(centred), np.sin(centred)], axis=-1)
    else:
        flat = np.stack([surface.radius * angle, height[t]], axis=-1)
    e, f = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    sign = 1.0 if float((e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0]).sum()) > 0 else -1.0
    flat = flat * (np.array([1.0, sign]) if surface.slope else np.array([sign, 1.0]))
    return RoundImage(angle, flat, ~_apart(part, angle, rho), sign)


def continuous(part: Part, theta: Array, rho: Array) -> Array:
    """Return the angles of corners (k, 3), within half a turn of each other in a triangle."""
    t = part.triangles
    far = rho[t] > _APEX * rho[t].max()
    unit = (np.exp(1j * theta[t]) * far).sum(axis=1)
    middle = np.angle(unit)
    turn = theta[t] - middle[:, None]
    turn -= 2 * np.pi * np.round(turn / (2 * np.pi))
    return np.asarray(np.where(far, middle[:, None] + turn, middle[:, None]))


def _jumps(part: Part, angle: Array, rho: Array) -> Ints:
    """Whole turns between the angles of neighbours at the end of their edge off the apex, (e,)."""
    end = (rho[part.ends[:, 1]] > rho[part.ends[:, 0]]).astype(int)
    at = part.ends[np.arange(len(end)), end]
    values = []
    for side in (0, 1):
        triangle = part.pairs[:, side]
        corner = (part.triangles[triangle] == at[:, None]).argmax(axis=1)
        values.append(angle[triangle, corner])
    return np.asarray(np.round((values[0] - values[1]) / (2 * np.pi)), np.int64)


def _apart(part: Part, angle: Array, rho: Array) -> Flags:
    return np.asarray(_jumps(part, angle, rho) != 0)


def turns(part: Part, angle: Array, rho: Array) -> tuple[Ints, bool]:
    """Return the turns to add to each triangle, and whether the face closes around the axis."""
    jump = _jumps(part, angle, rho)
    count = len(part.triangles)
    child, parent, pair = _tree(count, part.pairs, np.ones(len(part.pairs), bool))
    sign = np.where(part.pairs[pair, 0] == parent, 1, -1)
    shift, to = np.zeros(count, np.int64), np.arange(count)
    shift[child], to[child] = sign * jump[pair], parent
    while (to != to[to]).any():
        shift, to = shift + shift[to], to[to]
    closes = (shift[part.pairs[:, 1]] - shift[part.pairs[:, 0]] != jump).any()
    return shift, bool(closes)


def seam_angle(part: Part, theta: Array, rho: Array, height: Array, tolerance: float) -> float:
    """Choose the angle around the axis at which to open a face that closes around it.

    Of the rulings that meet no hole, the one with most of its length along edges; the middle of
    the widest part without holes, if no edges run along rulings; and the one that crosses the
    fewest holes, if each crosses some.
    """
    a, b = part.ends.T
    scale = max(float(rho[part.triangles].max()), 1e-300)
    close = max(1e-5, 4 * tolerance / scale)
    turn = theta[b] - theta[a]
    turn -= 2 * np.pi * np.round(turn / (2 * np.pi))
    apex = np.minimum(rho[a], rho[b]) <= _APEX * scale
    along = (np.abs(turn) * np.maximum(rho[a], rho[b]) <= close * scale) | apex
    length = np.hypot(height[b] - height[a], rho[b] - rho[a])[along]
    at = np.where(rho[a] > rho[b], theta[a], theta[b])[along]
    holes = hole_angles(part, theta, rho)
    candidates = np.sort(np.mod(at, 2 * np.pi))
    weights = length[np.argsort(np.mod(at, 2 * np.pi), kind="stable")]
    if len(candidates):
        new = np.diff(candidates, prepend=candidates[0] - 1) > close
        group = np.cumsum(new) - 1
        total = np.bincount(group, weights)
        angles = candidates[new]
    else:
        ends = np.sort(np.mod(np.concatenate([[0.0], *[[h[0], h[1]] for h in holes]]), 2 * np.pi))
        angles = (ends + np.append(ends[1:], ends[0] + 2 * np.pi)) / 2
        total = np.diff(np.append(ends, ends[0] + 2 * np.pi))
    crossed = np.zeros(len(angles))
    for low, high in holes:
        crossed += np.mod(angles - low, 2 * np.pi) < high - low
    best = crossed == crossed.min()
    longest = total >= 0.999 * total[best].max()
    return float(angles[np.flatnonzero(best & longest)[0]])


def hole_angles(part: Part, theta: Array, rho: Array) -> list[tuple[float, float]]:
    """Return the angles at which each hole begins and ends."""
    he = topology.half_edges(part.triangles, len(part.points))
    open_edges = he.twin < 0
    a, b = he.origin[open_edges], he.dest[open_edges]
    if not len(a):
        return []
    label = topology.label_components(len(part.points), a, b)[a]
    turn = theta[b] - theta[a]
    turn -= 2 * np.pi * np.round(turn / (2 * np.pi))
    found = []
    for one in np.unique(label):
        here = label == one
        if abs(turn[here].sum()) > np.pi or rho[a[here]].min() <= _APEX * rho.max():
            continue
        middle = np.angle(np.exp(1j * theta[a[here]]).sum())
        off = theta[a[here]] - middle
        off -= 2 * np.pi * np.round(off / (2 * np.pi))
        found.append((float(middle + off.min()), float(middle + off.max())))
    return found

"""Rigid flat patches of a surface, joined to parts that do not overlap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import MeshError, OptionError
from gso.geometry import area_vectors
from gso.geometry.vectors import unit
from gso.mesh.topology import edge_keys, label_components, pair_keys
from gso.typing import Array, Flags, Ints
from gso.unfolding.canonical_order import canonical_order, classes
from gso.unfolding.contact import boxes, overlapping
from gso.unfolding.dual_edges import DualEdges, dual_edges
from gso.unfolding.layout import Layout, Links, within
from gso.unfolding.part_search import searched

#: Distance, relative to the size, within which two flat copies of an edge are one.
SAME = 1e-7
#: How much longer a cut through a flat face counts.
_FLAT_CUT = 4.0
#: Distance from their plane, relative to the size, up to which triangles are projected to it.
_PLANE = 1e-12


@dataclass(frozen=True, eq=False)
class Joined:
    """Parts that patches were joined to.

    Attributes
    ----------
    flat : ndarray, (t, 3, 2)
        Corners of the triangles, each part in a place of its own.
    part : ndarray of int, (t,)
        Part of each triangle; the largest is 0.
    edges : DualEdges
        All interior edges of the triangles.
    whole : ndarray of bool, (e,)
        Those that are not cut.
    """

    flat: Array
    part: Ints
    edges: DualEdges
    whole: Flags


def join_patches(
    points: Array,
    triangles: Ints,
    patch: Ints | None = None,
    flat: Array | None = None,
    *,
    keep: ArrayLike = (),
    cut: ArrayLike = (),
    sheet: tuple[float, float] | None = None,
    larger: bool = False,
    flat_angle: float = 0.01,
    seed: int = 0,
    effort: float = 1.0,
) -> Joined:
    """Join rigid flat patches of a surface along edges to few parts that do not overlap.

    Parameters
    ----------
    points : ndarray, (n, 3)
    triangles : ndarray of int, (t, 3)
        Consistently oriented; no edge has more than two.
    patch : ndarray of int, (t,), optional
        The patch of each triangle, such as a face or an unrolled cylinder; each triangle is one
        when not given.
    flat : ndarray, (t, 3, 2), optional
        Corners of the triangles in the plane of their patch, with the surface's orientation: the
        outside is up. Needed with `patch`. Where both copies of an edge of one patch lie apart,
        the patch is cut there.
    keep, cut : array_like of int, (k, 2)
        Edges, by their vertices, that are not cut in any case, and that are.
    sheet : (float, float), optional
        Length and width that the smallest rectangle about a part may have.
    larger : bool
        Whether patches that are larger than the sheet are parts of their own.
    flat_angle : float
        Angle in degrees up to which an edge is no fold. Patches are joined along such edges first,
        and stay so.
    seed : int
        Of the search.
    effort : float
        Factor of the number of trials of the search; 0 for none.

    Raises
    ------
    OptionError
        Edges to keep cannot all be kept, or a patch is larger than the sheet and must not be.
    MeshError
        A triangle of a patch is inverted in its flat image.
    """
    edges = dual_edges(triangles, points)
    must_cut = _marked(edges, cut, len(points), "cut", triangles)
    must_keep = _marked(edges, keep, len(points), "keep", triangles)
    if (both := must_cut & must_keep).any():
        a, b = edges.ends[both][0]
        raise OptionError(f"edge {a}-{b} is in keep and in cut; leave it out of one of them")
    smooth = (np.abs(edges.angles) <= np.radians(flat_angle)) & ~must_cut
    rigid = patch
    if patch is None or flat is None:
        rigid = np.arange(len(triangles))
        patch, flat = _planes(points, triangles, edges, smooth)
    corners = np.asarray(flat, float) @ np.array([1.0, 1j])
    _check_upright(corners)
    size = float(np.linalg.norm(np.ptp(points[triangles], axis=(0, 1))))
    patch = np.unique(patch, return_inverse=True)[1].ravel()
    patch, corners = _first(patch, corners, edges, must_keep, smooth, sheet, SAME * size)
    same = patch[edges.triangles[:, 0]] == patch[edges.triangles[:, 1]]
    inside = same & ~must_cut & _coincide(corners, edges, SAME * size)
    lost = np.flatnonzero(must_keep & ~inside)
    if len(lost):
        a, b = edges.ends[lost[0]]
        raise OptionError(
            f"edge {a}-{b} cannot be kept: the faces beside it overlap when they are laid flat "
            "with all edges in keep; leave some of them out"
        )
    if sheet is not None and not larger:
        _check_sheet(corners, patch, sheet, triangles)

    def found(patch: Ints) -> Layout:
        same = patch[edges.triangles[:, 0]] == patch[edges.triangles[:, 1]]
        inside = same & ~must_cut & _coincide(corners, edges, SAME * size)
        order, turned = _ordered(triangles, points, patch, edges, inside, area)
        free = ~(same | must_cut)[order]
        chosen = edges.taken(order[free])
        worth = np.where(smooth[order[free]], _FLAT_CUT, 1.0)
        links = _linked(patch, chosen, turned[free], worth, area, corners, SAME * size, sheet)
        return searched(Layout.apart(links, corners), seed, effort)

    area = _areas(corners)
    done = found(patch)
    ringed = _ringed(patch, edges, inside)[patch]
    if effort > 0 and ringed.any() and done.number > done.links.least:
        # What bounds a hole of a flat face may have no room in it: the face is then opened.
        pair = rigid[edges.triangles] if rigid is not None else patch[edges.triangles]
        held = (must_keep & inside) | (pair[:, 0] == pair[:, 1]) | ~ringed[edges.triangles[:, 0]]
        held &= same
        one, other = edges.triangles[held].T
        done = min(done, found(label_components(len(triangles), one, other)), key=_number)
    part = done.part[done.links.patch]
    whole = (part[edges.triangles[:, 0]] == part[edges.triangles[:, 1]]) & ~must_cut
    whole &= _coincide(done.corners, edges, SAME * size)
    names = np.unique(part, return_inverse=True)[1].ravel()
    total = np.asarray(np.bincount(names, area), float)
    rank = np.empty(len(total), np.int64)
    rank[np.argsort(-classes(total), kind="stable")] = np.arange(len(total))
    out = np.stack([done.corners.real, done.corners.imag], axis=-1)
    return Joined(out, rank[names], edges, whole)


def _number(layout: Layout) -> int:
    return layout.number


def _ringed(patch: Ints, edges: DualEdges, inside: Flags) -> Flags:
    """Mark the patches that have holes: those whose Euler characteristic is below 1."""
    one, other = edges.corners()
    corner = label_components(3 * len(patch), one[inside].ravel(), other[inside].ravel())
    _, first = np.unique(corner, return_index=True)
    count = int(patch.max()) + 1
    vertices = np.bincount(np.repeat(patch, 3)[first], minlength=count)
    joints = np.bincount(patch[edges.triangles[inside, 0]], minlength=count)
    # A triangle has three edges, of which two triangles share one.
    return np.asarray(vertices - 2 * np.bincount(patch, minlength=count) + joints < 1)


def _marked(edges: DualEdges, given: ArrayLike, count: int, name: str, triangles: Ints) -> Flags:
    """Mark the edges that are given by their vertices; those of the outline do not matter."""
    pairs = np.asarray(given if np.size(given) else np.empty((0, 2)), np.int64).reshape(-1, 2)
    origin, dest = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    inside = ((pairs >= 0) & (pairs < count)).all(axis=1)
    keys = pair_keys(pairs, count)
    missing = np.flatnonzero(~(inside & np.isin(keys, edge_keys(origin, dest, count))))
    if len(missing):
        a, b = pairs[missing[0]]
        raise OptionError(f"{name}: {a}-{b} is no edge of a face ({len(missing)} such pairs)")
    return np.isin(pair_keys(edges.ends, count), keys)


def _planes(points: Array, triangles: Ints, edges: DualEdges, smooth: Flags) -> tuple[Ints, Array]:
    """Return the patches of triangles in common planes, and their flat corners.

    Triangles that are not exactly in one plane, or overlap in it, are patches of their own: they
    are turned into a plane one by one, so that no length changes.
    """
    pair = edges.triangles[smooth]
    patch = label_components(len(triangles), pair[:, 0], pair[:, 1])
    p = points[triangles]
    normal = area_vectors(points, triangles)
    total = np.stack([np.bincount(patch, normal[:, d]) for d in range(3)], axis=1)[patch]
    mean = unit(np.asarray(total, float))
    _, first = np.unique(patch, return_index=True)
    away = np.einsum("tkd,td->tk", p - p[first[patch], 0][:, None], mean)
    far = np.zeros(int(patch.max()) + 1)
    np.maximum.at(far, patch, np.abs(away).max(axis=1))
    bent = (far > _PLANE * np.ptp(points, axis=0).max())[patch]
    mean[bent] = normal[bent] / np.linalg.norm(normal[bent], axis=1, keepdims=True)
    patch = np.where(bent, int(patch.max()) + 1 + np.arange(len(patch)), patch)
    origin = np.where(bent[:, None], p[:, 0], p[first[np.where(bent, 0, patch)], 0])
    # A direction in the plane, from the axis that is most inclined to the normal.
    axis = np.eye(3)[np.abs(mean).argmin(axis=1)]
    x = np.cross(axis, mean)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(mean, x)
    way = p - origin[:, None]
    flat = np.stack([np.einsum("tkd,td->tk", way, x), np.einsum("tkd,td->tk", way, y)], axis=-1)
    return _once(patch, flat), flat


def _once(patch: Ints, flat: Array) -> Ints:
    """Divide patches that cover a part of their plane twice into their triangles."""
    corners = flat @ np.array([1.0, 1j])
    out: Ints = patch.copy()
    order = np.argsort(patch, kind="stable")
    for own in np.split(order, np.flatnonzero(np.diff(patch[order])) + 1):
        if len(own) < 3:
            continue
        some = corners[own]
        pairs = overlapping(some, some, boxes(some), boxes(some))
        if (pairs[:, 0] != pairs[:, 1]).any():
            out[own] = int(out.max()) + 1 + np.arange(len(own))
    return out


def _check_upright(corners: np.ndarray) -> None:
    bad = np.flatnonzero(_areas(corners) < 0)
    if len(bad):
        raise MeshError(
            f"triangle {bad[0]} is inverted in its patch; flat images have the orientation of the "
            "surface"
        )


def _areas(corners: np.ndarray) -> Array:
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(0.5 * (one.conj() * other).imag)


def _coincide(corners: np.ndarray, edges: DualEdges, distance: float) -> Flags:
    """Mark the edges whose flat copies are one."""
    flat = corners.reshape(-1)
    one, other = edges.corners()
    return np.asarray((np.abs(flat[one] - flat[other]) <= distance).all(axis=1))


def _first(
    patch: Ints,
    corners: np.ndarray,
    edges: DualEdges,
    keep: Flags,
    smooth: Flags,
    sheet: tuple[float, float] | None,
    distance: float,
) -> tuple[Ints, np.ndarray]:
    """Join patches along edges that must be kept, and then along those that are no folds."""
    pair = patch[edges.triangles]
    apart = pair[:, 0] != pair[:, 1]
    size = np.abs(np.diff(corners.reshape(-1)[edges.corners()[0]], axis=1)).ravel()
    todo = [np.flatnonzero(mask & apart) for mask in (keep, smooth & ~keep)]
    every = np.concatenate([part[np.argsort(-classes(size[part]), kind="stable")] for part in todo])
    if not len(every):
        return patch, corners
    one, other = edges.corners()
    area = np.bincount(patch, _areas(corners))
    shares = area / area.sum()
    links = Links(patch, pair[every], one[every], other[every], size[every], shares, sheet)
    layout = Layout.apart(links, corners)
    for number in range(len(every)):
        a, b = layout.part[links.patches[number]]
        if a != b and not layout.join(number) and number < len(todo[0]):
            break
    return np.unique(layout.part, return_inverse=True)[1].ravel()[patch], layout.corners


def _check_sheet(
    corners: np.ndarray, patch: Ints, sheet: tuple[float, float], triangles: Ints
) -> None:
    order = np.argsort(patch, kind="stable")
    for own in np.split(order, np.flatnonzero(np.diff(patch[order])) + 1):
        if not within(corners[own].ravel(), sheet):
            at = np.unique(triangles[own])[:6]
            raise OptionError(
                f"the flat face with the vertices {', '.join(map(str, at))} is larger than the "
                f"sheet of {sheet[0]:g} x {sheet[1]:g}; take a larger one"
            )


def _ordered(
    triangles: Ints, points: Array, patch: Ints, edges: DualEdges, inside: Flags, area: Array
) -> tuple[Ints, Flags]:
    """Order edges between patches independently of the numbering, and mark those to be turned."""
    count = triangles.size
    twin, of_half = np.full(count, -1), np.full(count, -1)
    twin[edges.halves[:, 0]], twin[edges.halves[:, 1]] = edges.halves[:, 1], edges.halves[:, 0]
    of_half[edges.halves] = np.arange(len(edges))[:, None]
    inner = np.zeros(count, bool)
    inner[edges.halves[inside].ravel()] = True
    way = points[np.roll(triangles, -1, axis=1)] - points[triangles]
    angle = np.where(of_half >= 0, np.r_[edges.angles, 9.0][of_half], 9.0)
    kinds = [
        classes(np.linalg.norm(way, axis=2).ravel()),
        classes(angle),
        classes(np.asarray(np.bincount(patch, area), float))[np.repeat(patch, 3)],
    ]
    walk = canonical_order(triangles, twin, inner, kinds)
    reached = of_half[walk]
    number, first = np.unique(reached, return_index=True)
    number, first = number[number >= 0], first[number >= 0]
    order = np.argsort(first)
    return number[order], edges.halves[number[order], 0] != walk[first[order]]


def _linked(
    patch: Ints,
    edges: DualEdges,
    turned: Flags,
    worth: Array,
    area: Array,
    corners: np.ndarray,
    distance: float,
    sheet: tuple[float, float] | None,
) -> Links:
    """Make the graph of patches, which are numbered as the edges reach them.

    Of edges along which patches are joined at once, such as those of a divided straight side, one
    is taken.
    """
    pair = patch[edges.triangles]
    one, other = edges.corners()
    pair = np.where(turned[:, None], pair[:, ::-1], pair)
    one, other = (np.where(turned[:, None], x, y) for x, y in ((other, one), (one, other)))
    reached = np.r_[pair.ravel(), np.arange(int(patch.max()) + 1)]
    names, first = np.unique(reached, return_index=True)
    rank = np.empty(len(names), np.int64)
    rank[np.argsort(first)] = np.arange(len(names))
    patch, pair = rank[patch], rank[pair]
    flat = corners.reshape(-1)
    length = worth * np.abs(np.diff(flat[one], axis=1)).ravel()
    kept, weights = _hinges(pair, flat[one], flat[other], length, distance)
    shares = np.bincount(patch, area) / area.sum()
    return Links(patch, pair[kept], one[kept], other[kept], weights, shares, sheet)


def _hinges(
    pair: Ints, one: np.ndarray, other: np.ndarray, length: Array, distance: float
) -> tuple[Ints, Array]:
    """Return one edge of each set that is joined at once, and the lengths of the sets."""
    weights = length.copy()
    kept = np.ones(len(pair), bool)
    key = np.sort(pair, axis=1) @ np.array([int(pair.max(initial=0)) + 1, 1])
    order = np.argsort(key, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(key[order])) + 1)
    for group in groups:
        left = group
        while len(left) > 1:
            k, left = left[0], left[1:]
            same = pair[left, 0] == pair[k, 0]
            a, b = (
                np.where(same[:, None], x, y)
                for x, y in ((one[left], other[left]), (other[left], one[left]))
            )
            turn = np.diff(one[k])[0] / np.diff(other[k])[0]
            turn /= abs(turn)
            shift = one[k].mean() - turn * other[k].mean()
            along = (np.abs(a - turn * b - shift) <= distance).all(axis=1)
            weights[k] += length[left[along]].sum()
            kept[left[along]] = False
            left = left[~along]
    return np.flatnonzero(kept), weights[kept]

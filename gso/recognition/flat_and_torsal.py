"""Division of what is neither cylinder nor cone into planes, torsal surfaces and free surfaces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.geometry.vectors import unit
from gso.mesh import topology
from gso.recognition.facet_graph import SMOOTH, FacetGraph
from gso.typing import Array, Flags, Ints

#: Facets from which on a strip is a smooth surface and no polyhedron.
_SEVERAL = 4
#: Multiple of the folds beside it, and angle in radians, above which a fold is no ruling.
_ALONE, _VISIBLE = 3.0, np.radians(3.0)
#: Multiple of the median area of a strip's facets above which a facet is a plane.
_LARGE = 3.0
#: Multiple of the median area of free triangles up to which a facet is small.
_SMALL = 4.0
#: Multiple of the median area of free facets, and triangles, from which on a facet is a plane.
_PLATE, _MANY = 8.0, 4
#: Facets below which a strip is short, and share of a component's area below which it is small.
_SHORT, _LITTLE = 12, 0.01
#: Share of a component's area that makes it mostly free.
_MOSTLY = 0.5
#: Least eigenvalue of the mean of products of normals that are not across one direction.
_TURNED = 1e-8


@dataclass(frozen=True)
class Patch:
    """Triangles of one face.

    Attributes
    ----------
    kind : str
        "plane", "cone", "torsal" or "free".
    triangles : ndarray of int, (k,)
    axis, apex : ndarray, (3,), or None
        Direction of parallel rulings, and point that all rulings pass.
    """

    kind: str
    triangles: Ints
    axis: Array | None = None
    apex: Array | None = None


def other_patches(graph: FacetGraph, free: Flags) -> list[Patch]:
    """Divide triangles that are on no round surface into planes, torsal and free surfaces.

    Parameters
    ----------
    graph : FacetGraph
    free : ndarray of bool, (t,)
        The triangles.

    Notes
    -----
    Triangles that are joined by folds of at most 30 degrees are one part. It is torsal if all its
    folds run straight from outline to outline and if it has at least four facets; a fold that is
    three times as large as those beside it divides it, and so does a facet that is three times
    as large as most: a plane. Other parts of more than one facet are free, but for large
    facets.
    """
    fold = np.abs(graph.folds)
    inner = graph.facet[graph.pairs[:, 0]] == graph.facet[graph.pairs[:, 1]]
    smooth = (fold <= SMOOTH) | inner
    label = graph.connected(free, smooth)
    count = int(label.max()) + 1 if free.any() else 0
    if not count:
        return []
    straight = _straight_parts(graph, label, smooth & ~inner, count)
    facets = _facets_of(graph, label, count)
    strip = straight & (facets >= _SEVERAL)
    whole = (facets == 1) | _flat_parts(graph, label, count)
    strip &= ~whole
    flat = whole | (straight & ~strip)
    kind = np.full(len(free), _FREE)
    kind[free & flat[label]] = _PLANE
    ribbon = free & strip[label]
    ribbon_label, planar = _divided(graph, ribbon, smooth, inner)
    kind[ribbon] = _TORSAL
    kind[planar] = _PLANE
    kind[~free] = _NONE
    bent = free & ~flat[label] & ~strip[label]
    kind[_plates(graph, bent, label)] = _PLANE
    inner |= smooth & (free & whole[label])[graph.pairs].all(axis=1)
    return _absorbed(graph, _patches(graph, kind, ribbon_label, smooth, inner))


_NONE, _FREE, _PLANE, _TORSAL = -1, 0, 1, 2


def _facets_of(graph: FacetGraph, label: Ints, count: int) -> Ints:
    """Count the facets of each part."""
    first = np.unique(graph.facet, return_index=True)[1]
    known = label[first]
    return np.bincount(known[known >= 0], minlength=count)


def _flat_parts(graph: FacetGraph, label: Ints, count: int) -> Flags:
    """Which parts lie in a plane as a whole, within the tolerance; (count,)."""
    corners = graph.triangles[label >= 0].ravel()
    of = np.repeat(label[label >= 0], 3)
    number = np.bincount(of, minlength=count)
    points = graph.points[corners]
    mean = np.stack([np.bincount(of, x, count) for x in points.T], axis=1) / number[:, None]
    d = points - mean[of]
    products = np.stack(
        [np.bincount(of, d[:, i] * d[:, j], count) for i in range(3) for j in range(3)], axis=1
    )
    normal = np.linalg.eigh(products.reshape(-1, 3, 3))[1][:, :, 0]
    off = np.zeros(count)
    np.maximum.at(off, of, np.abs(np.einsum("kd,kd->k", d, normal[of])))
    return off <= graph.tolerance


def _straight_parts(graph: FacetGraph, label: Ints, folded: Flags, count: int) -> Flags:
    """Which parts have straight folds only, which end at the outline; (count,)."""
    n = len(graph.points)
    of_edge = label[graph.pairs]
    folded = folded & (of_edge[:, 0] == of_edge[:, 1]) & (of_edge[:, 0] >= 0)
    inside = _inner_vertices(graph, label)
    a, b = graph.ends[folded].T
    at, other = np.concatenate([a, b]), np.concatenate([b, a])
    number = np.bincount(at, minlength=n)
    total = np.stack([np.bincount(at, graph.points[other, k], n) for k in range(3)], axis=1)
    squared = np.bincount(at, (graph.points[other] ** 2).sum(axis=1), n)
    bad = inside & (number != 0) & (number != 2)
    two = np.flatnonzero(inside & (number == 2))
    # Ends of the two folds: their middle and half their difference.
    middle = total[two] / 2
    half2 = np.maximum(squared[two] / 2 - (middle**2).sum(axis=1), 1e-300)
    off = middle - graph.points[two]
    order = np.argsort(at, kind="stable")
    start = np.searchsorted(at[order], two)
    along = unit(graph.points[other[order][start]] - graph.points[other[order][start + 1]])
    height = np.linalg.norm(off - np.einsum("vd,vd->v", off, along)[:, None] * along, axis=1)
    bent = height > 4 * graph.tolerance + 1e-6 * np.sqrt(half2)
    # A fold that turns back at a vertex is not straight either.
    bent |= np.abs(np.einsum("vd,vd->v", off, along)) > np.sqrt(half2)
    bad[two[bent]] = True
    corners = graph.triangles.ravel()
    hit = np.repeat(label, 3)[bad[corners]]
    straight = np.ones(count, bool)
    straight[hit[hit >= 0]] = False
    return straight


def _inner_vertices(graph: FacetGraph, label: Ints) -> Flags:
    """Which vertices have triangles of one part all around them, (n,)."""
    n, he = len(graph.points), graph.half_edges
    corners, of = graph.triangles.ravel(), np.repeat(label, 3)
    low, high = np.full(n, len(label)), np.full(n, -2)
    np.minimum.at(low, corners, of)
    np.maximum.at(high, corners, of)
    return np.asarray((low == high) & (low >= 0) & ~he.boundary_vertex)


def _divided(graph: FacetGraph, ribbon: Flags, smooth: Flags, inner: Flags) -> tuple[Ints, Flags]:
    """Divide torsal parts at folds that stand alone and at large facets.

    Returns the label of each triangle (t,), -1 for others, and the triangles that are planes.
    """
    f = graph.facet[graph.pairs]
    inside = ribbon[graph.pairs].all(axis=1) & smooth & ~inner
    low, high = f.min(axis=1), f.max(axis=1)
    fold = np.where(inside, np.abs(graph.folds), 0.0)
    count = int(graph.facet.max()) + 1
    key = topology.edge_keys(low, high, count)
    _, pair, where = np.unique(key, return_index=True, return_inverse=True)
    size = np.zeros(len(pair))
    np.maximum.at(size, where.ravel(), fold)
    beside = np.maximum(*_largest_other(low[pair], high[pair], size, count))
    alone = (size > _ALONE * beside) & (size > _VISIBLE)
    joined = (smooth & ~alone[where.ravel()]) | inner
    label = graph.connected(ribbon, joined)
    planar = ribbon & _large_facets(graph, label, _LARGE, 1)
    label = graph.connected(ribbon & ~planar, joined)
    if (label >= 0).any():
        few = _facets_of(graph, label, int(label.max()) + 1) < 3
        planar |= (label >= 0) & few[label]
    return label, planar


def _largest_other(low: Ints, high: Ints, size: Array, count: int) -> tuple[Array, Array]:
    """Return the largest fold of each pair's two facets besides that between them."""
    ends = np.concatenate([low, high])
    values = np.concatenate([size, size])
    order = np.lexsort((-values, ends))
    start = np.searchsorted(ends[order], np.arange(count))
    first, second = np.zeros(count), np.zeros(count)
    sorted_values, sorted_ends = values[order], ends[order]
    known = start < len(order)
    known[known] &= sorted_ends[start[known]] == np.flatnonzero(known)
    first[known] = sorted_values[start[known]]
    more = known & (start + 1 < len(order))
    more[more] &= sorted_ends[start[more] + 1] == np.flatnonzero(more)
    second[more] = sorted_values[start[more] + 1]
    return (
        np.where(size >= first[low], second[low], first[low]),
        np.where(size >= first[high], second[high], first[high]),
    )


def _large_facets(graph: FacetGraph, label: Ints, times: float, triangles: int) -> Flags:
    """Which triangles belong to facets much larger than the median of their part, (t,)."""
    first = np.unique(graph.facet, return_index=True)[1]
    of_facet, area = label[first], graph.facet_areas
    order = np.lexsort((area, of_facet))
    parts = np.arange(int(label.max()) + 1)
    begin = np.searchsorted(of_facet[order], parts)
    end = np.searchsorted(of_facet[order], parts, side="right")
    if not len(parts):
        return np.zeros(len(label), bool)
    median = area[order][(begin + end - 1) // 2]
    large = (of_facet >= 0) & (area > times * median[of_facet])
    large &= np.bincount(graph.facet) >= triangles
    return np.asarray(large[graph.facet])


def _plates(graph: FacetGraph, bent: Flags, label: Ints) -> Flags:
    """Large flat facets in free parts: plates with something free in or beside them."""
    return bent & _large_facets(graph, np.where(bent, label, -1), _PLATE, _MANY)


def _absorbed(graph: FacetGraph, patches: list[Patch]) -> list[Patch]:
    """Make small planes and short strips of mostly free components part of the free surface."""
    free = np.zeros(len(graph.triangles), bool)
    for patch in patches:
        free[patch.triangles] = patch.kind == "free"
    if not free.any():
        return patches
    whole = graph.connected(np.ones_like(free))
    total = np.bincount(whole, graph.areas)
    share = np.bincount(whole, graph.areas * free) / total
    typical = float(np.median(graph.areas[free]))
    kept = []
    for patch in patches:
        facets = np.unique(graph.facet[patch.triangles])
        of = whole[patch.triangles[0]]
        few = len(facets) < _SHORT or graph.areas[patch.triangles].sum() < _LITTLE * total[of]
        small = few and np.median(graph.facet_areas[facets]) <= _SMALL * typical
        if small and patch.kind != "free" and share[of] > _MOSTLY:
            free[patch.triangles] = True
        elif patch.kind != "free":
            kept.append(patch)
    return kept + [Patch("free", part) for part in _groups(graph.connected(free))]


def _patches(
    graph: FacetGraph, kind: Ints, ribbon_label: Ints, smooth: Flags, inner: Flags
) -> list[Patch]:
    """Make a patch of each facet that is a plane, each strip, and each free part."""
    found = []
    strip = np.where(kind == _TORSAL, ribbon_label, -1)
    same = strip[graph.pairs[:, 0]] == strip[graph.pairs[:, 1]]
    labels = graph.connected(kind == _TORSAL, same & (smooth | inner))
    for member in _groups(labels):
        found.append(_torsal(graph, member))
    for member in _groups(graph.connected(kind == _PLANE, inner)):
        found.append(Patch("plane", member))
    for member in _groups(graph.connected(kind == _FREE)):
        found.append(Patch("free", member))
    return found


def _groups(label: Ints) -> list[Ints]:
    """Return the members of each label of 0 or more."""
    order = np.argsort(label, kind="stable")
    order = order[label[order] >= 0]
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1) if len(order) else []


def _torsal(graph: FacetGraph, triangles: Ints) -> Patch:
    """Find whether the rulings of a strip are parallel, or pass one point."""
    ids = triangles[np.unique(graph.facet[triangles], return_index=True)[1]]
    n = graph.facet_normals[graph.facet[ids]]
    if len(ids) < _SEVERAL:
        return Patch("torsal", triangles)
    points = graph.points[np.unique(graph.triangles[triangles])]
    middle = points.mean(axis=0)
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    values, vectors = np.linalg.eigh(n.T @ n / len(n))
    off = np.abs(n @ vectors[:, 0]).max()
    if off * size <= 8 * graph.tolerance + 1e-7 * size:
        return Patch("torsal", triangles, axis=vectors[:, 0])
    if values[0] < _TURNED:
        return Patch("torsal", triangles)
    heights = np.einsum("fd,fd->f", n, graph.middles[ids] - middle)
    apex = np.linalg.lstsq(n, heights, rcond=None)[0]
    if np.abs(n @ apex - heights).max() <= 8 * graph.tolerance + 1e-7 * size:
        return Patch("cone", triangles, apex=middle + apex)
    return Patch("torsal", triangles)

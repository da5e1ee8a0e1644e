"""Tests whether a region on a round surface is a smooth surface, or part of a polyhedron."""

from __future__ import annotations

import numpy as np

from gso.recognition.facet_graph import SMOOTH, FacetGraph
from gso.recognition.region_members import APEX, TILTED, triangle_spans
from gso.recognition.round_surface import RoundSurface
from gso.typing import Array, Flags, Ints

#: Facets around the axis from which on they are a smooth surface.
_SEVERAL = 2.5
#: Facets around the axis from which on a region is one whatever is beside it, and multiple of the
#: tolerance within which a point is almost on a surface.
_MANY, _ALMOST = 8.0, 20.0
#: Angle around the axis from which on cuts may be any curves, in radians.
_FAR = 3.0
#: Multiple of the tolerance by which a surface that is curved both ways would be off.
_SURE = 100.0
#: Share of a region's vertices that are inside of it where several rows of facets are.
_INSIDE = 0.1
#: Slope of an edge against the plane of a circle up to which it is on a circle.
_LEVEL = 5e-3


def is_smooth(graph: FacetGraph, surface: RoundSurface, member: Flags, free: Flags) -> bool:
    """Whether a region is a smooth surface and no polyhedron, nor a row of a free surface."""
    triangles = graph.triangles[member]
    if len(np.unique(graph.facet[member])) < 3:
        return False
    ids = np.unique(triangles)
    angle, rho, _ = surface.coordinates(graph.points)
    spans = triangle_spans(surface, angle, rho, triangles)
    typical = float(np.quantile(spans, 0.75))
    covered = _covered(angle, rho, ids, typical)
    if float(np.median(spans)) > SMOOTH or covered < _SEVERAL * typical:
        return False
    # A plane within the tolerance is a plane.
    around_mean = graph.points[ids] - graph.points[ids].mean(axis=0)
    direction = np.linalg.eigh(around_mean.T @ around_mean)[1][:, 0]
    if np.ptp(around_mean @ direction) <= 4 * graph.tolerance:
        return False
    if covered < _MANY * typical and _goes_on(graph, surface, member):
        return False
    around = float(np.median(rho[ids])) * covered
    width = float(graph.areas[member].sum()) / max(around, 1e-300)
    # A surface that is as curved along its rulings as around would be this much off.
    off = width**2 * covered / (8 * around)
    proved = covered >= max(_MANY * typical, _FAR) and off > _SURE * graph.tolerance
    return _has_straight_rulings(graph, surface, member, free, ids, only_circles=proved)


def _covered(angle: Array, rho: Array, ids: Ints, typical: float) -> float:
    """Angle around the axis between the outermost vertices of a region; a full turn if closed."""
    around = np.sort(angle[ids[rho[ids] > APEX * rho[ids].max()]])
    gap = float(np.diff(around, append=around[:1] + 2 * np.pi).max())
    return 2 * np.pi - gap if gap > 2 * typical else 2 * np.pi


def _goes_on(graph: FacetGraph, surface: RoundSurface, member: Flags) -> bool:
    """Whether facets beside a region along its rulings lie almost on its surface.

    Three facets of any smooth torsal surface lie on a cone, up to the rounding of coordinates, and
    the next are a little off.
    """
    one, two = member[graph.pairs].T
    border = (one != two) & (np.abs(graph.folds) <= SMOOTH)
    ends = graph.points[graph.ends[border]]
    along = ends[:, 1] - ends[:, 0]
    cosine = np.einsum("ed,ed->e", along, surface.rulings(ends.mean(axis=1)))
    ruling = np.abs(cosine) > np.cos(TILTED) * np.linalg.norm(along, axis=1)
    beside = np.where(one, graph.pairs[:, 1], graph.pairs[:, 0])[border][ruling]
    if not len(beside):
        return False
    facets = np.isin(graph.facet, graph.facet[beside])
    off = np.abs(surface.distances(graph.points[graph.triangles[facets]].reshape(-1, 3)))
    worst = np.zeros(int(graph.facet.max()) + 1)
    np.maximum.at(worst, np.repeat(graph.facet[facets], 3), off)
    # A vertex of a triangle across the end of a bend may be close by chance.
    return bool((worst[graph.facet[beside]] <= _ALMOST * graph.tolerance).mean() > 0.5)


def _has_straight_rulings(
    graph: FacetGraph,
    surface: RoundSurface,
    member: Flags,
    free: Flags,
    ids: Ints,
    *,
    only_circles: bool,
) -> bool:
    """Whether the rulings are proved straight, by points inside, or end at edges or sharp folds.

    One row of facets of a sphere lies on a cone, too: it ends at circles, and with `only_circles`
    only these count.
    """
    one, two = member[graph.pairs].T
    inside = np.zeros(len(graph.points), bool)
    inside[ids] = True
    border = one != two
    inside[graph.ends[border]] = False
    inside[graph.half_edges.origin[_open_edges(graph)]] = False
    inside[graph.half_edges.dest[_open_edges(graph)]] = False
    if inside.sum() > _INSIDE * len(ids):
        return True
    a, b = graph.points[graph.ends[border]].transpose(1, 0, 2)
    along = b - a
    length = np.linalg.norm(along, axis=1)
    cosine = np.abs(np.einsum("ed,ed->e", along, surface.rulings((a + b) / 2)))
    across = cosine < np.cos(TILTED) * length
    fold = np.abs(graph.folds[border])
    level = not only_circles
    level |= np.abs(along @ surface.axis) <= _LEVEL * length + 4 * graph.tolerance
    smooth = across & level & (fold <= graph.largest_smooth) & free[graph.pairs[border]].all(axis=1)
    return bool(length[smooth].sum() <= _INSIDE * max(length[across].sum(), 1e-300))


def _open_edges(graph: FacetGraph) -> Flags:
    return np.asarray(graph.half_edges.twin < 0)

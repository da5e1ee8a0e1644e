"""The triangles of a mesh that are on a round surface."""

from __future__ import annotations

import numpy as np

from gso.recognition.facet_graph import FacetGraph
from gso.recognition.round_surface import RoundSurface
from gso.typing import Array, Flags, Ints

#: Angle around the axis that one triangle can span, its multiple of the upper quartile, and the
#: angle that it can always span.
_WIDEST, _WIDER, _NARROW = np.radians(62.0), 3.0, np.radians(8.0)
#: Angle between the normals of a triangle and of the surface, in radians.
TILTED = np.radians(35.0)
#: Distance from the axis, relative to the largest, below which a point is the apex.
APEX = 1e-4
#: Multiple of the tolerance up to which a seed region may lie off its surface.
LOOSE = 4.0


def members(graph: FacetGraph, surface: RoundSurface, inside: Flags, free: Flags) -> Flags:
    """Free triangles on a surface that are connected to a region, or to most of it.

    Vertices of holes that were cut into the facets of a mesh are inside the surface.
    """
    angle, rho, height = surface.coordinates(graph.points)
    radius = surface.radius + surface.slope * height
    depth = (radius - rho) * np.cos(surface.half_angle)
    on = np.abs(depth) <= graph.tolerance
    if surface.slope:
        on &= radius >= -2 * graph.tolerance
    spans = triangle_spans(surface, angle, rho, graph.triangles)
    toward = np.einsum("td,td->t", surface.normals(graph.middles), graph.normals)
    sign = np.sign((toward * graph.areas)[inside].sum())
    typical = np.quantile(spans[inside], 0.75)
    widest = min(max(_WIDER * typical, _NARROW), _WIDEST)
    fits = free & (spans <= widest)
    sag = radius * np.cos(surface.half_angle) * (1.0 - np.cos(widest / 2))
    sunk = (depth > graph.tolerance) & (depth <= sag)
    whole = on[graph.triangles].all(axis=1)
    if sunk.any():
        near = fits & (on | sunk)[graph.triangles].all(axis=1)
        near &= sign * toward >= np.cos(TILTED)
        cut = (on | (sunk & _within_facets(graph, surface, near)))[graph.triangles].all(axis=1)
        whole |= near & cut & _chordal(graph, surface, on)[graph.facet]
    fits &= whole
    # A thin triangle of vertices on a curved surface may be tilted much, if it is no part of a
    # plane that cuts the surface.
    tilted = sign * toward < np.cos(TILTED)
    area = sign * _turning_areas(surface, angle, height, graph)
    thin = tilted & fits & (area > 1e-9 * np.abs(area).max())
    cut = np.bincount(graph.facet, tilted & ~thin) > 0
    fits &= ~tilted | (thin & ~cut[graph.facet])
    label = graph.connected(fits)
    seen = label[inside & fits]
    if not len(seen):
        return np.zeros_like(free)
    return np.asarray(label == np.bincount(seen).argmax())


def _chordal(graph: FacetGraph, surface: RoundSurface, on: Flags) -> Flags:
    """Mark facets (f,) with three of some vertices (n,), and those whose planes hold rulings."""
    middle = graph.middles[np.unique(graph.facet, return_index=True)[1]]
    along = surface.axis[None]
    if surface.apex is not None:
        along = middle - surface.apex
        along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    off = np.abs((graph.facet_normals * along).sum(axis=1)) * np.sqrt(graph.facet_areas)
    known = np.asarray(graph.facet_vertices @ on.astype(float)) >= 3
    return np.asarray(known | (off <= LOOSE * graph.tolerance))


def _within_facets(graph: FacetGraph, surface: RoundSurface, near: Flags) -> Flags:
    """Mark the vertices of some triangles (t,) at no fold, or at the end of one across rulings.

    Rulings between facets have their ends on the surface. A vertex in a facet, or where an outline
    meets an edge between facets that is no ruling, is inside the surface.
    """
    a, b = graph.points[graph.ends].transpose(1, 0, 2)
    folded = near[graph.pairs].all(axis=1) & np.not_equal(*graph.facet[graph.pairs].T)
    ends, along = graph.ends[folded], (b - a)[folded]
    cosine = np.einsum("ed,ed->e", along, surface.rulings((a + b)[folded] / 2))
    ruling = np.abs(cosine) > np.cos(TILTED) * np.linalg.norm(along, axis=1)
    # A vertex in the middle of a row of edges is at the ends of two.
    weight = np.repeat(np.where(ruling, 2, 1), 2)
    return np.asarray(np.bincount(ends.ravel(), weight, len(graph.points)) < 2)


def _turning_areas(surface: RoundSurface, angle: Array, height: Array, graph: FacetGraph) -> Array:
    """Return areas of triangles by angle and height, positive seen from outside, (t,)."""
    a, h = angle[graph.triangles], height[graph.triangles]
    turn = a - a[:, :1]
    turn -= 2 * np.pi * np.round(turn / (2 * np.pi))
    return np.asarray(turn[:, 1] * (h[:, 2] - h[:, 0]) - turn[:, 2] * (h[:, 1] - h[:, 0]))


def triangle_spans(surface: RoundSurface, angle: Array, rho: Array, triangles: Ints) -> Array:
    """Return the angles around the axis that triangles span; a corner at the apex has none."""
    turn = np.diff(angle[triangles], axis=1, append=angle[triangles[:, :1]])
    turn = np.abs(turn - 2 * np.pi * np.round(turn / (2 * np.pi)))
    far = rho > APEX * max(float(rho.max()), 1e-300)
    known = far[triangles] & far[np.roll(triangles, -1, axis=1)]
    return np.asarray(np.where(known, turn, 0.0).max(axis=1))

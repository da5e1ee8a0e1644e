"""Division of triangles at the ruling where a round surface goes over into what is beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from gso.mesh import topology
from gso.mesh.slicing import subdivided
from gso.recognition.facet_graph import FacetGraph
from gso.recognition.region_growing import Region
from gso.recognition.region_members import TILTED, members
from gso.recognition.round_surface import RoundSurface
from gso.typing import Array, Flags, Ints

#: Multiple of the tolerance within which surfaces touch along a ruling.
_NEAR = 4.0
#: Angle in radians between rulings that are not one, and cosine between normals that are.
_APART, _ALIKE = 1e-3, 1.0 - 1e-6


def divide_at_tangents(
    graph: FacetGraph, regions: list[Region]
) -> tuple[FacetGraph, Ints, list[Region]]:
    """Divide triangles that are partly on a round surface and partly on one tangent to it.

    A mesh of a bent plate need not have edges where its bend begins: triangles there have vertices
    on the bend and others on the plane, or on the next bend. They are divided at the ruling where
    both surfaces touch. The new vertices are on it; their distance from the triangles is an error
    of chords, as that of all triangles of the bend is.

    Returns
    -------
    graph : FacetGraph
    source : ndarray of int, (t,)
        Triangle of the given graph that each is, or is a part of.
    regions : list of Region
        With the parts of triangles on them.
    """
    given = len(graph.triangles)
    source = np.arange(given)
    for k in range(len(regions)):
        for tangent in list(_tangents(graph, regions, k)):
            straddling, beyond = _straddling(graph, regions, regions[k], tangent)
            if not straddling.any():
                continue
            points, triangles, old = _divided(graph, tangent, straddling, beyond)
            inside = np.r_[beyond, np.zeros(len(points) - len(beyond))][triangles].sum(axis=1) > 0
            graph, source = graph.refined(points, triangles, old), source[old]
            regions = [replace(one, member=one.member[old]) for one in regions]
            regions[k].member[straddling[old] & inside] = True
            if tangent.region is not None:
                regions[tangent.region].member[straddling[old] & ~inside] = True
    if len(source) > given:
        # The parts belong to the facets beside them, and more triangles are connected to regions.
        graph = replace(graph)
        for k, one in enumerate(regions):
            free = _free(graph, regions) | one.member
            more = members(graph, one.surface, one.member, free)
            regions[k] = replace(one, member=one.member | more)
    return graph, source, regions


@dataclass(frozen=True, eq=False)
class _Tangent:
    """A ruling of a round surface where another surface touches it.

    Attributes
    ----------
    origin, along, out, across : ndarray, (3,)
        A point of the ruling, its direction, the direction from the axis to it, and that around
        the axis.
    distances : callable
        Distances of points from the other surface.
    region : int or None
        Number of the other surface; None for a plane.
    """

    origin: Array
    along: Array
    out: Array
    across: Array
    distances: Callable[[Array], Array]
    region: int | None

    @classmethod
    def at(
        cls,
        surface: RoundSurface,
        angle: float,
        distances: Callable[[Array], Array] | None = None,
        region: int | None = None,
    ) -> _Tangent:
        """Return the ruling at an angle; the other surface is the tangent plane by default."""
        origin = surface.point(np.array([angle]), np.zeros(1))
        out = (origin[0] - surface.centre) / np.linalg.norm(origin[0] - surface.centre)
        normal, along = surface.normals(origin)[0], surface.rulings(origin)[0]

        def from_plane(points: Array) -> Array:
            return np.asarray((points - origin[0]) @ normal)

        across = np.cross(surface.axis, out)
        return cls(origin[0], along, out, across, distances or from_plane, region)


def _tangents(graph: FacetGraph, regions: list[Region], k: int) -> Iterator[_Tangent]:
    """Find the rulings where planes and other regions near a region are tangent to it."""
    surface, limit = regions[k].surface, _NEAR * graph.tolerance
    reached = np.zeros(len(graph.points), bool)
    reached[graph.triangles[regions[k].member]] = True
    own = np.flatnonzero(reached)
    free = _free(graph, regions)
    beside = free & reached[graph.triangles].any(axis=1)
    reached[graph.triangles[beside]] = True
    near = free & reached[graph.triangles].any(axis=1)
    facets, which = np.unique(graph.facet[near], return_inverse=True)
    corners = graph.points[graph.triangles[near]]
    found: list[float] = []
    for sign in (1.0, -1.0):
        angle = surface.coordinates(surface.centre + sign * graph.facet_normals[facets])[0]
        base = surface.point(angle, np.zeros(len(angle)))
        off = np.einsum("tcd,td->tc", corners - base[which, None], surface.normals(base)[which])
        far = np.zeros(len(facets))
        np.maximum.at(far, which, np.abs(off).max(axis=1))
        flat = np.flatnonzero(far <= limit)
        for one in angle[
            flat[np.argsort(-graph.facet_areas[facets[flat]], kind="stable")]
        ].tolist():
            if all(abs(np.angle(np.exp(1j * (one - two)))) > _APART for two in found):
                found.append(one)
                yield _Tangent.at(surface, one)
    height = surface.coordinates(graph.points[own])[2]
    ends = np.array([height.min(), height.max()])
    for j, other in enumerate(regions):
        if j == k or not reached[graph.triangles[other.member]].any():
            continue
        toward = float(surface.coordinates(other.surface.centre[None])[0][0])
        for one in (toward, toward + np.pi):
            line = surface.point(np.full(2, one), ends)
            alike = np.einsum("kd,kd->k", surface.normals(line), other.surface.normals(line))
            if (
                np.abs(alike).min() >= _ALIKE
                and np.abs(other.surface.distances(line)).max() <= limit
            ):
                yield _Tangent.at(surface, one, other.surface.distances, j)


def _free(graph: FacetGraph, regions: list[Region]) -> Flags:
    free = np.ones(len(graph.triangles), bool)
    for region in regions:
        free &= ~region.member
    return free


def _straddling(
    graph: FacetGraph, regions: list[Region], region: Region, tangent: _Tangent
) -> tuple[Flags, Array]:
    """Mark triangles across a ruling, of vertices on both surfaces.

    Also return how far vertices are from the ruling, positive on the side of the region and 0 on
    the ruling.
    """
    surface, limit = region.surface, _NEAR * graph.tolerance
    local = graph.points - tangent.origin
    beyond = local @ tangent.across
    beyond[np.abs(beyond) <= limit] = 0.0
    ahead = (graph.points - surface.centre) @ tangent.out > 0
    mine = np.unique(graph.triangles[region.member])
    beyond *= np.sign(beyond[mine[ahead[mine]]].sum())
    on = (beyond >= 0) & (np.abs(surface.distances(graph.points)) <= graph.tolerance)
    on |= (beyond <= 0) & (np.abs(tangent.distances(graph.points)) <= limit)
    t = graph.triangles
    found = _free(graph, regions) & (on & ahead)[t].all(axis=1)
    found &= (beyond[t].max(axis=1) > 0) & (beyond[t].min(axis=1) < 0)
    tilt = np.abs(np.einsum("td,td->t", surface.normals(graph.middles), graph.normals))
    return found & (tilt >= np.cos(TILTED)), beyond


def _divided(
    graph: FacetGraph, tangent: _Tangent, straddling: Flags, beyond: Array
) -> tuple[Array, Ints, Ints]:
    """Divide triangles where they cross a ruling: points, triangles, and what they are parts of."""
    t, n = graph.triangles[straddling], len(graph.points)
    edges = np.stack([t, np.roll(t, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = edges[beyond[edges].prod(axis=1) < 0]
    edges = edges[np.unique(topology.pair_keys(edges, n), return_index=True)[1]]
    a, b = beyond[edges].T
    p, q = graph.points[edges].transpose(1, 0, 2)
    along = (p + (a / (a - b))[:, None] * (q - p) - tangent.origin) @ tangent.along
    points = np.concatenate([graph.points, tangent.origin + along[:, None] * tangent.along])
    return points, *subdivided(graph.triangles, n, edges)

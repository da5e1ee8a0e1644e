"""Growth of cylinders and cones over a mesh, from fits to small regions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gso.geometry import box_diagonal
from gso.mesh import topology
from gso.recognition.facet_graph import SMOOTH, FacetGraph
from gso.recognition.region_members import LOOSE, members, triangle_spans
from gso.recognition.round_surface import RoundSurface, fit_quadrics, fit_round
from gso.recognition.smooth_regions import is_smooth
from gso.typing import Array, Flags, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

#: Points of a seed region, their least number for a cylinder (a cone needs one more), and seeds
#: that are fitted together.
_POINTS, _FEWEST, _TOGETHER = 48, 8, 2000
#: Share of the vertices of a long facet that are on its folds if it is a strip between rulings,
#: and tolerance relative to the size up to which such strips are tried.
_STRIP, _FINE = 0.9, 1e-6
#: Largest smooth parts that are tried as a whole.
_PARTS = 100
#: Seeds that are tried at most.
_SEEDS = 20_000
#: Seeds that failed after which only every second one is tried, then every third ...
_PATIENCE = 10
#: Seeds of a chunk whose fits are tried from the axes of quadrics, too.
_FURTHER = 100
#: Share of a seed region that its surface must hold.
_KEPT = 0.3
#: Length of a shared edge, relative to the longest of both facets.
_LONG = 0.7
#: Points that a fit to a whole region uses at most.
_ENOUGH = 3000
#: Rounds of fitting and growing.
_ROUNDS = 8
#: Share of triangles by which a cone must exceed a cylinder to be one.
_MORE = 1.02
#: Radius relative to a region's size above which it is flat.
_HUGE = 1e4


@dataclass(frozen=True)
class Region:
    """Triangles on one round surface.

    Attributes
    ----------
    surface : RoundSurface
    member : ndarray of bool, (t,)
    """

    surface: RoundSurface
    member: Flags


def round_regions(graph: FacetGraph, free: Flags) -> list[Region]:
    """Find all cylinders and cones among some triangles (t,); regions do not overlap.

    Whole smooth parts of the mesh are tried first, then the surroundings of every facet, and then
    whole parts of what is left: a fan about an apex is one only without the row around it.
    """
    free = free.copy()
    found = _whole_parts(graph, free)
    for rings in (4, 8) if graph.allowed > graph.step else (2, 1):
        found += _from_seeds(graph, free, rings)
    for rings in (2, 1):
        found += _from_seeds(graph, free, rings, along=True)
    return [*found, *_whole_parts(graph, free)] if found else found


def _whole_parts(graph: FacetGraph, free: Flags) -> list[Region]:
    """Return the smooth parts of the mesh that are cylinders or cones; `free` is updated."""
    found = []
    label = graph.connected(free, np.abs(graph.folds) <= SMOOTH)
    count = np.bincount(label[label >= 0], minlength=1)
    for part in np.argsort(-count, kind="stable")[:_PARTS]:
        if count[part] < 3:
            break
        whole = label == part
        if len(np.unique(graph.facet[whole])) < 3:
            continue
        region = _best(graph, whole, free, np.zeros(0, bool), None)
        if region is not None:
            found.append(region)
            free &= ~region.member
    return found


def round_region(graph: FacetGraph, member: Flags) -> Region | None:
    """Fit a cylinder or cone to all of some triangles (t,); None if they are on none."""
    found = _best(graph, member, member, np.zeros(0, bool), None)
    return found if found is not None and (found.member == member).all() else None


def known_region(graph: FacetGraph, member: Flags) -> Region | None:
    """Fit a cylinder or cone to facets that are known to be on one; None if they are on none.

    Vertices within its facets are inside of it, such as those of an outline that cuts them.

    Parameters
    ----------
    graph : FacetGraph
    member : ndarray of bool, (t,)
    """
    triangles = graph.triangles[member]
    facet = np.repeat(graph.facet[member], 3)
    pairs = np.unique(np.stack([triangles.ravel(), facet], axis=1), axis=0)
    every, several = np.unique(pairs[:, 0], return_counts=True)
    for conical in (False, True):
        surface = _fitted_to(graph, every[several > 1], member, None, conical)
        if surface is None:
            continue
        angle, rho, _ = surface.coordinates(graph.points)
        span = float(triangle_spans(surface, angle, rho, triangles).max())
        sag = float(rho[every].max()) * (1.0 - np.cos(0.5 * span))
        off = surface.distances(graph.points[every])
        if off.max() <= LOOSE * graph.tolerance and off.min() >= -sag - LOOSE * graph.tolerance:
            return Region(surface, member)
    return None


def _from_seeds(graph: FacetGraph, free: Flags, rings: int, *, along: bool = False) -> list[Region]:
    """Grow regions from facets and the rings around them; `free` is updated.

    Neighbours in a ring share a vertex, or, with `along`, one of the longest edges.
    """
    found = []
    table = graph.facet_vertices
    sizes = np.diff(table.indptr)
    small = sizes <= _POINTS // 2
    if graph.tolerance <= _FINE * box_diagonal(graph.points):
        # A long strip between two rulings has few vertices inside. Where coordinates are rounded,
        # several strips of any torsal surface are on a cone.
        small |= table @ graph.shared.astype(float) >= _STRIP * sizes
    neighbours = _neighbours_along if along else _neighbours
    near = neighbours(graph, free, small)
    order = np.random.default_rng(0).permutation(table.shape[0])
    open_facets = np.zeros(table.shape[0], bool)
    open_facets[graph.facet[free]] = True
    if along:
        # A single triangle has no direction.
        open_facets &= np.bincount(graph.facet) > 1
    order = order[open_facets[order] & small[order]][:_SEEDS]
    tried, failures = np.zeros(table.shape[0], bool), 0
    # Facets of a fan have the same ones around them.
    failed: set[bytes] = set()
    first = np.zeros(table.shape[0], np.int64)
    first[graph.facet[::-1]] = np.arange(len(graph.facet))[::-1]
    for start in range(0, len(order), _TOGETHER):
        chunk = order[start : start + _TOGETHER]
        chunk = chunk[free[first[chunk]]]
        if not len(chunk):
            continue
        good, around, axes = _promising(graph, near, chunk, rings)
        for place, k in enumerate(good):
            if not free[first[chunk[k]]] or tried[chunk[k]]:
                continue
            if place % max(failures // _PATIENCE, 1):
                continue
            facets = around.indices[around.indptr[k] : around.indptr[k + 1]]
            seed = free & np.isin(graph.facet, facets)
            key = np.packbits(seed).tobytes()
            region = None if key in failed else _best(graph, seed, free, tried, axes[k])
            if region is None:
                failures += 1
                failed.add(key)
                continue
            found.append(region)
            free &= ~region.member
            failed.clear()
    return found


def _neighbours(graph: FacetGraph, free: Flags, small: Flags) -> csr_matrix:
    """Which small facets that are free share a vertex and are not folded sharply."""
    table = graph.facet_vertices
    is_open = np.zeros(table.shape[0], bool)
    is_open[graph.facet[free]] = True
    keep = (small & is_open).astype(float)
    part = table.multiply(keep[:, None]).tocsr()
    near = (part @ part.T).tocoo()
    n = graph.facet_normals
    alike = np.einsum("ed,ed->e", n[near.row], n[near.col]) > np.cos(2 * SMOOTH)
    return topology.edge_graph(table.shape[0], near.row[alike], near.col[alike])


def _neighbours_along(graph: FacetGraph, free: Flags, small: Flags) -> csr_matrix:
    """Which small facets that are free share an edge about as long as their longest.

    Facets of a strip are joined across their rulings, and not with what is at their ends.
    """
    count = graph.facet_vertices.shape[0]
    f = graph.facet[graph.pairs]
    use = free[graph.pairs].all(axis=1) & small[f].all(axis=1) & (f[:, 0] != f[:, 1])
    use &= np.abs(graph.folds) <= SMOOTH
    a, b = f[use].T
    ends = graph.points[graph.ends[use]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    shared = topology.edge_graph(
        count,
        np.concatenate([a, b, np.arange(count)]),
        np.concatenate([b, a, np.arange(count)]),
        np.concatenate([length, length, np.zeros(count)]),
    )
    longest = np.maximum(np.asarray(shared.max(axis=1).todense()).ravel(), 1e-300)
    table = shared.tocoo()
    strong = table.data >= _LONG * np.maximum(longest[table.row], longest[table.col])
    strong |= table.row == table.col
    return topology.edge_graph(count, table.row[strong], table.col[strong])


def _promising(
    graph: FacetGraph, near: csr_matrix, chunk: Ints, rings: int
) -> tuple[Ints, csr_matrix, Array]:
    """Return seeds whose surroundings fit a cylinder or cone, best first.

    Also the facets around all seeds, and the axes that were found.
    """
    around = near[chunk]
    for _ in range(rings - 1):
        around = around @ near
        around.data[:] = 1.0
    around.sort_indices()
    vertices = (around @ graph.facet_vertices).tocsr()
    ids, given = _padded(_without_inner(graph, vertices))
    points = graph.points[ids]
    n = graph.facet_normals
    one = np.asarray(around.sum(axis=1)).ravel()
    mean = around @ n / np.maximum(one, 1)[:, None]
    products = (around @ (n[:, :, None] * n[:, None, :]).reshape(-1, 9)).reshape(-1, 3, 3)
    products /= np.maximum(one, 1)[:, None, None]
    spread, axes = np.linalg.eigh(products)
    _, cone_axes = np.linalg.eigh(products - mean[:, :, None] * mean[:, None, :])
    enough = (given.sum(axis=1) >= _FEWEST) & (one >= 3) & (spread[:, 1] > 1e-7)
    more = given.sum(axis=1) > _FEWEST
    worst = np.full(len(chunk), np.inf)
    ready = np.flatnonzero(enough)
    if not len(ready):
        return ready, around, np.zeros((len(chunk), 3))
    off, quadric_axes = fit_quadrics(points[ready], given[ready])
    quadric = np.zeros((len(chunk), 3))
    quadric[ready] = quadric_axes
    ready = ready[off <= graph.tolerance]
    found = np.zeros((len(chunk), 3))
    for conical, axis, most in (
        (False, axes[:, :, 0], len(chunk)),
        (True, cone_axes[:, :, 0], len(chunk)),
        (False, quadric, _FURTHER),
        (True, quadric, _FURTHER),
    ):
        left = ready[(worst[ready] > graph.tolerance) & (more[ready] | (not conical))][:most]
        if len(left):
            fits = fit_round(
                points[left], given[left], axis[left], conical=conical, goal=graph.tolerance
            )
            worst[left], found[left] = fits.worst, fits.axis
    order = np.argsort(worst, kind="stable")
    return order[worst[order] <= graph.tolerance], around, found


def _without_inner(graph: FacetGraph, table: csr_matrix) -> csr_matrix:
    """Leave out vertices of one facet only in rows (k, n) that have enough others."""
    shared = table.multiply(graph.shared).tocsr()
    few = np.asarray(shared.getnnz(axis=1)) <= _FEWEST
    return (shared + table.multiply(few[:, None])).tocsr() if few.any() else shared


def _padded(table: csr_matrix) -> tuple[Ints, Flags]:
    """Return up to _POINTS evenly chosen columns of each row of a matrix, and which are given."""
    length = np.diff(table.indptr)
    kept = np.minimum(length, _POINTS)
    step = np.arange(_POINTS)
    given = step < kept[:, None]
    place = np.where(given, step * length[:, None] // np.maximum(kept, 1)[:, None], 0)
    ids = table.indices[np.minimum(table.indptr[:-1, None] + place, len(table.indices) - 1)]
    return ids, given


def _best(
    graph: FacetGraph, seed: Flags, free: Flags, tried: Flags, axis: Array | None
) -> Region | None:
    """Grow a cylinder and a cone from a seed region, and return the better one, if any is good.

    The fits start from an axis, if one is given.

    Otherwise the facets that were reached are marked as tried.
    """
    best, most = None, 0.0
    reached = []
    for conical in (False, True):
        region = _grown(graph, seed, free, axis, conical=conical)
        if region is None:
            continue
        reached.append(region.member)
        area = float(graph.areas[region.member].sum())
        if area > _MORE * most and is_smooth(graph, region.surface, region.member, free):
            best, most = region, area
    if best is None and len(tried):
        for member in reached:
            tried[graph.facet[member]] = True
    return best


def _grown(
    graph: FacetGraph, seed: Flags, free: Flags, axis: Array | None, *, conical: bool
) -> Region | None:
    """Fit a surface and add the triangles on it, until none is added."""
    member, surface = seed, None
    for _ in range(_ROUNDS):
        surface = _fitted(graph, member, axis, conical, surface)
        if surface is None:
            return None
        axis = surface.axis
        new = members(graph, surface, member, free)
        if (new == member).all():
            break
        if (new & seed).sum() < _KEPT * seed.sum():
            return None
        member = new
    return None if surface is None or not member.any() else Region(surface, member)


def _fitted(
    graph: FacetGraph,
    member: Flags,
    axis: Array | None,
    conical: bool,
    before: RoundSurface | None,
) -> RoundSurface | None:
    """Fit a surface to the vertices of a region; None where they lie far from any.

    Vertices within facets do not count: in one facet only, or inside the surface before.
    """
    ids = np.unique(graph.triangles[member])
    if before is not None:
        ids = ids[before.distances(graph.points[ids]) >= -LOOSE * graph.tolerance]
    elif graph.shared[ids].sum() >= _FEWEST + conical:
        ids = ids[graph.shared[ids]]
    return _fitted_to(graph, ids, member, axis, conical)


def _fitted_to(
    graph: FacetGraph, ids: Ints, member: Flags, axis: Array | None, conical: bool
) -> RoundSurface | None:
    """Fit a surface to some vertices of a region; None where they are few, or far from any."""
    if len(ids) < _FEWEST + conical:
        return None
    ids = ids[np.linspace(0, len(ids) - 1, min(len(ids), _ENOUGH)).round().astype(int)]
    points = graph.points[ids]
    starts = [] if axis is None else [axis]
    if axis is None:
        n, w = graph.normals[member], graph.areas[member]
        w = w / w.sum()
        mean = w @ n
        products = np.einsum("t,ti,tj->ij", w, n, n)
        starts += list(np.linalg.eigh(products)[1].T)
        starts += list(np.linalg.eigh(products - np.outer(mean, mean))[1].T)
        starts += list(fit_quadrics(points[None], np.ones((1, len(points)), bool))[1])
    count = len(starts)
    sets = np.broadcast_to(points, (count, *points.shape))
    goal, given = LOOSE * graph.tolerance, np.ones(sets.shape[:2], bool)
    fits = fit_round(sets, given, np.stack(starts), conical=conical, goal=goal)
    best = int(np.argmin(fits.worst))
    extent = np.linalg.norm(np.ptp(points, axis=0))
    if not fits.worst[best] <= goal or fits.radius[best] > _HUGE * extent:
        return None
    return fits.surface(best)

"""Growth of cylinders and cones over a mesh, from fits to small regions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gso.geometry import box_diagonal
from gso.mesh import topology
from gso.recognition.facet_graph import FacetGraph
from gso.recognition.round_surface import RoundSurface, fit_quadrics, fit_round
from gso.typing import Array, Flags, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

#: Fold, in radians, up to which a mesh can be a smooth surface: a tube of 12 sides has 30 degrees.
SMOOTH = np.radians(30.5)
#: Angle around the axis that one triangle can span, its multiple of the upper quartile, and the
#: angle that it can always span.
_WIDEST, _WIDER, _NARROW = np.radians(62.0), 3.0, np.radians(8.0)
#: Facets around the axis from which on they are a smooth surface.
_SEVERAL = 2.5
#: Angle between the normals of a triangle and of the surface, in radians.
TILTED = np.radians(35.0)
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
#: Facets around the axis from which on a region is one whatever is beside it, and multiple of the
#: tolerance within which a point is almost on a surface.
_MANY, _ALMOST = 8.0, 20.0
#: Angle around the axis from which on cuts may be any curves, in radians.
_FAR = 3.0
#: Multiple of the tolerance by which a surface that is curved both ways would be off.
_SURE = 100.0
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
#: Share of a region's vertices that are inside of it where several rows of facets are.
_INSIDE = 0.1


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

    Whole smooth parts of the mesh are tried first, then the surroundings of every facet.
    """
    free = free.copy()
    found: list[Region] = []
    smooth = np.abs(graph.folds) <= SMOOTH
    label = graph.connected(free, smooth)
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
    for rings in (4, 8) if graph.allowed > graph.step else (2, 1):
        found += _from_seeds(graph, free, rings)
    for rings in (2, 1):
        found += _from_seeds(graph, free, rings, along=True)
    return found


def round_region(graph: FacetGraph, member: Flags) -> Region | None:
    """Fit a cylinder or cone to all of some triangles (t,); None if they are on none."""
    found = _best(graph, member, member, np.zeros(0, bool), None)
    return found if found is not None and (found.member == member).all() else None


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
        if area > _MORE * most and _is_smooth(graph, region.surface, region.member, free):
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
        ids = ids[before.distances(graph.points[ids]) >= -_LOOSE * graph.tolerance]
    elif graph.shared[ids].sum() >= _FEWEST + conical:
        ids = ids[graph.shared[ids]]
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
    goal, given = _LOOSE * graph.tolerance, np.ones(sets.shape[:2], bool)
    fits = fit_round(sets, given, np.stack(starts), conical=conical, goal=goal)
    best = int(np.argmin(fits.worst))
    extent = np.linalg.norm(np.ptp(points, axis=0))
    if not fits.worst[best] <= goal or fits.radius[best] > _HUGE * extent:
        return None
    return fits.surface(best)


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
    return np.asarray(known | (off <= _LOOSE * graph.tolerance))


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


def _covered(angle: Array, rho: Array, ids: Ints, typical: float) -> float:
    """Angle around the axis between the outermost vertices of a region; a full turn if closed."""
    around = np.sort(angle[ids[rho[ids] > _APEX * rho[ids].max()]])
    gap = float(np.diff(around, append=around[:1] + 2 * np.pi).max())
    return 2 * np.pi - gap if gap > 2 * typical else 2 * np.pi


def triangle_spans(surface: RoundSurface, angle: Array, rho: Array, triangles: Ints) -> Array:
    """Return the angles around the axis that triangles span; a corner at the apex has none."""
    turn = np.diff(angle[triangles], axis=1, append=angle[triangles[:, :1]])
    turn = np.abs(turn - 2 * np.pi * np.round(turn / (2 * np.pi)))
    far = rho > _APEX * max(float(rho.max()), 1e-300)
    known = far[triangles] & far[np.roll(triangles, -1, axis=1)]
    return np.asarray(np.where(known, turn, 0.0).max(axis=1))


def _is_smooth(graph: FacetGraph, surface: RoundSurface, member: Flags, free: Flags) -> bool:
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
    smooth = across & level & (fold <= SMOOTH) & free[graph.pairs[border]].all(axis=1)
    return bool(length[smooth].sum() <= _INSIDE * max(length[across].sum(), 1e-300))


def _open_edges(graph: FacetGraph) -> Flags:
    return np.asarray(graph.half_edges.twin < 0)


#: Slope of an edge against the plane of a circle up to which it is on a circle.
_LEVEL = 5e-3
#: Distance from the axis, relative to the largest, below which a point is the apex.
_APEX = 1e-4
#: Radius relative to a region's size above which it is flat.
_HUGE = 1e4
#: Multiple of the tolerance up to which a seed region may lie off its surface.
_LOOSE = 4.0

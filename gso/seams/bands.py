"""Divisions of a design into bands between level lines, as wide as the estimated strain allows.

On a surface of curvature K a strip of width w is strained by ``K w^2 / 16``, whatever its length,
and a round piece of the same strain is hardly wider. So strips need fewer pieces and shorter seams.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gso.mesh.separation import centres
from gso.mesh.topology import label_components
from gso.seams.disks import opening
from gso.seams.layouts import Layout, Layouts
from gso.typing import Array, Flags, Ints

#: Number of levels, and least distance of level lines, in mean edge lengths.
_LEVELS, _APART = 60, 1.0
#: Share of the area from which on a part of a level counts, and of one at an end of the levels.
_PART, _LEAF = 0.001, 0.003
#: Rounds in which smaller parts go to neighbours.
_ROUNDS = 6


def fields(layouts: Layouts) -> Iterator[Array]:
    """List functions (n,) of the vertices whose level lines may divide a design well.

    The distance from the boundary, and from one of two points far apart, and the coordinates along
    the principal axes.
    """
    mesh, paths = layouts.ground.mesh, layouts.ground.paths
    rim = np.flatnonzero(mesh.half_edges.boundary_vertex)
    points = mesh.vertices - mesh.vertices[mesh.used].mean(axis=0)
    weight = layouts.ground.potential.area
    axes = np.linalg.eigh(np.einsum("k,ki,kj->ij", weight, points, points))[1]
    for axis in axes.T:
        yield points @ axis
    if rim.size:
        yield paths.distance(rim)
    start = int(np.where(mesh.used, np.linalg.norm(points, axis=1), 0.0).argmax())
    away = paths.distance(np.array([start]))
    if np.isfinite(away[mesh.used]).all():
        far = int(np.where(mesh.used, away, 0.0).argmax())
        yield paths.distance(np.array([far]))


def banded(layouts: Layouts, field: Array, bound: Array) -> Layout | None:
    """Cut a design into bands between level lines of a function (n,), by the estimated strain.

    Bands that close around themselves are cut across; so are handles.

    Parameters
    ----------
    layouts : Layouts
    field : ndarray, (n,)
    bound : ndarray, (m,)
        Bound on the estimated strain of pieces, at each face.
    """
    mesh = layouts.ground.mesh
    corners = np.where(mesh.faces < 0, mesh.faces[:, :1], mesh.faces)
    value = field[corners].mean(axis=1)
    if not np.isfinite(value).all() or not np.ptp(value) > 0.0:
        return None
    step = max(float(np.ptp(value)) / _LEVELS, _APART * float(mesh.edge_lengths.mean()))
    level = np.floor((value - value.min()) / step).astype(np.int64)
    begun = np.zeros(len(mesh.edges), bool)
    if mesh.half_edges.boundary_vertex.any() or mesh.euler_characteristic != 2:
        one = opening(mesh)
        begun[mesh.edge_numbers(one[:, 0], one[:, 1])] = True
    begun |= layouts.kept
    thin = _cleaned(layouts, _parts(layouts, level, begun), begun)
    begun = _joined(layouts, thin, value, begun)
    thin = _cleaned(layouts, _parts(layouts, thin, begun), begun)
    return _swept(layouts, thin, value, begun, bound)


def _parts(layouts: Layouts, level: Ints, begun: Flags) -> Ints:
    """Number the connected parts (m,) of levels that are divided by cuts, too."""
    f, g = layouts.sides.T
    same = (level[f] == level[g]) & ~begun[layouts.number]
    return label_components(len(level), f[same], g[same])


def _cleaned(layouts: Layouts, thin: Ints, begun: Flags) -> Ints:
    """Give small parts to the neighbour with the longest common border."""
    area = layouts.face_area
    least = _PART * float(area.sum())
    f, g = layouts.sides[~begun[layouts.number]].T
    length = layouts.cost[layouts.number[~begun[layouts.number]]]
    for _ in range(_ROUNDS):
        small = np.bincount(thin, area) < least
        if not small.any():
            break
        count = len(small)
        a, b = np.r_[thin[f], thin[g]], np.r_[thin[g], thin[f]]
        some = (a != b) & small[a]
        if not some.any():
            break
        pair, which = np.unique(a[some] * count + b[some], return_inverse=True)
        shared = np.bincount(which, np.r_[length, length][some])
        one, two = np.divmod(pair, count)
        order = np.lexsort((two, -shared, one))
        first = order[np.unique(one[order], return_index=True)[1]]
        to = np.arange(count)
        # Of two small neighbours one goes to the other.
        size = np.bincount(thin, area, count)
        up = (size[two[first]] > size[one[first]]) | (
            (size[two[first]] == size[one[first]]) & (two[first] > one[first])
        )
        to[one[first][up]] = two[first][up]
        thin = np.unique(to[thin], return_inverse=True)[1].reshape(-1)
    return thin


def _joined(layouts: Layouts, thin: Ints, value: Array, begun: Flags) -> Flags:
    """Add paths from the ends of the levels to the boundary, or to earlier cuts."""
    ground, mesh = layouts.ground, layouts.ground.mesh
    f, g = layouts.sides.T
    across = (thin[f] != thin[g]) & ~begun[layouts.number]
    pairs = np.unique(np.sort(thin[layouts.sides[across]], axis=1), axis=0)
    count = int(thin.max()) + 1
    area = np.bincount(thin, layouts.face_area, count)
    ends = np.bincount(pairs.ravel(), minlength=count) == 1
    leaves = np.flatnonzero(ends & (area > _LEAF * area.sum()))
    middle = centres(mesh)
    reached = mesh.half_edges.boundary_vertex.copy()
    reached[mesh.edges[begun]] = True
    begun = begun.copy()
    even = np.ones(len(ground.paths.ends))
    highest = value.mean()
    for leaf in leaves[np.argsort(-area[leaves], kind="stable")].tolist():
        faces = np.flatnonzero(thin == leaf)
        if reached[mesh.faces[faces]].any():
            continue
        high = value[faces].mean() > highest
        tip = faces[(value[faces] if high else -value[faces]).argmax()]
        near = np.linalg.norm(mesh.vertices[mesh.faces[tip]] - middle[tip], axis=1)
        start = int(mesh.faces[tip][near.argmin()])
        if not reached.any():
            reached[start] = True
            continue
        line = ground.paths.cheapest(start, reached, even)
        reached[line] = True
        begun[mesh.edge_numbers(line[:-1], line[1:])] = True
    return begun


def _swept(layouts: Layouts, thin: Ints, value: Array, begun: Flags, bound: Array) -> Layout | None:
    """Join parts, from the lowest to the highest, as long as the estimate holds."""
    count = int(thin.max()) + 1
    number = np.bincount(thin, minlength=count)
    order = np.argsort(np.bincount(thin, value, count) / number, kind="stable")
    f, g = layouts.sides.T
    open_ = (thin[f] != thin[g]) & ~begun[layouts.number]
    beside: list[dict[int, float]] = [{} for _ in range(count)]
    cost = layouts.cost[layouts.number[open_]].tolist()
    for (a, b), length in zip(thin[layouts.sides[open_]].tolist(), cost, strict=True):
        beside[a][b] = beside[a].get(b, 0.0) + length
        beside[b][a] = beside[b].get(a, 0.0) + length
    group = np.arange(count)
    done = np.zeros(count, bool)
    first = np.zeros(count, np.int64)
    first[thin[::-1]] = np.arange(len(thin))[::-1]
    for part in order.tolist():
        lengths: dict[int, float] = {}
        for other, length in beside[part].items():
            if done[other]:
                lengths[int(group[other])] = lengths.get(int(group[other]), 0.0) + length
        done[part] = True
        for wanted in sorted(lengths, key=lambda one: (-lengths[one], one)):
            trial = group.copy()
            trial[part] = wanted
            new = layouts.of(layouts.between(trial[thin]) | begun)
            piece = int(new.label[first[part]])
            if layouts.estimate(new, piece) <= float(bound[new.members[piece]].mean()):
                group = trial
                break
    return layouts.of(layouts.between(group[thin]) | begun)

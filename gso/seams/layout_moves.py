"""Changes of seams that are taken where the measured pieces hold what is allowed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gso import metrics
from gso.mesh import Mesh, Paths
from gso.mesh.topology import label_components
from gso.seams.chains import chains
from gso.seams.layouts import Layout, Layouts
from gso.seams.options import NARROWEST
from gso.seams.potential import Potential
from gso.seams.regions import Regions
from gso.typing import Array, Flags, Ints

#: Ratio of estimated strain and bound up to which a changed piece is laid flat.
_LIKELY = 1.5
#: Widths over which seams are made fair, in mean edge lengths.
_WIDTHS = (6.0, 3.0, 1.5)
#: Length of a seam, relative to the root of the area, that is worth laying pieces flat again.
_WORTH = 0.004
#: How often groups of faces change together, and the number of faces that are laid flat for groups
#: that change alone, relative to those of the design.
_TOGETHER, _ALONE = 4, 5
#: Rows of faces by which a small piece grows at most.
_ROWS = 6
#: Number of faces that are laid flat at most to repair pieces, relative to those of the design.
_REPAIR = 10
#: Ratio of the estimated strain to the bound from which on a piece is divided, and how often.
_FAR, _DIVISIONS = 2.0, 20
#: Distance of both ends of a cut through a piece, relative to the length of its first part.
_APART = 2.0
#: Least distance of both ends where a small piece is joined to another, and both divided again.
_ASIDE = 0.3
#: Radius about a neck, relative to its least width, within which faces are added to it.
_WIDER = (0.6, 1.0, 1.5)


def merged(layouts: Layouts, layout: Layout) -> Layout:
    """Join neighbours across whole seams, the longest first, where the joined piece holds."""
    failed: set[tuple[bytes, bytes, bytes]] = set()
    while layouts.left > 0:
        found = None
        for name, without in _joins(layouts, layout):
            if name in failed or layouts.left <= 0:
                continue
            new = layouts.of(without)
            if layouts.better(new, layout, _LIKELY):
                found = new
                break
            failed.add(name)
        if found is None:
            break
        layout = found
    return layout


def _joins(
    layouts: Layouts, layout: Layout
) -> Iterator[tuple[tuple[bytes, bytes, bytes], Flags]]:
    """List cuts without one seam between two pieces, the longest seam first."""
    lines = []
    for (a, b), numbers in seams(layouts, layout):
        if a != b and not layouts.kept[numbers].any():
            lines.append((-float(layouts.cost[numbers].sum()), a, b, numbers))
    for _, a, b, numbers in sorted(lines, key=lambda one: one[:3]):
        out = layout.cut.copy()
        out[numbers] = False
        one, two = sorted((layout.names[a], layout.names[b]))
        yield (one, two, np.sort(numbers).tobytes()), out


def seams(layouts: Layouts, layout: Layout) -> list[tuple[tuple[int, int], Ints]]:
    """List the seams between junctions: the pieces on both sides, and the edges (k,)."""
    mesh = layouts.ground.mesh
    some = layout.cut[layouts.number]
    ends, sides = mesh.edges[layouts.number[some]], layout.label[layouts.sides[some]]
    out = []
    for pair, line in chains(ends, sides):
        out.append((pair, mesh.edge_numbers(line[:-1], line[1:])))
    return out


def fair(layouts: Layouts, layout: Layout) -> Layout:
    """Make seams shorter by diffusion, each where the pieces beside it still hold."""
    mesh = layouts.ground.mesh
    if not mesh.is_triangles or len(layout.names) < 2:
        return layout
    regions = Regions(mesh, np.empty((0, 2), np.int64))
    step = float(mesh.edge_lengths.mean())
    for width in _WIDTHS:
        if layouts.left <= 0:
            break
        wanted = _diffused(regions, layout.label, width * step)
        layout = _regrouped(layouts, layout, wanted)
    return layout


def _diffused(regions: Regions, label: Ints, width: float) -> Ints:
    """Return the region (m,) of each face after its indicator functions were diffused."""
    value = regions.fields(label, width)[regions.opened.mesh.faces].sum(axis=1)
    return np.asarray(value.argmax(axis=1))


def _regrouped(layouts: Layouts, layout: Layout, wanted: Ints) -> Layout:
    """Give faces to other pieces (m,): groups that do not hold together one after the other."""
    label, slits = layout.label.copy(), layout.cut & ~layouts.between(layout.label)
    group = _groups(layouts, label, wanted)
    left = np.arange(int(group.max(initial=-1)) + 1)
    for _ in range(_TOGETHER):
        if not left.size or layouts.left <= 0:
            break
        trial = np.where(np.isin(group, left), wanted, label)
        new = layouts.of(layouts.between(trial) | slits)
        bad = [k for k in layouts.changed(new, layout) if _worse(layouts, new, k, layout)]
        if not bad:
            if layouts.better(new, layout):
                layout, label = new, trial
                group = np.where(np.isin(group, left), -1, group)
            break
        touched = np.isin(new.label, bad)[layouts.sides].any(axis=1)
        left = np.setdiff1d(left, group[layouts.sides[touched]])
    trials = []
    for number in np.setdiff1d(group, -1).tolist():
        trial = np.where(group == number, wanted, label)
        gain = layout.length - layouts.of(layouts.between(trial) | slits).length
        if gain > _WORTH:
            trials.append((-gain, number))
    end = layouts.left - _ALONE * len(label)
    for _, number in sorted(trials):
        if layouts.left <= max(end, 0):
            break
        trial = np.where(group == number, wanted, label)
        new = layouts.of(layouts.between(trial) | slits)
        if layouts.better(new, layout, _LIKELY):
            layout, label = new, trial
    return layout


def _worse(layouts: Layouts, new: Layout, piece: int, old: Layout) -> bool:
    """Tell whether a piece has more faults than the one that it was before, or too much strain."""
    before = int(np.bincount(old.label[new.members[piece]]).argmax())
    most = max(layouts.aim, layouts.strain(old, before))
    more = layouts.part(new, piece).faults > layouts.part(old, before).faults
    return more or layouts.strain(new, piece) > most


def _groups(layouts: Layouts, label: Ints, wanted: Ints) -> Ints:
    """Number the connected groups of faces (m,) that are to change; -1 for the others."""
    changed = wanted != label
    f, g = layouts.sides[changed[layouts.sides].all(axis=1)].T
    group = label_components(len(label), f, g)
    out = np.full(len(label), -1)
    out[changed] = np.unique(group[changed], return_inverse=True)[1].reshape(-1)
    return out


def repaired(layouts: Layouts, layout: Layout) -> Layout:
    """Change seams at pieces with faults, until nothing helps any more."""
    failed: set[bytes] = set()
    end = max(layouts.left - _REPAIR * len(layout.label), 0)
    while layouts.left > end:
        found = None
        faults = [layouts.part(layout, k).faults for k in range(len(layout.names))]
        for k in sorted(range(len(faults)), key=lambda k: faults[k], reverse=True):
            name = layout.names[k]
            if layouts.left <= end or not any(faults[k]):
                break
            if name in failed:
                continue
            found = next(
                (new for new in _repairs(layouts, layout, k) if layouts.better(new, layout)), None
            )
            if found is not None:
                break
            failed.add(name)
        if found is None:
            break
        layout = found
    return layout


def divided(layouts: Layouts, layout: Layout) -> Layout:
    """Divide pieces of far too much estimated strain through the vertices that cause it."""
    mesh = layouts.ground.mesh
    for _ in range(_DIVISIONS):
        lines = []
        for k in range(len(layout.names)):
            if layouts.estimate(layout, k) > _FAR * layouts.settings.max_strain:
                lines.append(through(*layouts.mesh_of(layout, k)))
        edges = np.concatenate([np.empty((0, 2), np.int64), *lines])
        if not len(edges):
            break
        out = layout.cut.copy()
        out[mesh.edge_numbers(edges[:, 0], edges[:, 1])] = True
        layout = layouts.of(out)
    return layout


def _repairs(layouts: Layouts, layout: Layout, piece: int) -> Iterator[Layout]:
    """List changes that may help a piece with faults."""
    part = layouts.part(layout, piece)
    own = layout.label == piece
    slits = layout.cut & ~layouts.between(layout.label)
    for (a, b), numbers in seams(layouts, layout) if part.excess == 0.0 else []:
        if piece in (a, b) and a != b and not layouts.kept[numbers].any():
            out = layout.cut.copy()
            out[numbers] = False
            joined = layouts.of(out)
            yield joined
            if part.small:
                both = int(joined.label[layout.members[piece][0]])
                line = through(*layouts.mesh_of(joined, both), _ASIDE)
                if len(line):
                    out = joined.cut.copy()
                    out[layouts.ground.mesh.edge_numbers(line[:, 0], line[:, 1])] = True
                    yield layouts.of(out)

    def given(faces: Flags, to: Ints | int) -> Layout:
        label = layout.label.copy()
        label[faces] = to[faces] if isinstance(to, np.ndarray) else to
        return layouts.of(layouts.between(label) | slits)

    if part.small:
        grown = own
        for other in _neighbours(layouts, layout, piece):
            grown = own
            for _ in range(_ROWS):
                grown = _wider(layouts, grown) & (own | (layout.label == other))
                yield given(grown, piece)
    if part.excess > 0.0:
        line = through(*layouts.mesh_of(layout, piece))
        if len(line):
            out = layout.cut.copy()
            out[layouts.ground.mesh.edge_numbers(line[:, 0], line[:, 1])] = True
            yield layouts.of(out)
        for other in _neighbours(layouts, layout, piece):
            beside = layout.label == other
            row = beside
            for _ in range(2):
                row = _wider(layouts, row) & (own | beside)
                yield given(row & own, other)
    if part.narrow and part.sheet is not None:
        yield from _at_neck(layouts, layout, piece, given)


def through(mesh: Mesh, vertex: Ints, least: float = 0.0) -> Ints:
    """Choose edges (e, 2) that divide a disk through the vertex where its scale is largest.

    Parameters
    ----------
    mesh : Mesh
    vertex : ndarray of int, (n,)
        The numbers of its vertices in the design.
    least : float
        Least distance of both ends of the cut, relative to the root of the area.
    """
    rim = mesh.half_edges.boundary_vertex
    if rim.all() or len(mesh.boundary_loops) != 1:
        return np.empty((0, 2), np.int64)
    size = np.where(rim, 0.0, np.abs(Potential(mesh).solve(rim)))
    tip, paths = int(size.argmax()), Paths(mesh)
    even = np.ones(len(paths.ends))
    one = paths.cheapest(tip, rim, even)
    reach = _APART * float(paths.distance(one[:1])[one[-1]])
    reach = max(reach, least * float(np.sqrt(metrics.area(mesh))))
    closed = np.zeros(len(rim), bool)
    closed[one[1:]] = True
    far = rim & ~np.isfinite(paths.distance(one[-1:], reach)) & ~closed
    goals = far if far.any() else rim & ~closed
    two = paths.cheapest(tip, goals, even, closed)
    line = vertex[np.r_[one[::-1], two[1:]]]
    return np.stack([line[:-1], line[1:]], axis=1)


def _neighbours(layouts: Layouts, layout: Layout, piece: int) -> list[int]:
    """List the neighbours of a piece, the one with the longest seam first."""
    sides = layout.label[layouts.sides]
    some = (sides == piece).any(axis=1) & (sides[:, 0] != sides[:, 1])
    other = sides[some].sum(axis=1) - piece
    length = np.bincount(other, layouts.cost[layouts.number[some]])
    return [int(k) for k in np.argsort(-length, kind="stable") if length[k] > 0.0]


def _wider(layouts: Layouts, faces: Flags) -> Flags:
    """Add the faces (m,) that share a vertex with some."""
    mesh = layouts.ground.mesh
    touched = np.zeros(len(mesh.vertices) + 1, bool)
    touched[mesh.faces[faces]] = True
    touched[-1] = False
    return np.asarray(touched[mesh.faces].any(axis=1))


def _at_neck(layouts: Layouts, layout: Layout, piece: int, given) -> Iterator[Layout]:
    """Make a piece wider at its neck, or cut it there and give one part to a neighbour."""
    mesh, vertex = layouts.mesh_of(layout, piece)
    part = layouts.part(layout, piece)
    assert part.sheet is not None
    root = float(np.sqrt(layouts.ground.potential.area[vertex].sum()))
    least = max(NARROWEST * root, layouts.settings.min_neck or 0.0)
    _, ends = part.sheet.narrowest(1.01 * least)
    if ends is None:
        return
    paths, goal = Paths(mesh), np.zeros(len(mesh.vertices), bool)
    goal[ends[1]] = True
    own = vertex[paths.cheapest(ends[0], goal, np.ones(len(paths.ends)))]
    away = layouts.ground.paths.distance(own, 2.0 * least)
    corners = layouts.ground.mesh.faces
    centre = np.where(corners < 0, np.inf, away[corners]).min(axis=1)
    for share in _WIDER:
        yield given(centre <= share * least, piece)
    slit = layout.cut.copy()
    slit[layouts.ground.mesh.edge_numbers(own[:-1], own[1:])] = True
    divided = layouts.of(slit)
    faces = layout.members[piece]
    parts = np.unique(divided.label[faces])
    if len(parts) != 2:
        return
    sizes = [len(divided.members[k]) for k in parts]
    for k in np.argsort(sizes, kind="stable").tolist():
        some = np.zeros(len(layout.label), bool)
        some[divided.members[int(parts[k])]] = True
        for other in _neighbours(layouts, divided, int(parts[k])):
            faces = divided.members[other]
            to = int(layout.label[faces[0]])
            if to != piece:
                yield given(some, to)
    yield divided

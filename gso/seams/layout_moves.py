"""Changes of seams that are taken where the measured pieces hold what is allowed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gso.mesh.topology import label_components
from gso.seams.chains import chains
from gso.seams.layouts import Layout, Layouts
from gso.seams.regions import Regions
from gso.typing import Flags, Ints

#: Ratio of estimated strain and bound up to which a changed piece is laid flat.
_LIKELY = 1.5
#: Least length of the seam along which two pieces are joined, relative to the root of the area of
#: the smaller one: along shorter ones pieces become long and winding.
_WIDE = 0.5
#: Widths over which seams are made fair, in mean edge lengths.
_WIDTHS = (6.0, 3.0, 1.5)
#: Length of a seam, relative to the root of the area, that is worth laying pieces flat again.
_WORTH = 0.004
#: How often groups of faces change together, and the number of faces that are laid flat for groups
#: that change alone, relative to those of the design.
_TOGETHER, _ALONE = 4, 5


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


def _joins(layouts: Layouts, layout: Layout) -> Iterator[tuple[tuple[bytes, bytes, bytes], Flags]]:
    """List cuts without one seam between two pieces, the longest seam first."""
    lines = []
    root = np.sqrt(np.bincount(layout.label, layouts.face_area)) / layouts.root
    for (a, b), numbers in seams(layouts, layout):
        length = float(layouts.cost[numbers].sum())
        if a != b and not layouts.kept[numbers].any() and length > _WIDE * min(root[a], root[b]):
            lines.append((-length, a, b, numbers))
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

"""Changes of seams at pieces that hold too much strain, or are too small or narrow."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeAlias

import numpy as np

from gso import metrics
from gso.mesh import Mesh, Paths
from gso.seams.layout_moves import seams
from gso.seams.layouts import Layout, Layouts
from gso.seams.options import NARROWEST
from gso.seams.potential import Potential
from gso.typing import Flags, Ints

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

#: Gives marked faces (m,) to a piece.
_Given: TypeAlias = Callable[[Flags, int], Layout]


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
    for _ in range(_DIVISIONS):
        lines: list[Ints] = []
        for k in range(len(layout.names)):
            if layouts.estimate(layout, k) > _FAR * layouts.settings.max_strain:
                lines.append(through(*layouts.mesh_of(layout, k)))
        edges = np.concatenate([np.empty((0, 2), np.int64), *lines])
        if not len(edges):
            break
        layout = layouts.of(layout.cut | layouts.marked(edges))
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
                    yield layouts.of(joined.cut | layouts.marked(line))

    def given(faces: Flags, to: int) -> Layout:
        label = layout.label.copy()
        label[faces] = to
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
            yield layouts.of(layout.cut | layouts.marked(line))
        for other in _neighbours(layouts, layout, piece):
            beside = layout.label == other
            row = beside
            for _ in range(2):
                row = _wider(layouts, row) & (own | beside)
                yield given(row & own, other)
    if part.narrow:
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


def _at_neck(layouts: Layouts, layout: Layout, piece: int, given: _Given) -> Iterator[Layout]:
    """Make a piece wider at its neck, or cut it there and give one part to a neighbour."""
    mesh, vertex = layouts.mesh_of(layout, piece)
    sheet = layouts.part(layout, piece).sheet
    root = float(np.sqrt(layouts.ground.potential.area[vertex].sum()))
    least = max(NARROWEST * root, layouts.settings.min_neck or 0.0)
    ends = None if sheet is None else sheet.narrowest(1.01 * least)[1]
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
    slit = layouts.marked(np.stack([own[:-1], own[1:]], axis=1))
    divided = layouts.of(layout.cut | slit)
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

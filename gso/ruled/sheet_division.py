"""Strips that are longer than a sheet, divided along rulings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gso.geometry.vectors import lengths
from gso.mesh import topology
from gso.mesh.topology import pair_keys
from gso.parametrization import beside, upright
from gso.pattern import Pattern
from gso.ruled.fold_lines import Folds
from gso.ruled.ruled_surface import RuledSurface
from gso.ruled.sheet import seam_pairs
from gso.typing import Array, Flags, Ints


def divided_to_fit(surface: RuledSurface, fits: Callable[[Array], bool]) -> RuledSurface:
    """Divide the strips that do not fit a sheet along rulings, each into parts of equal length.

    A strip stays where its rulings branch or close around, and where no division fits.

    Parameters
    ----------
    surface : RuledSurface
    fits : callable
        Takes the vertices (k, 2) of a part of the pattern, and tells whether it fits.

    Returns
    -------
    RuledSurface
        The same surface with more strips, numbered in the order of those before; rulings between
        parts are creases. The same object where nothing is divided.
    """
    pattern = surface.pattern
    edges, faces = _rulings(surface)
    cell = _cells(pattern, edges)
    strip = topology.label_components(len(cell), *_neighbours(pattern))
    strip = np.unique(strip, return_inverse=True)[1]
    cut = np.zeros(len(edges), bool)
    for number in range(int(strip.max()) + 1):
        own = strip == number
        if not fits(pattern.flat[_corners(pattern, own)]):
            inside = np.flatnonzero(own[faces[:, 0]])
            cut[inside[_divided(pattern, cell, faces, edges, inside, own, fits)]] = True
    return _cut(surface, edges, faces, cut) if cut.any() else surface


def _rulings(surface: RuledSurface) -> tuple[Ints, Ints]:
    """Return the rulings as edges (r, 2) of the pattern, and the faces (r, 2) on both sides."""
    edges = surface.folded.edges
    he = surface.pattern.mesh.half_edges
    k = np.flatnonzero(he.twin >= 0)
    key = pair_keys(np.stack([he.origin[k], he.dest[k]], axis=1), len(surface.pattern.flat))
    order = np.argsort(key, kind="stable")
    at = order[np.searchsorted(key[order], pair_keys(edges, len(surface.pattern.flat)))]
    return edges, np.stack([he.face[k[at]], he.face[he.twin[k[at]]]], axis=1)


def _neighbours(pattern: Pattern) -> tuple[Ints, Ints]:
    """Return pairs of faces (e,), (e,) that share an edge of the pattern."""
    he = pattern.mesh.half_edges
    k = np.flatnonzero((he.twin >= 0) & (he.origin < he.dest))
    return he.face[k], he.face[he.twin[k]]


def _cells(pattern: Pattern, rulings: Ints) -> Ints:
    """Return the number of the polygon between rulings that each face is in."""
    he = pattern.mesh.half_edges
    k = np.flatnonzero((he.twin >= 0) & (he.origin < he.dest))
    n = len(pattern.flat)
    own = pair_keys(np.stack([he.origin[k], he.dest[k]], axis=1), n)
    k = k[~np.isin(own, pair_keys(rulings, n))]
    label = topology.label_components(len(pattern.faces), he.face[k], he.face[he.twin[k]])
    return np.asarray(np.unique(label, return_inverse=True)[1])


def _corners(pattern: Pattern, faces: Flags) -> Ints:
    ids = pattern.faces[faces]
    return np.unique(ids[ids >= 0])


def _divided(
    pattern: Pattern,
    cell: Ints,
    faces: Ints,
    edges: Ints,
    inside: Ints,
    own: Flags,
    fits: Callable[[Array], bool],
) -> Ints:
    """Return which rulings of a strip divide it, as positions in `inside`."""
    none = np.empty(0, np.int64)
    order = _in_order(cell[faces[inside]])
    if order is None:
        return none
    rulings, cells = order
    middle = pattern.flat[edges[inside[rulings]]].mean(axis=1)
    at = np.cumsum(np.r_[0.0, lengths(np.diff(middle, axis=0))])
    # The ends of the strip count, too.
    tips = ((cells[0], middle[0]), (cells[-1], middle[-1]))
    begin, end = (_reach(pattern, own & (cell == c), m) for c, m in tips)
    at, whole = at + begin, begin + at[-1] + end
    place = np.full(int(cell.max()) + 1, -1)
    place[cells] = np.arange(len(cells))
    of_face = place[cell]
    for count in range(2, len(cells) + 1):
        wanted = whole * np.arange(1, count) / count
        cut = np.unique(np.abs(at[:, None] - wanted).argmin(axis=0))
        group = np.searchsorted(cut, of_face, "left")
        parts = (_corners(pattern, own & (group == k)) for k in range(len(cut) + 1))
        if all(fits(pattern.flat[part]) for part in parts):
            return np.asarray(rulings[cut])
    return none


def _reach(pattern: Pattern, faces: Flags, point: Array) -> float:
    """Return the distance of the middle of faces' vertices from a point, doubled."""
    return 2.0 * float(lengths(pattern.flat[_corners(pattern, faces)].mean(axis=0) - point))


def _in_order(pairs: Ints) -> tuple[Ints, Ints] | None:
    """Return the rulings and the cells of a strip from end to end; None where it branches."""
    cells, ends = np.unique(pairs, return_inverse=True)
    ends = ends.reshape(-1, 2)
    degree = np.bincount(ends.ravel())
    if not len(pairs) or len(pairs) != len(cells) - 1 or degree.max() > 2:
        return None
    at: list[list[int]] = [[] for _ in cells]
    for k, (a, b) in enumerate(ends.tolist()):
        at[a].append(k)
        at[b].append(k)
    here = int((degree == 1).argmax())
    rulings: list[int] = []
    path = [here]
    while len(rulings) < len(pairs):
        k = next(k for k in at[here] if not rulings or k != rulings[-1])
        here = int(ends[k].sum()) - here
        rulings.append(k)
        path.append(here)
    return np.array(rulings), cells[path]


def _cut(surface: RuledSurface, edges: Ints, faces: Ints, cut: Flags) -> RuledSurface:
    """Cut a pattern along some rulings."""
    pattern = surface.pattern
    n = len(pattern.flat)
    he = pattern.mesh.half_edges
    k = np.flatnonzero((he.twin >= 0) & (he.origin < he.dest))
    own = pair_keys(np.stack([he.origin[k], he.dest[k]], axis=1), n)
    k = k[~np.isin(own, pair_keys(edges[cut], n))]
    label = topology.label_components(len(pattern.faces), he.face[k], he.face[he.twin[k]])
    # Strips keep their order.
    first = np.unique(label, return_index=True)[1]
    rank = np.argsort(np.lexsort((first, surface.strip[first])))
    part = rank[np.unique(label, return_inverse=True)[1]]
    row, place = np.nonzero(pattern.faces >= 0)
    old = pattern.faces[row, place]
    pairs, number = np.unique(np.stack([part[row], old], axis=1), axis=0, return_inverse=True)
    table = np.full(pattern.faces.shape, -1)
    table[row, place] = number.ravel()
    flat = pattern.flat[pairs[:, 1]]
    pieces = [upright(flat[pairs[:, 0] == p]) for p in range(int(part.max()) + 1)]
    flat = np.concatenate(beside([p[:, ::-1] * [1.0, -1.0] for p in pieces]))
    gone = np.isin(
        pair_keys(surface.rulings.edges, len(surface.mesh.vertices)),
        pair_keys(pattern.vertex[edges[cut]], len(surface.mesh.vertices)),
    )
    rulings, creases = surface.rulings, surface.creases
    return replace(
        surface,
        strip=part,
        rulings=Folds(rulings.edges[~gone], rulings.angles[~gone], rulings.radii[~gone]),
        creases=Folds(
            np.concatenate([creases.edges, rulings.edges[gone]]),
            np.concatenate([creases.angles, rulings.angles[gone]]),
            np.concatenate([creases.radii, np.zeros(int(gone.sum()))]),
        ),
        pattern=Pattern(flat, table, pattern.vertex[pairs[:, 1]], seam_pairs(surface.mesh, table)),
        untrimmed=None,
    )

"""Joining pieces along a part of their common seam; the rest of it stays open as a dart.

The number of pieces falls, the length of the seams hardly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from gso import metrics
from gso.cut_pieces import Pieces
from gso.errors import MeshError
from gso.geometry.polygon import arc_lengths
from gso.mesh import Mesh
from gso.mesh.cut import cut
from gso.mesh.topology import edge_keys, pair_keys
from gso.seams.chains import chains
from gso.seams.sheets import Sheet, flattened
from gso.seams.tree import Ground
from gso.typing import Array, Ints

#: Ratio of estimated strain and bound up to which a joined piece is laid flat to measure it.
_WORTH = 1.5
#: Smallest length of the seam along which a small piece is joined, relative to the root of its
#: area.
_SMALL = 0.6


def stitched(
    ground: Ground,
    pieces: Pieces,
    sheets: list[Sheet],
    strain: float,
    neck: float,
    accept: Callable[[Sheet], bool],
    *,
    least: float = 0.0,
    whole: bool = False,
    progress: Callable[[str], None] = lambda said: None,
) -> tuple[Ints, dict[bytes, Sheet]]:
    """Join pieces along parts of their seams as long as the joined pieces can be laid flat.

    Parameters
    ----------
    ground : Ground
    pieces : Pieces
        All of them disks.
    sheets : list of Sheet
        Their flat patterns.
    strain : float
        Bound on the largest strain.
    neck : float
        Smallest length of the part along which two pieces are joined.
    accept : callable
        Whether a joined pattern may be used, besides strain and overlaps.
    least : float
        Pieces shorter than this are joined along any seam.
    whole : bool
        Join along all of the seam between two pieces, so that no dart stays.
    progress : callable
        Called with what is being done.

    Returns
    -------
    edges : ndarray of int, (e, 2)
        The edges that are still cut.
    sheets : dict
        The patterns of the pieces, by :func:`key`.
    """
    mesh = ground.mesh
    n = len(mesh.vertices)
    kept = set(pair_keys(ground.kept, n).tolist())
    members = {k: piece.faces for k, piece in enumerate(pieces)}
    known = dict(enumerate(sheets))
    # Small pieces may be joined along seams shorter than a neck: they are not wider.
    size = {k: _wide(sheet, least) for k, sheet in known.items()}
    root = list(range(len(members)))
    every = pair_keys(pieces.edges, n).tolist()
    sides = dict(zip(every, pieces.sides.tolist(), strict=True))
    cut_keys = set(every)
    spans = chains(pieces.edges, pieces.sides)
    lengths = [arc_lengths(mesh.vertices[line]) for _, line in spans]
    for k in np.argsort([-float(s[-1]) for s in lengths], kind="stable").tolist():
        (a, b), line = spans[k]
        a, b = _root(root, a), _root(root, b)
        if a == b or lengths[k][-1] < min(neck, min(size[a], size[b])):
            continue
        keys = edge_keys(line[:-1], line[1:], n)
        if whole:
            if min(size[a], size[b]) > 0:
                continue
            pair = {a, b}
            keys = np.array(
                [e for e, two in sides.items() if {_root(root, x) for x in two} == pair]
            )
        if kept.intersection(keys.tolist()):
            continue
        progress(f"joining pieces: {len(members)} left")
        faces = np.sort(np.concatenate([members[a], members[b]]))
        shares = _parts(lengths[k], min(neck, float(lengths[k][-1])))
        for first, last in [(0, len(keys))] if whole else shares:
            trial = cut_keys.difference(keys[first:last].tolist())
            if _estimate(ground, trial, faces) > _WORTH * strain:
                continue
            sheet = _flat(mesh, trial, faces)
            if sheet is None or sheet.strain > strain or not sheet.sound or not accept(sheet):
                continue
            cut_keys = trial
            root[b] = a
            members[a], known[a] = faces, sheet
            del members[b], known[b]
            size[a] = _wide(sheet, least)
            break
    left = np.array(sorted(cut_keys), np.int64)
    edges = np.stack([left // n, left % n], axis=1)
    return edges, {key(members[k]): known[k] for k in members}


def _wide(sheet: Sheet, least: float) -> float:
    """Return the length of a seam along which a piece may be joined."""
    if sheet.size[0] < least:
        return 0.0
    return _SMALL * float(np.sqrt(metrics.area(sheet.mesh)))


def key(faces: Ints) -> bytes:
    """Return what identifies a piece by its faces."""
    return np.sort(faces).tobytes()


def _root(root: list[int], k: int) -> int:
    while root[k] != k:
        k = root[k]
    return k


def _parts(along: Array, neck: float) -> Iterator[tuple[int, int]]:
    """List the parts of a chain to join along: all of it, then shorter and shorter ones."""
    total, count = float(along[-1]), len(along) - 1
    seen = set()
    for share in (1.0, 0.5, 0.25, 0.0):
        size = max(share * total, neck)
        for place in (0.0, 0.5, 1.0):
            start = place * (total - size)
            first = int(np.searchsorted(along, start - 1e-9 * total))
            last = int(np.searchsorted(along, start + size - 1e-9 * total))
            first, last = min(first, count - 1), min(max(last, first + 1), count)
            if (first, last) not in seen:
                seen.add((first, last))
                yield first, last


def _estimate(ground: Ground, keys: set[int], faces: Ints) -> float:
    """Estimate the strain of some faces together, with cut edges."""
    n = len(ground.mesh.vertices)
    cut_edges = np.array(sorted(keys), np.int64)
    fixed = ground.mesh.half_edges.boundary_vertex.copy()
    fixed[cut_edges // n] = True
    fixed[cut_edges % n] = True
    corners = ground.mesh.faces[faces]
    ids = np.unique(corners[corners >= 0])
    scale = ground.potential.solve(fixed, ids)
    return ground.potential.strain(scale, ids)


def _flat(mesh: Mesh, keys: set[int], faces: Ints) -> Sheet | None:
    """Lay some faces flat, cut along those of the given edges that are inside; None if it fails."""
    n = len(mesh.vertices)
    corners = mesh.faces[faces]
    ids = np.unique(corners[corners >= 0])
    local = np.full(n, -1)
    local[ids] = np.arange(len(ids))
    try:
        part = Mesh(mesh.vertices[ids], np.where(corners < 0, -1, local[corners]))
    except MeshError:
        # The pieces also touch at a single vertex.
        return None
    he = part.half_edges
    k = he.interior
    ends = np.stack([he.origin[k], he.dest[k]], axis=1)
    own = edge_keys(ids[ends][:, 0], ids[ends][:, 1], n)
    opened = cut(part, ends[np.isin(own, np.array(sorted(keys), np.int64))])
    if len(opened.mesh.boundary_loops) != 1 or opened.mesh.euler_characteristic != 1:
        return None
    return flattened(opened.mesh)

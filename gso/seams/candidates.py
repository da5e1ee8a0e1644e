"""Cuts of a design by an estimate of the strain, then measured on the flat patterns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gso.cut_pieces import Piece, Pieces
from gso.executors import SERIAL, Executor
from gso.seams.cutting import cut
from gso.seams.disks import opening
from gso.seams.kinds import Edges
from gso.seams.merging import Merging
from gso.seams.options import NECK, PieceSettings
from gso.seams.sheets import Sheet, flattened
from gso.seams.shorter_seams import straightened
from gso.seams.splitting import apart, halves
from gso.seams.stitching import key, stitched
from gso.seams.tree import Ground, cut_tree
from gso.typing import Array, Ints

#: Numbers of patches to merge, and how much compact pieces are preferred.
_COUNTS = (100, 200)
_COMPACT = (1.0, 2.0, 5.0)
#: Shares of the neck that are tried, largest first.
_NECKS = (1.0, 0.8, 0.65, 0.5, 0.0)
#: Relative excess of an estimate over its bound that counts as none.
_EXCESS = 0.05
#: Most rounds of cuts through pieces that overlap or are too large.
_ROUNDS = 25

Said = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Candidate:
    """Pieces with their flat patterns, in the order of the pieces; None where there is none."""

    pieces: Pieces
    sheets: tuple[Sheet | None, ...]

    @cached_property
    def strain(self) -> float:
        """The largest strain; infinite without a pattern."""
        return max(np.inf if s is None else s.strain for s in self.sheets)

    @property
    def sound(self) -> bool:
        """Whether every piece has a pattern without overlap and inverted faces."""
        return all(s is not None and s.sound for s in self.sheets)

    def necks(self, limit: float) -> Array:
        """Return the width of each piece's narrowest place, or a limit where that is less."""
        return np.array([limit if s is None else s.neck(limit) for s in self.sheets])


def ranked(found: Candidate, settings: PieceSettings) -> tuple[int, float, float]:
    """Rank pieces by :meth:`PieceSettings.value`."""
    return settings.value(len(found.pieces), found.pieces.seam_length)


def neck_of(ground: Ground, settings: PieceSettings) -> float:
    """Return the width of necks to aim at."""
    if settings.min_neck is not None:
        return settings.min_neck
    return NECK * float(np.sqrt(ground.potential.area.sum()))


def cuts(ground: Ground, settings: PieceSettings, strain: float) -> Pieces:
    """Cut a design for a bound on the estimated strain."""
    if settings.darts:
        firm = settings.min_neck is not None
        return with_darts(ground, strain, neck_of(ground, settings), firm=firm)
    some = without_darts(ground, strain)
    return pieces_of(min(some, key=lambda one: merged_value(one, settings)))


def with_darts(ground: Ground, strain: float, neck: float, *, firm: bool) -> Pieces:
    """Cut by :func:`cut_tree`, with necks as wide as the bound on the estimated strain allows."""
    edges = ground.kept
    for share in (1.0,) if firm else _NECKS:
        edges = cut_tree(ground, strain, share * neck)
        if share == 0.0 or _largest(ground, edges) <= (1.0 + _EXCESS) * strain:
            break
    return disks(ground, edges)


def without_darts(ground: Ground, strain: float) -> list[Merging]:
    """Merge patches in several ways, without darts; see :func:`pieces_of`."""
    out = []
    for count in _COUNTS:
        label = _small(ground, strain, count)
        for compact in _COMPACT:
            out.append(Merging(ground, label, strain, compact))
            out[-1].run()
    return out


def merged_value(merging: Merging, settings: PieceSettings) -> tuple[int, float, float]:
    """Rank merged pieces by :meth:`PieceSettings.value`, before their seams are straightened."""
    length = merging.cost / float(np.sqrt(merging.ground.potential.area.sum()))
    return settings.value(int(merging.label.max()) + 1, length)


def pieces_of(merging: Merging) -> Pieces:
    """Cut between merged pieces, along straightened seams."""
    label = straightened(merging.ground, merging)
    return disks(merging.ground, merging.edges(label))


def _small(ground: Ground, strain: float, count: int) -> Ints:
    """Divide the design into patches with less strain than the bound."""
    most = max(len(ground.mesh.faces) // 4, 2)
    while True:
        label = ground.patches(min(count, most))
        edges = Merging(ground, label, strain, 1.0).edges()
        if count >= most or _largest(ground, edges) <= 0.6 * strain:
            return label
        count *= 2


def _largest(ground: Ground, edges: Ints) -> float:
    reached = ground.begun
    reached[edges] = True
    for own in np.unique(ground.mesh.components[ground.mesh.used]):
        ids = np.flatnonzero(ground.mesh.components == own)
        if not reached[ids].any():
            return np.inf
    return 0.5 * float(np.abs(ground.potential.solve(reached)).max())


def disks(ground: Ground, edges: Ints) -> Pieces:
    """Cut a design along edges, and along more of them where a piece is no disk."""
    pieces = cut(ground.mesh, Edges(edges))
    more = [
        piece.vertices[opening(piece.mesh, _factor(ground, piece))]
        for piece in pieces
        if not piece.is_disk
    ]
    if not more:
        return pieces
    return cut(ground.mesh, Edges(np.concatenate([edges, *more])))


def _factor(ground: Ground, piece: Piece) -> Array | None:
    """Return the factor on the cost of each edge of a piece."""
    return ground.factor_of(piece.vertices[piece.mesh.edges])


def _identity(piece: Piece) -> bytes:
    return piece.faces.tobytes() + piece.mesh.faces.tobytes()


def measured(
    ground: Ground,
    pieces: Pieces,
    most: tuple[float, float] | None = None,
    say: Said | None = None,
    limit: float = np.inf,
    executor: Executor = SERIAL,
) -> Candidate:
    """Lay pieces flat, and cut those that overlap themselves or are larger than a sheet.

    Parameters
    ----------
    ground : Ground
    pieces : Pieces
        All of them disks.
    most : (float, float), optional
        Length and width of a sheet.
    say : callable, optional
        Called with what is being done.
    limit : float
        Strain from which on a piece is enough to give up: the others then have no pattern.
    executor : Executor
        Lays pieces flat; the result does not depend on it.
    """
    known: dict[bytes, Sheet | None] = {}
    for _ in range(_ROUNDS):
        if executor.workers and limit == np.inf:
            todo = {_identity(p): p.mesh for p in pieces if _identity(p) not in known}
            if say is not None:
                say(f"patterns of {len(todo)} pieces")
            known |= zip(todo, executor.map(flattened, list(todo.values())), strict=True)
        sheets: list[Sheet | None] = []
        for number, piece in enumerate(pieces):
            name = _identity(piece)
            if name not in known:
                if say is not None:
                    say(f"pattern {number + 1} of {len(pieces)}")
                known[name] = flattened(piece.mesh)
            sheets.append(known[name])
            if sheets[-1] is None or sheets[-1].strain > limit:
                return Candidate(pieces, (*sheets, *[None] * (len(pieces) - len(sheets))))
        more = []
        for piece, sheet in zip(pieces, sheets, strict=True):
            if sheet is None:
                continue
            edges = np.empty((0, 2), np.int64)
            if len(sheet.overlaps):
                edges = apart(sheet, _factor(ground, piece))
            elif most is not None and len(piece.faces) > 1 and not fits(sheet, most):
                edges = halves(sheet, most, _factor(ground, piece))
            if len(edges):
                more.append(ground.mirrored(piece.vertices[edges]))
        if not more:
            break
        pieces = disks(ground, np.concatenate([pieces.edges, *more]))
    return Candidate(pieces, tuple(sheets))


def fits(sheet: Sheet, most: tuple[float, float]) -> bool:
    """Whether a pattern fits on a sheet."""
    return sheet.size[0] <= max(most) and sheet.size[1] <= min(most)


def joined(
    ground: Ground,
    found: Candidate,
    strain: float,
    neck: float,
    settings: PieceSettings,
    *,
    whole: bool = False,
) -> Candidate:
    """Join pieces along parts of their seams (:func:`gso.seams.stitching.stitched`)."""
    most = settings.max_size
    sheets = [s for s in found.sheets if s is not None]
    if len(sheets) < len(found.sheets) or len(sheets) < 2 or ground.mirror is not None:
        return found
    edges, known = stitched(
        ground,
        found.pieces,
        sheets,
        strain,
        neck,
        lambda sheet: most is None or fits(sheet, most),
        least=settings.min_size or 0.0,
        whole=whole,
        progress=settings.say,
    )
    pieces = cut(ground.mesh, Edges(edges))
    return Candidate(pieces, tuple(_renumbered(p.mesh.faces, p, known) for p in pieces))


def _renumbered(faces: Ints, piece: Piece, known: dict[bytes, Sheet]) -> Sheet:
    """Give a pattern the numbering of its piece; their faces are in the same order."""
    mesh, own = piece.mesh, known[key(piece.faces)]
    real = faces >= 0
    flat = np.empty((len(mesh.vertices), 2))
    flat[faces[real]] = own.flat[own.mesh.faces[real]]
    return Sheet(mesh, flat)

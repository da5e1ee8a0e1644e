"""Better seams of a shape that stays, by measured changes of what an estimate has chosen."""

from __future__ import annotations

import numpy as np

from gso.cut_pieces import Pieces
from gso.seams.bands import banded, fields
from gso.seams.candidates import Candidate
from gso.seams.layout_moves import fair, merged
from gso.seams.layout_repairs import divided, repaired
from gso.seams.layouts import Faults, Layout, Layouts
from gso.seams.options import PieceSettings
from gso.seams.tree import Ground
from gso.typing import Array

#: Least number of faces that a design counts as having.
_FEW = 2500
#: How often each face may be laid flat for the repairs at the end.
_LAST = 8
#: Ratio of the estimated to the measured strain of bands at first, and share of the allowed strain
#: that is aimed at where more was measured.
_RATIO, _AIM = 1.2, 0.97
#: Ratio of the length of seams up to which pieces may be better for their number of faults.
_LONGER = 1.1
#: How often bands are made narrower where they hold too much strain.
_ROUNDS = 2


def improved(ground: Ground, found: Pieces, settings: PieceSettings) -> Candidate | None:
    """Return better pieces without darts than those that were found; None if there are none.

    Parameters
    ----------
    ground : Ground
    found : Pieces
        Cut along edges of the design.
    settings : PieceSettings
    """
    mesh, often = ground.mesh, settings.effort.laid
    if ground.mirror is not None or not often:
        return None
    layouts = Layouts(ground, settings, often * max(len(mesh.faces), _FEW))
    first = layouts.of(layouts.marked(found.edges))
    # Quads become strips along rulings, for which compact pieces are better than longer ones.
    if len(first.names) < 2 or not (mesh.is_triangles or any(layouts.faults(first))):
        return None
    settings.say("measured pieces joined")
    # Bands are for smooth designs, where the estimate is right.
    sharp = layouts.faults(first)[0] > 0.0
    start = repaired(layouts, divided(layouts, first)) if sharp else first
    some = [merged(layouts, start)]
    settings.say("bands")
    bands = None if sharp else best_bands(layouts)
    if bands is not None:
        some.append(merged(layouts, repaired(layouts, bands)))
    # Longer seams are no price for a small or narrow piece fewer.
    short = min(one.length for one in some if layouts.faults(one)[0] <= layouts.faults(some[0])[0])
    some = [one for one in some if one.length <= _LONGER * short]
    best = min(some, key=lambda one: _rank(layouts, one))
    settings.say("measured seams moved")
    best = merged(layouts, fair(layouts, best))
    layouts.left = max(layouts.left, _LAST * len(mesh.faces))
    best = repaired(layouts, best)
    if _rank(layouts, best) >= _rank(layouts, first):
        return None
    return layouts.candidate(best)


def _rank(layouts: Layouts, layout: Layout) -> tuple[Faults, float, float, float, int]:
    """Rank by faults, budgets, seam and number of pieces."""
    many, long, _ = layouts.value(layout)
    return layouts.faults(layout), many, long, layout.length, len(layout.names)


def best_bands(layouts: Layouts) -> Layout | None:
    """Divide a triangle mesh into bands in several ways; return the best, measured."""
    mesh = layouts.ground.mesh
    if not mesh.is_triangles:
        return None
    bound = np.full(len(mesh.faces), _RATIO * layouts.settings.max_strain)
    found: list[tuple[float, int, Layout, Array]] = []
    for field in fields(layouts):
        one = banded(layouts, field, bound)
        if one is not None:
            found.append((one.length, len(found), one, field))
    if not found:
        return None
    _, _, best, field = min(found, key=lambda one: one[:2])
    tried = [best]
    for _ in range(_ROUNDS):
        parts = [layouts.part(best, k) for k in range(len(best.names))]
        excess = np.array([part.excess for part in parts])[best.label]
        if not (excess > 0.0).any():
            break
        # Bands that overlap become narrower, too.
        less = np.where(excess > 0.0, _AIM * np.exp(-np.minimum(excess, 0.5)), 1.0)
        bound = bound * less
        again = banded(layouts, field, bound)
        if again is None:
            break
        best = again
        tried.append(best)
    return min(tried, key=lambda one: _rank(layouts, one))

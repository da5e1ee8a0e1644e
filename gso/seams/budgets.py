"""What is asked of pieces beyond strain and distance: number, seams, sizes and necks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gso.seams.options import PieceSettings
from gso.seams.trial import Trial
from gso.typing import Ints

#: Factor on the smallest sizes and necks that pieces of a copy are to have.
_ROOM = 1.03


@dataclass(frozen=True, eq=False)
class Budgets:
    """How far a trial is from the budgets of a search.

    Attributes
    ----------
    trial : Trial
    settings : PieceSettings
    room : float
        Factor on the smallest sizes and necks, so that they hold on the design, too.
    """

    trial: Trial
    settings: PieceSettings
    room: float = _ROOM

    @cached_property
    def too_many(self) -> float:
        """Relative excess of the number of pieces and of the length of seams."""
        most, seam, pieces = self.settings.max_pieces, self.settings.seam, self.trial.pieces
        out = 0.0 if most is None else max(len(pieces) / most - 1.0, 0.0)
        return out if seam is None else out + max(pieces.seam_length / seam - 1.0, 0.0)

    @cached_property
    def short(self) -> Ints:
        """The regions of pieces that are too short."""
        least = self.settings.min_size
        if least is None:
            return np.empty(0, np.int64)
        return np.unique(self.trial.region[self.trial.lengths < self.room * least])

    @cached_property
    def narrow(self) -> float:
        """How much the necks of all pieces are too narrow together, over the smallest one."""
        least = self.settings.min_neck
        if least is None:
            return 0.0
        return float((1.0 - self.trial.necks(self.room * least) / (self.room * least)).sum())

    @property
    def missing(self) -> float:
        """What is missing in all; zero where everything holds."""
        return self.too_many + len(self.short) + self.narrow

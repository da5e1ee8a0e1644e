"""Merging of regions of a copy that hold what is allowed, and that miss a budget."""

from __future__ import annotations

import numpy as np

from gso.mesh.topology import label_components
from gso.seams.budgets import Budgets
from gso.seams.copy_search import CopySearch
from gso.seams.regions import numbered
from gso.seams.trial import Trial
from gso.typing import Ints

#: Share of the pieces that take part in a round of merges, and the largest estimate.
_SHARE, _LIKELY = 0.2, 1.5
#: Factor on the width of the diffusion where necks are too narrow, and how often it is applied.
_WIDER, _OFTEN = 1.35, 4

_Pair = tuple[int, int]


class Merges:
    """Merges of neighbours, each solved and measured; what failed is not tried again.

    Parameters
    ----------
    search : CopySearch
    best : Trial
        It holds what is allowed.
    """

    def __init__(self, search: CopySearch, best: Trial):
        self._search = search
        self._forbidden: set[tuple[bytes, bytes]] = set()
        #: All trials that held, the best last.
        self.found = [best]

    @property
    def best(self) -> Trial:
        """The best trial."""
        return self.found[-1]

    def run(self, solves: int) -> None:
        """Merge neighbours as long as all pieces hold what is allowed."""
        while solves > 0:
            pairs = self._pairs(_LIKELY)
            if not pairs:
                return
            solves = self._tried(pairs, solves)

    def meet(self, solves: int) -> None:
        """Change regions until the budgets hold, even where that is not likely to hold."""
        wider = 0
        while solves > 0:
            unmet = Budgets(self.best, self._search.settings)
            if unmet.missing <= 0.0:
                return
            if len(unmet.short):
                pairs = self._pairs(np.inf, unmet.short)
            else:
                pairs = self._pairs(np.inf)[:1] if unmet.too_many > 0.0 else []
            if pairs:
                solves = self._tried(pairs, solves)
            elif unmet.narrow > 0.0 and wider < _OFTEN:
                wider, solves = wider + 1, solves - 1
                self._widened(_WIDER**wider, min(solves, _OFTEN - wider))
            else:
                return

    def _tried(self, pairs: list[_Pair], solves: int) -> int:
        """Merge pairs, fewer of them as long as that fails; return how many solves are left."""
        search, best = self._search, self.best
        before = Budgets(best, search.settings).missing
        while pairs and solves > 0:
            solves -= 1
            said = f"{len(best.pieces)} pieces, without {len(pairs)} of them"
            search.remaining.of_copy(said, solves)
            label = self._joined(pairs)
            trial = search.measured(label, best.width, begin=best)
            if trial.holds and Budgets(trial, search.settings).missing <= before:
                self.found.append(trial)
                break
            excess = trial.of_regions()
            failed = [
                pair
                for pair in pairs
                if excess[np.bincount(trial.label[best.label == pair[0]]).argmax()] > 1.0
            ]
            failed = failed or pairs
            self._forbidden |= {_name(best.label, pair) for pair in failed}
            pairs = [pair for pair in pairs if pair not in failed]
        return solves

    def _widened(self, factor: float, left: int) -> None:
        """Make boundaries fair over a larger width, so that narrow places disappear."""
        search, best = self._search, self.best
        width = factor * search.width
        search.remaining.of_copy(f"{len(best.pieces)} pieces, wider at their necks", left)
        trial = search.measured(search.alike(search.fair(best.label, width)), width)
        missing = [Budgets(one, search.settings).missing for one in (trial, best)]
        if trial.holds and missing[0] < missing[1]:
            self.found.append(trial)

    def _joined(self, pairs: list[_Pair]) -> Ints:
        search, label = self._search, self.best.label
        a, b = np.array(pairs).T
        if search.mirror is not None:
            partner = search.mirror.partners(label)
            a, b = np.r_[a, partner[a]], np.r_[b, partner[b]]
        count = int(label.max()) + 1
        joined = label_components(count, a, b)[label]
        return search.alike(numbered(joined))

    def _pairs(self, likely: float, some: Ints | None = None) -> list[_Pair]:
        """Choose pairs of neighbours to merge, those with the least estimate first.

        If some regions are given, each pair has one of them.
        """
        search, label = self._search, self.best.label
        sides = search.neighbours(label)
        if some is not None:
            sides = sides[np.isin(sides, some).any(axis=1)]
        ranked = []
        for one, two in sides.tolist():
            if _name(label, (one, two)) in self._forbidden:
                continue
            found = search.estimate(np.flatnonzero((label == one) | (label == two)))
            if found is not None and found <= likely:
                ranked.append((found, one, two))
        used: set[int] = set()
        out: list[_Pair] = []
        for _, one, two in sorted(ranked):
            if len(out) >= max(1, round(_SHARE * (label.max() + 1))):
                break
            if not used & {one, two}:
                used |= {one, two}
                out.append((one, two))
        return out


def _name(label: Ints, pair: _Pair) -> tuple[bytes, bytes]:
    one, two = (np.packbits(label == k).tobytes() for k in pair)
    return one, two

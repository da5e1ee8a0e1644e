"""Figures of peers and of the paper that are better than the package's, for every metric."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from report.quality import Record, Records
from report.sections import GIVEN, HEADINGS, SECTIONS, Section, lower_is_better
from report.timing import Timing

#: Name of the time, which is compared in addition to the metrics of a table.
TIME = "seconds"
#: Rows that are not results, but the starting points of results.
_STARTS = ("Init",)


@dataclass(frozen=True)
class Winner:
    """A peer or a published row that is better than the package's default in a metric.

    Attributes
    ----------
    name : str
        The peer, or the row of the paper.
    theirs, ours, best : float
        Its figure, that of the default, and that of the package's best method.
    best_name : str
        That method.
    count : int
        Number of surfaces of these means; 0 for the paper, whose surfaces are others.
    but : str
        The section's main metric of both, if the winner is worse in it.
    """

    name: str
    theirs: float
    ours: float
    best: float
    best_name: str
    count: int
    but: str = ""

    def __str__(self) -> str:
        where = f"{self.count:,} surfaces" if self.count else "published"
        but = f", but {self.but}" if self.but else ""
        return f"{self.name} {self.theirs:.3g} (ours there {self.ours:.3g}, {where}{but})"


@dataclass(frozen=True)
class Loss:
    """A metric in which the package's default is not the best.

    Attributes
    ----------
    section, metric : str
        Section and metric.
    default : str
        The default's name.
    winners : list of Winner
        Peers and published rows that are better than the default.
    """

    section: str
    metric: str
    default: str
    winners: list[Winner]

    @property
    def lost(self) -> list[Winner]:
        """The winners that are better than all methods of the package."""
        return [w for w in self.winners if _better(self.metric, w.theirs, w.best)]

    def __str__(self) -> str:
        name = HEADINGS.get(self.metric, "time in seconds")
        parts = []
        if self.lost:
            parts.append("better than all of the package: " + "; ".join(map(str, self.lost)))
        rest = [w for w in self.winners if w not in self.lost]
        if rest:
            text = "; ".join(f"{w}, {w.best_name} {w.best:.3g}" for w in rest)
            parts.append(f"better than {self.default}, but not than another of ours: {text}")
        return f"{name}, {'. '.join(parts)}"


def losses(records: Records) -> list[Loss]:
    """Find all losses; first those with a winner that is better than the whole package."""
    found = [
        Loss(section.name, metric, section.default, winners)
        for section in SECTIONS
        for metric in [m for m in section.columns if m not in GIVEN] + [TIME]
        if (winners := list(_winners(section, metric, records)))
    ]
    return sorted(found, key=lambda loss: not loss.lost)


def _winners(section: Section, metric: str, records: Records) -> Iterator[Winner]:
    own = {m.name: section.of(records, m) for m in section.methods if not m.peer}
    default = own[section.default]
    # A figure, the surfaces that it is of, if they are known, and what to say against it.
    found: list[tuple[str, float, list[int] | None, str]] = [
        (f"the paper's {name}", figures[metric], None, "")
        for name, figures in section.published.items()
        if metric in figures and name not in _STARTS
    ]
    for method in (m for m in section.methods if m.peer):
        given = section.of(records, method)
        pairs = enumerate(zip(given, default, strict=False))
        where = [k for k, (a, b) in pairs if "error" not in a and "error" not in b]
        theirs = _mean(given, where, metric) if where else None
        if theirs is None:
            continue
        main, ours = (_mean(some, where, section.main) for some in (given, default))
        worse = main is not None and ours is not None and _better(section.main, ours, main)
        but = f"{HEADINGS[section.main]} {main:.3g} against {ours:.3g}" if worse else ""
        found.append((method.name, theirs, where, but))
    for name, theirs, where, but in found:
        means = {k: _mean(r, where, metric) for k, r in own.items()}
        ours = means[section.default]
        if ours is None or not _better(metric, theirs, ours):
            continue
        known = {k: v for k, v in means.items() if v is not None and k not in _STARTS}
        best = min(known, key=lambda k: known[k] if lower_is_better(metric) else -known[k])
        yield Winner(name, theirs, ours, known[best], best, len(where or ()), but)


def _better(metric: str, theirs: float, ours: float) -> bool:
    return theirs < ours if lower_is_better(metric) else theirs > ours


def _mean(records: list[Record], where: list[int] | None, metric: str) -> float | None:
    """Return the mean over some surfaces or all (of times the median).

    There is none if a figure is missing.
    """
    where = list(range(len(records))) if where is None else where
    if not records or (metric != TIME and max(where) >= len(records)):
        return None
    some = [records[k] for k in where if k < len(records) and "error" not in records[k]]
    if metric == TIME:
        spent = [r["seconds"] for r in some if r["seconds"] is not None]
        return float(np.median(spent)) if spent else None
    values = [r["figures"][metric] for r in some if metric in r["figures"]]
    return float(np.mean(values)) if values and len(values) == len(some) else None


def against_limit(timings: Sequence[Timing]) -> list[str]:
    """Compare the time of each solve, without the pattern, with that of its factorisations."""
    return [
        f"{t.task} {t.method}, {t.size} x {t.size}: {t.solve:.3g} s, "
        f"{t.solve / t.limit:.1f} times one numeric factorisation per iteration ({t.fastest})"
        for t in timings
        if t.seconds and t.limit
    ]


def unmeasured(records: Records) -> list[str]:
    """Return methods without figures, the reasons, and the sections."""
    found: dict[tuple[str, str], list[str]] = {}
    for section in SECTIONS:
        for method in section.methods:
            errors = [r.get("error", "") for r in section.of(records, method)]
            why = method.absent() or (errors[0] if errors and all(errors) else "")
            if why:
                found.setdefault((method.name, why), []).append(section.name)
    return [f"{name}: {why} ({', '.join(where)})" for (name, why), where in found.items()]

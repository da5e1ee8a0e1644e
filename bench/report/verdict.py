"""Figures of peers and of the paper that are better than the package's, for every metric."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from report.quality import Record, Records
from report.sections import GIVEN, HEADINGS, SECTIONS, Section, lower_is_better
from report.spread import Interval, of_means, of_runs
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
    spread, our_spread : tuple of float or None
        95 % intervals of the means of winner and default; of times the smallest and the largest
        median of several runs; None where they are not known.
    """

    name: str
    theirs: float
    ours: float
    best: float
    best_name: str
    count: int
    but: str = ""
    spread: Interval | None = None
    our_spread: Interval | None = None

    def __str__(self) -> str:
        where = f"{self.count:,} surfaces" if self.count else "published"
        but = f", but {self.but}" if self.but else ""
        theirs = f"{self.name} {self.theirs:.3g}{_within(self.spread)}"
        ours = f"{self.ours:.3g}{_within(self.our_spread)}"
        return f"{theirs} (ours there {ours}, {where}{but})"


def _within(spread: Interval | None) -> str:
    return f" [{spread[0]:.3g}, {spread[1]:.3g}]" if spread else ""


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
            text = "; ".join(f"{w}; {w.best_name} has {w.best:.3g}" for w in rest)
            parts.append(f"better than {self.default}: {text}")
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
        given = (
            section.of(records, next(m for m in section.methods if m.name == name)) if where else []
        )
        spreads = _interval(given, where, metric), _interval(default, where, metric)
        yield Winner(name, theirs, ours, known[best], best, len(where or ()), but, *spreads)


#: Rows of the package that stand for published ones of another name.
_OWN = {"TNO": "TNO jiang2020"}


def pairs(sections: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Compare every published row with the row of its name, and hybrid with the cold solve.

    Parameters
    ----------
    sections : dict
        The sections of ``results.json``.

    Returns
    -------
    list of dict
        Section; metric; "other", the published row or the default; "own", the row of its name or
        hybrid; the figures of both, "theirs" and "ours"; "low" and "high", the 95 % interval of
        ours, or of the difference from the default for hybrid, or None; and "better": "ours",
        "theirs", or "" where the interval contains the other figure, or no difference.
    """
    found = []
    for name, section in sections.items():
        rows = {row["name"]: row for row in section["rows"] if row["source"] != "paper"}
        metrics = [m for m in section["columns"] if m not in GIVEN] + [TIME]
        for row in (r for r in section["rows"] if r["source"] == "paper"):
            own = rows.get(row["name"], rows.get(_OWN.get(row["name"], "")))
            found += [_pair(name, m, row, own, "spread") for m in metrics if own is not None]
        cold = next((s.default for s in SECTIONS if s.name == name), "")
        if cold in rows and "hybrid" in rows and not rows["hybrid"]["absent"]:
            found += [_pair(name, m, rows[cold], rows["hybrid"], "from_default") for m in metrics]
    return [pair for pair in found if pair is not None]


def _pair(
    section: str, metric: str, other: Mapping[str, Any], own: Mapping[str, Any], kind: str
) -> dict[str, Any] | None:
    """Compare a figure of two rows; None where one of them does not have it."""
    theirs, ours = (
        row["seconds"].get("median") if metric == TIME else row["figures"].get(metric)
        for row in (other, own)
    )
    if theirs is None or ours is None:
        return None
    low, high = own.get("spread" if metric == TIME else kind, {}).get(metric) or (None, None)
    level = theirs if kind == "spread" or metric == TIME else 0.0
    # Without an interval, figures that are equal to three digits are taken for equal.
    equal = f"{ours:.3g}" == f"{theirs:.3g}" if low is None else low <= level <= high
    winner = "theirs" if _better(metric, theirs, ours) else "ours"
    who = {"section": section, "metric": metric, "own": own["name"]}
    who |= {"other": other["name"], "published": other["source"] == "paper"}
    return who | {
        "theirs": theirs,
        "ours": ours,
        "low": low,
        "high": high,
        "better": "" if equal else winner,
    }


def _interval(records: list[Record], where: list[int] | None, metric: str) -> Interval | None:
    """Return the spread of a mean over some surfaces or all, or of the times of several runs."""
    where = list(range(len(records))) if where is None else where
    some = [records[k] for k in where if k < len(records) and "error" not in records[k]]
    if metric == TIME:
        timed = [r for r in some if r["seconds"] is not None]
        return of_runs([[r["seconds"], *r.get("again", ())] for r in timed])
    values = [[r["figures"][metric]] for r in some if metric in r["figures"]]
    return of_means(np.array(values))[0] if values else None


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

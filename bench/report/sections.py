"""The tables: published rows first, then the package's methods, then its peers."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gso.dataset import LEVELS
from gso.metrics import INFO
from report.method import Method
from report.methods import DEFAULT, methods
from report.peers_developable import SAME_ENERGY
from report.published import TABLE_1, TABLE_2, TABLE_3
from report.quality import Record, Records
from report.spread import Interval, of_means, of_runs

#: Headings of columns, and formats of their numbers.
HEADINGS = {
    "loss_gc": "loss_gc, published",
    "loss_gc_worst": "loss_gc, worse split",
    "loss_gc_half": "every 2nd vertex",
    "K_A_r": "K_A-r, published",
    "K_A_r_worst": "K_A-r, worse split",
    "d_H": "d_H %",
    "distance_mean": "true distance %",
    "fairness_ratio": "fairness out/in",
    "loss_iso_cell": "loss_iso-cell",
    "strain_mean": "strain",
    **{name: name.replace("_", " ") for name in ("strain_p99", "flipped_cells")},
    "edge_length_error": "edge error",
    "unflipped": "without flips",
    "theta_noisy": "theta noisy °",
    "theta": "theta °",
    "rate": "rate %",
    "off": "off the clean %",
    "objective_ratio": "objective out/in",
}
#: Columns that describe the input.
GIVEN = ("theta_noisy",)
#: Whether lower is better, for metrics that are not in :data:`gso.metrics.INFO`.
_LOWER = {"unflipped": False, "rate": False, "off": True, "objective_ratio": True, "seconds": True}


@dataclass
class Row:
    """A row of a table.

    Attributes
    ----------
    name : str
        The method.
    source : {"paper", "package", "peer"}
        Origin of the figures.
    count : int
        Number of surfaces; 0 where the paper does not give it.
    figures : dict of str to float
        Means by metric.
    seconds : dict of str to float
        Median, 10th and 90th percentile, and the number of timed surfaces.
    seconds_numpy : dict of str to float
        The same of the solves with NumPy kernels; empty where these change nothing.
    spread : dict of str to (float, float)
        95 % intervals of the means over the surfaces, by bootstrap; under "seconds" the smallest
        and the largest median of several runs.
    from_default : dict of str to (float, float)
        The same intervals of the difference from the section's default, surface by surface.
    iterations : float or None
        Mean number of iterations.
    note : str
        Note for the reader.
    absent : str
        Why there are no figures, or "".
    """

    name: str
    source: str
    count: int = 0
    figures: dict[str, float] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    seconds_numpy: dict[str, float] = field(default_factory=dict)
    spread: dict[str, Interval] = field(default_factory=dict)
    from_default: dict[str, Interval] = field(default_factory=dict)
    iterations: float | None = None
    note: str = ""
    absent: str = ""


@dataclass(frozen=True)
class Section:
    """A table of the report.

    Attributes
    ----------
    name, title : str
        Key and heading.
    task, sigma : str, float
        Task and level of the noise.
    columns : tuple of str
        Metrics.
    published : dict
        The paper's rows.
    only : tuple of str
        Names of its methods; empty for all methods of the task that are in no other section.
    """

    name: str
    title: str
    task: str
    columns: tuple[str, ...]
    published: dict[str, dict[str, float]] = field(default_factory=dict)
    sigma: float = 0.0
    only: tuple[str, ...] = ()

    @property
    def default(self) -> str:
        """The method that the others are compared with."""
        return self.only[0] if self.only else DEFAULT[self.task]

    @property
    def main(self) -> str:
        """The main metric of the task; ``loss_gc_worst`` in place of ``loss_gc``.

        The latter sees one triangulation only, so that a method can lower it by crumpling.
        """
        first = next(m for m in self.columns if m not in GIVEN)
        return "loss_gc_worst" if first == "loss_gc" else first

    @property
    def methods(self) -> list[Method]:
        """The methods that have rows in it."""
        every = [m for m in methods().values() if m.task == self.task]
        if self.only:
            return [m for m in every if m.name in self.only]
        return [m for m in every if m.name not in SAME_ENERGY]

    def of(self, records: Records, method: Method) -> list[Record]:
        """Return the records of a method."""
        return records.get((self.task, self.sigma, method.name), [])


#: The published metrics use one triangulation of the quads, the others both.
_PUBLISHED = ("loss_gc", "loss_gc_worst", "loss_gc_half", "K_A_r", "K_A_r_worst", "d_H")
_SAME = ("objective_ratio", *_PUBLISHED, "fairness_ratio")
_SURFACES = (*_PUBLISHED, "fairness_ratio", "distance_mean")
_FLAT = ("loss_iso_cell", "strain_mean", "strain_p99", "edge_length_error", "flipped_cells")


def _denoised(sigma: float) -> Section:
    name, title = f"denoise-{sigma:.3f}", f"Table 3: denoised surfaces, sigma {sigma:.3f}"
    columns = (*GIVEN, "theta", "rate", "off")
    return Section(name, title, "denoise", columns, {"Net": TABLE_3[sigma]}, sigma)


SECTIONS = (
    Section("developable", "Table 1: developable surfaces", "developable", _SURFACES, TABLE_1),
    Section("energy", "The same objective, other solvers", "developable", _SAME, only=SAME_ENERGY),
    Section("flatten", "Table 2: flat images", "flatten", (*_FLAT, "unflipped"), TABLE_2),
    *map(_denoised, LEVELS),
)


def lower_is_better(metric: str) -> bool:
    """Return whether lower values of a metric are better."""
    return _LOWER[metric] if metric in _LOWER else INFO[metric].lower_is_better


def rows(section: Section, records: Records) -> list[Row]:
    """Return the rows of a section.

    Where a method has fewer surfaces than the default, an additional row has the default's
    figures on the same surfaces.
    """
    found = []
    for name, figures in section.published.items():
        own = {k: v for k, v in figures.items() if k != "seconds"}
        seconds = {"median": figures["seconds"]} if "seconds" in figures else {}
        found.append(Row(name, "paper", figures=own, seconds=seconds))
    given = {method.name: section.of(records, method) for method in section.methods}
    default = next(m for m in section.methods if m.name == section.default)
    whole = given[default.name]
    for method in section.methods:
        row = _row(method, given[method.name])
        if row.source == "package" and method is not default:
            row.from_default = _differences(given[method.name], whole)
        found.append(row)
    for count in sorted({n for n in map(len, given.values()) if 0 < n < len(whole)}, reverse=True):
        name, note = f"{default.name}, first {count}", "to compare with rows of as many"
        found.append(replace(_row(default, whole[:count]), name=name, note=note))
    return found


def _row(method: Method, given: list[Record]) -> Row:
    good = [record for record in given if "error" not in record]
    row = Row(method.name, "peer" if method.peer else "package", len(good), note=method.note)
    if not good:
        row.absent = f"failed: {given[0]['error']}" if given else method.absent()
        return row
    row.figures = {k: float(np.mean([r["figures"][k] for r in good])) for k in good[0]["figures"]}
    row.seconds = _spread([r["seconds"] for r in good])
    row.spread = _intervals([r["figures"] for r in good])
    timed = [r for r in good if r["seconds"] is not None]
    runs = of_runs([[r["seconds"], *r.get("again", ())] for r in timed])
    row.spread |= {"seconds": runs} if runs else {}
    row.seconds_numpy = _spread([r.get("seconds_numpy") for r in good])
    if good[0]["iterations"] is not None:
        row.iterations = float(np.mean([r["iterations"] for r in good]))
    if "warm" in row.figures:
        row.note += f"; the net's start was used on {row.figures['warm']:.0%}"
    if len(good) < len(given):
        errors = next(r["error"] for r in given if "error" in r)
        row.note = f"{row.note}; failed on {len(given) - len(good)}: {errors}".strip("; ")
    return row


def _intervals(figures: list[dict[str, float]]) -> dict[str, Interval]:
    """Return the interval of the mean of each figure."""
    names = list(figures[0])
    values = np.array([[found[name] for name in names] for found in figures])
    return dict(zip(names, of_means(values), strict=True))


def _differences(given: list[Record], default: list[Record]) -> dict[str, Interval]:
    """Return the intervals of the mean differences from the default on the same surfaces."""
    both = [
        (a["figures"], b["figures"])
        for a, b in zip(given, default, strict=False)
        if "error" not in a and "error" not in b
    ]
    if not both:
        return {}
    shared = both[0][0].keys() & both[0][1].keys()
    return _intervals([{k: a[k] - b[k] for k in sorted(shared)} for a, b in both])


def _spread(seconds: list[float | None]) -> dict[str, Any]:
    """Return the median, 10th and 90th percentile and number of times; {} for no times."""
    known = [s for s in seconds if s is not None]
    if not known:
        return {}
    low, middle, high = np.percentile(known, (10, 50, 90))
    return {"median": float(middle), "p10": float(low), "p90": float(high), "count": len(known)}

"""The tables: published rows first, then the package's methods, then its peers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gso.dataset.noise import LEVELS
from gso.metrics import INFO
from report.method import Method
from report.methods import DEFAULT, methods
from report.peers_developable import SAME_ENERGY
from report.published import TABLE_1, TABLE_2, TABLE_3
from report.quality import Record, Records

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
    "strain_p99": "strain p99",
    "edge_length_error": "edge error",
    "flipped_cells": "flipped cells",
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
_LOWER = {"unflipped": False, "rate": False, "off": True, "objective_ratio": True}


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
    default : str
        The method that the others are compared with.
    """

    name: str
    title: str
    task: str
    columns: tuple[str, ...]
    published: dict[str, dict[str, float]]
    sigma: float = 0.0
    only: tuple[str, ...] = ()
    default: str = ""

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
_DEVELOPABLE = (
    "loss_gc",
    "loss_gc_worst",
    "loss_gc_half",
    "K_A_r",
    "K_A_r_worst",
    "d_H",
    "fairness_ratio",
)

SECTIONS = (
    Section(
        "developable",
        "Table 1: developable surfaces",
        "developable",
        (*_DEVELOPABLE, "distance_mean"),
        TABLE_1,
        default=DEFAULT["developable"],
    ),
    Section(
        "energy",
        "The same objective, other solvers",
        "developable",
        ("objective_ratio", *_DEVELOPABLE),
        {},
        only=SAME_ENERGY,
        default=SAME_ENERGY[0],
    ),
    Section(
        "flatten",
        "Table 2: flat images",
        "flatten",
        (
            "loss_iso_cell",
            "strain_mean",
            "strain_p99",
            "edge_length_error",
            "flipped_cells",
            "unflipped",
        ),
        TABLE_2,
        default=DEFAULT["flatten"],
    ),
    *(
        Section(
            f"denoise-{level:.3f}",
            f"Table 3: denoised surfaces, sigma {level:.3f}",
            "denoise",
            ("theta_noisy", "theta", "rate", "off"),
            {"Net": TABLE_3[level]},
            sigma=level,
            default=DEFAULT["denoise"],
        )
        for level in LEVELS
    ),
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
    counts = []
    for method in section.methods:
        given = section.of(records, method)
        found.append(_row(section, method, given))
        counts.append(len(given))
    default = next(m for m in section.methods if m.name == section.default)
    whole = section.of(records, default)
    for count in sorted({n for n in counts if 0 < n < len(whole)}, reverse=True):
        row = _row(section, default, whole[:count])
        row.name, row.note = f"{default.name}, first {count}", "to compare with rows of as many"
        found.append(row)
    return found


def _row(section: Section, method: Method, given: list[Record]) -> Row:
    row = Row(method.name, "peer" if method.peer else "package", note=method.note)
    row.absent = method.absent()
    good = [record for record in given if "error" not in record]
    if given and not good:
        row.absent = f"failed: {given[0]['error']}"
    if not good:
        return row
    row.count = len(good)
    names = good[0]["figures"]
    row.figures = {k: float(np.mean([r["figures"][k] for r in good])) for k in names}
    row.seconds = spread([r["seconds"] for r in good if r["seconds"] is not None])
    again = [r.get("seconds_numpy") for r in good]
    row.seconds_numpy = spread([s for s in again if s is not None])
    if good[0]["iterations"] is not None:
        row.iterations = float(np.mean([r["iterations"] for r in good]))
    if "warm" in names:
        row.note += f"; the net's start was used on {row.figures['warm']:.0%}"
    if len(good) < len(given):
        errors = next(r["error"] for r in given if "error" in r)
        row.note = f"{row.note}; failed on {len(given) - len(good)}: {errors}".strip("; ")
    return row


def spread(seconds: list[float]) -> dict[str, Any]:
    """Return the median, 10th and 90th percentile and number of times; {} for no times."""
    if not seconds:
        return {}
    low, middle, high = np.percentile(seconds, (10, 50, 90))
    return {"median": float(middle), "p10": float(low), "p90": float(high), "count": len(seconds)}

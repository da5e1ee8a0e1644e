"""The text that ``gso dataset info`` prints."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from gso.cli import report
from gso.dataset.summary import INTERVALS, PUBLISHED, PUBLISHED_FLAT
from gso.typing import Json

if TYPE_CHECKING:
    from gso.dataset import Dataset

_MAIN = ("train", "validation", "test", "hard")
_SIGNS = {"K_A": "K_A, mean |K|", "K_P": "K_P", "K_N": "|K_N|", "sigma2": "sigma^2, boundary"}
#: Length of the longest bar, in characters.
_BAR = 30


def lines(data: Dataset, summary: Json, split: str | None = None) -> list[str]:
    """Format the statistics of a dataset, with label metrics of `split` (default: test)."""
    out = [_head(data), "", *_splits(summary)]
    for name in INTERVALS:
        out += ["", *_intervals(name, summary)]
    split = data[split].name if split else "test"
    labels = summary[split]["labels"] if split in summary else {}
    if labels:
        out += ["", f"Labels of {split}, means; published: the numerical optimiser of Wang et al."]
        out += _labels(labels)
    return out


def _head(data: Dataset) -> str:
    if not data.manifest:
        return f"{data.path}: a folder of .npy files"
    recipe = data.manifest["recipe"]
    return (
        f"{data.path}: {recipe['n']} surfaces {recipe['size']} x {recipe['size']} of seed "
        f"{recipe['seed']}, out of {data.manifest['drawn']} draws; recipe {recipe['version']}"
    )


def _splits(summary: Json) -> list[str]:
    rows = [("split", "surfaces", "loss_gc", "median", "sigma^2", "failed")]
    for name, found in summary.items():
        failed = sum(ends.get("FAILED", 0) for ends in found["status"].values())
        k, s = found["features"]["K_A"], found["features"]["sigma2"]
        numbers = (_short(k["mean"]), _short(k["median"]), _short(s["mean"]))
        rows.append((name, str(found["count"]), *numbers, str(failed)))
    main = [summary[n] for n in ("train", "validation", "test") if n in summary]
    count = sum(found["count"] for found in main)
    if count:
        total = sum(f["count"] * (f["features"]["K_A"]["mean"] or 0.0) for f in main)
        rows.append(("all but hard and named", str(count), _short(total / count), "", "", ""))
    return report.columns(rows)


def _intervals(name: str, summary: Json) -> list[str]:
    """Format counts per interval by split, and a bar for train, validation and test together."""
    groups = {n: s["intervals"][name] for n, s in summary.items() if n in _MAIN}
    others = [s["intervals"][name] for n, s in summary.items() if n not in _MAIN]
    if others:
        groups["named" if groups else "all"] = np.sum(others, axis=0).tolist()
    main = np.sum([c for n, c in groups.items() if n in _MAIN[:3]] or list(groups.values()), axis=0)
    longest = max(main.max(), 1)
    rows = [(_SIGNS[name], *groups, "")]
    edges = INTERVALS[name]
    for k, (low, high) in enumerate(pairwise(edges)):
        span = f"{low:.3g} to {high:.3g}" if np.isfinite(high) else f"over {low:.3g}"
        cells = [str(c[k]) for c in groups.values()]
        rows.append((span, *cells, "#" * round(_BAR * main[k] / longest)))
    return report.columns(rows)


def _labels(labels: Json) -> list[str]:
    out = []
    for kind, metrics in labels.items():
        published = PUBLISHED | (PUBLISHED_FLAT if "loss_gc" not in metrics else {})
        rows = [(kind, "mean", "median", "published", "")]
        for name, found in metrics.items():
            known = published.get(name)
            beside = "" if known is None else _short(known)
            mean, median = _short(found["mean"]), _short(found["median"])
            rows.append((f"  {name}", mean, median, beside, report.unit(name)))
        out += report.columns(rows)
    return out


def _short(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"

"""Statistics of a dataset: surfaces per interval of each feature, metrics of the labels."""

from __future__ import annotations

import numpy as np

from gso.dataset.screen import CURVATURE, CURVED, SHAPE
from gso.dataset.store import Dataset, Split
from gso.typing import Array, Json

#: Intervals of the features; K_N is counted by its absolute value. Those of K_A and sigma^2
#: start with the intervals of :mod:`gso.dataset.screen`; the rest is for hard and named splits.
INTERVALS: dict[str, tuple[float, ...]] = {
    "K_A": (*CURVATURE, 1.5, CURVED, np.inf),
    "K_P": (0.0, 0.01, 0.03, 0.06, 0.1, 0.2, 0.3, 0.9, np.inf),
    "K_N": (0.0, 0.03, 0.06, 0.12, 0.2, 0.3, 0.45, 0.9, np.inf),
    "sigma2": (*SHAPE, 1.0, np.inf),
}

#: Values of the numerical optimiser in Tables 1 and 2 of Wang et al. 2024, by metric: for
#: surfaces and for flat images.
PUBLISHED = {"loss_gc_before": 0.307, "loss_gc": 0.0283, "K_A_r": 0.8888, "d_H": 0.823}
PUBLISHED_FLAT = {"loss_iso_cell": 3.30e-4}


def summarise(data: Dataset) -> Json:
    """Compute statistics of every split as plain numbers, for a manifest.

    Returns
    -------
    dict
        By split: ``count``; ``features`` and ``labels`` by name, each with mean, median and
        90th percentile; ``intervals`` with the counts of :data:`INTERVALS`; ``status`` with
        the number of solves per status, by kind of label.
    """
    return {name: _split(split) for name, split in data.items()}


def _split(split: Split) -> Json:
    found = split.features if len(split) else {name: np.empty(0) for name in INTERVALS}
    statuses = {
        name.removeprefix("status/"): dict(
            zip(*(a.tolist() for a in np.unique(array[:].astype(str), return_counts=True)))
        )
        for name, array in split.arrays.items()
        if name.startswith("status/")
    }
    return {
        "count": len(split),
        "features": {name: _statistics(values) for name, values in found.items()},
        "intervals": {name: counts(name, found[name]) for name in INTERVALS},
        "labels": {
            kind: {name: _statistics(values) for name, values in table.items()}
            for kind, table in split.metrics.items()
        },
        "status": statuses,
    }


def counts(feature: str, values: Array) -> list[int]:
    """Count the surfaces in each interval of a feature; an interval contains its upper end.

    >>> counts("sigma2", np.array([0.0, 0.03, 0.04, 2.0]))
    [2, 1, 0, 0, 0, 0, 0, 1]
    """
    edges = INTERVALS[feature]
    place = np.searchsorted(edges[1:-1], np.abs(values))
    counted: list[int] = np.bincount(place, minlength=len(edges) - 1).tolist()
    return counted


def _statistics(values: Array) -> dict[str, float | None]:
    """Compute mean, median and 90th percentile of the finite values."""
    known = values[np.isfinite(values)]
    if not known.size:
        return {"mean": None, "median": None, "p90": None}
    return {
        "mean": float(known.mean()),
        "median": float(np.median(known)),
        "p90": float(np.percentile(known, 90)),
    }

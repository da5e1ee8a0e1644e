"""Exactly ruled surfaces: one strip and several, on the reference surfaces and the panel.

Distances are the larger of both directions, all over both surfaces, percent of the diagonal. The
solver minimises distances of about a thousand points. Folds are the largest angles between two
faces, in degrees: neither distance nor strain sees a surface that is crumpled.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from harness import ROOT, progress, reference, table

import gso
from gso import metrics
from gso.dataset import bezier

STRIPS = (1, 2, 4, 8)
#: Curvature up to which surfaces of another seed are used.
_MOST = 0.9


def strips(seed: str = "", start: str = "design", count: int = 24) -> dict[str, Any]:
    """Measure numbers of strips; with a seed on other surfaces of the same recipe."""
    surfaces = _others(int(seed), count) if seed else _references()
    out = {}
    rows = []
    for number in STRIPS:
        options = gso.RuledOptions(strips=number, starts=tuple(start.split("+")))
        found = [_measured(s, options) for s in progress(surfaces, f"{number} strips")]
        every = {k: np.array([f[k] for f in found]) for k in found[0]}
        out[str(number)] = {k: v.tolist() for k, v in every.items()}
        far, fold = every["max"], every["fold"]
        rows.append(
            [
                number,
                np.median(every["mean"]),
                np.median(far),
                np.quantile(far, 0.9),
                far.max(),
                int((every["crossed"] > 0).sum()),
                np.median(fold),
                np.quantile(fold, 0.9),
                int(every["usable"].sum()),
                np.median(every["s"]),
            ]
        )
    columns = [
        "strips",
        "mean %",
        "max %",
        "90 %",
        "worst",
        "crossed",
        "fold",
        "90 %",
        "usable",
        "s",
    ]
    table(f"{len(surfaces)} surfaces, starts {start}", columns, rows)
    return out


def _references() -> list[Any]:
    return [*reference()[0], gso.load(ROOT / "examples" / "panel.obj")]


def _others(seed: int, count: int) -> list[Any]:
    every = (shape.sample() for shape in bezier.generate(4 * count, seed=seed))
    return [points for points in every if metrics.loss_gc(points) <= _MOST][:count]


def _measured(surface: Any, options: gso.RuledOptions) -> dict[str, float]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gso.ConvergenceWarning)
        result = gso.tno.optimize(surface, options=options)
    found = result.metrics
    return {
        "mean": found["distance_mean"],
        "max": found["distance_max"],
        "crossed": found["rulings_crossed"],
        "fold": found["fold_max"],
        "usable": float(result.usable),
        "s": result.seconds["strips"],
    }


SECTIONS = (strips,)

"""Nets on families of surfaces that none was trained on.

These are the families of validation and of the test of the broad set (:mod:`gso.dataset.broad`),
the named shapes of the data set, and noise. The trivial method beside the nets is the optimiser
with its default preset.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from harness import progress, quietly, tabulate

import gso
from gso import metrics, net
from gso.dataset import broad, shapes
from gso.dataset.bezier import normalise
from gso.typing import Array

#: Standard deviation of the noise over the distance of rows, of a flat sheet and of a cylinder.
NOISE = 0.02


def surfaces(n: int, seed: int) -> dict[str, Array]:
    """Return n grids (n, 64, 64, 3), or all there are, of each family; seed 0 is no training's."""
    out = {}
    for split in ("validation", "test"):
        names = broad.families(split)
        for k, name in enumerate(names):
            numbers = range(k, k + n * len(names), len(names))
            out[name] = np.stack([broad.draw(split, i, seed=seed) for i in numbers])
    out |= {name: shapes.sample(name, seed=seed)[:n] for name in shapes.NAMES}
    rng = np.random.default_rng(seed)
    s, t = np.meshgrid(*(np.linspace(-1.0, 1.0, 64),) * 2, indexing="ij")
    bent = np.stack([np.sin(1.2 * s) / 1.2, t, np.cos(1.2 * s) / 1.2], axis=-1)
    flat = np.stack([s, t, 0.0 * s], axis=-1)
    out["cylinder"] = normalise(bent)[None]
    step = NOISE * 2.0 / 63
    noisy = [(flat, bent)[k % 2] + step * rng.standard_normal(flat.shape) for k in range(min(n, 8))]
    out["noise"] = np.stack([normalise(grid) for grid in noisy])
    return out


def gone(models: str = "developable,net-cf", n: int = 24, seed: int = 9) -> dict[str, Any]:
    """Print the share of the curvature that is gone, and the distance, by family.

    The share is that of the worse split of the quads, which nets cannot lower by crumpling cells;
    "worse" is the number of results with more curvature than their input.
    """
    methods = {name: partial(_of_net, name) for name in models.split(",")} | {"balanced": _solved}
    rows: dict[str, dict[str, float]] = {}
    for family, grids in surfaces(n, seed).items():
        row = rows[family] = {"surfaces": len(grids), "K": _mean(metrics.loss_gc_worst, grids)}
        for name, method in methods.items():
            found = [method(grid) for grid in progress(grids, f"{family} {name}")]
            left = np.array(
                [
                    metrics.loss_gc_worst(b, scale=1.0) / metrics.loss_gc_worst(a, scale=1.0)
                    for a, b in zip(grids, found, strict=True)
                ]
            )
            row[f"{name} gone"] = float(np.median(1.0 - left))
            row[f"{name} 1 in 10"] = float(np.quantile(1.0 - left, 0.1))
            row[f"{name} worse"] = int((left > 1.0 + 1e-9).sum())
            row[f"{name} d_H"] = float(
                np.mean([metrics.d_H(a, b) for a, b in zip(grids, found, strict=True)])
            )
    return tabulate(f"Share of |K| gone, {n} surfaces of seed {seed} each", ["family"], rows)


def _of_net(name: str, grid: Array) -> Array:
    found: Array = net.predict(grid, model=name)
    return found


def _solved(grid: Array) -> Array:
    result = quietly(gso.tno.optimize, grid, verdict=False)
    return np.asarray(result.mesh.grid)


def _mean(metric: Any, grids: Array) -> float:
    return float(np.mean([metric(grid, scale=1.0) for grid in grids]))


SECTIONS = (gone,)

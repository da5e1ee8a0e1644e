"""Criterion for whether a net's warm start saves more time than it costs, at the same quality."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np

from gso.hybrid.plain_solve import large_grid, plain_options
from gso.mesh import Mesh
from gso.net.catalogue import NetLike, exported, in_turn
from gso.typing import Array, Json, Keywords

#: Measurements, which ``python bench/run_all.py --only hybrid.model`` makes anew.
FILE = Path(__file__).with_name("measured.json")
#: Largest energy and strain, relative to a cold solve, of nine in ten surfaces, and largest share
#: of its time, for which a net is used.
_ENERGY, _STRAIN, _TIME = 1.005, 1.05, 0.95
#: Preset whose measurements hold for a kind of unknowns.
_PRESETS = {"normal": "balanced", "free": "accurate"}


def net_saves_time(
    design: Mesh,
    task: str,
    keywords: Keywords,
    *,
    net: NetLike | None = None,
    many: bool = False,
) -> bool:
    """Return whether a net is expected to save time, at the same quality.

    It was measured for developable solves of grids by curvature, with the task's own net. For other
    solves, and with bounds or constraints, it is not expected to.

    Parameters
    ----------
    design : Mesh
    task, keywords
        As for :func:`gso.hybrid.solve`.
    net : str, path, Net or sequence, optional
        As for :func:`gso.hybrid.solve`. ONNX Runtime, which exported nets need, loads faster than
        PyTorch.
    many : bool
        Whether it is one of many designs, for which the library and the net are loaded once.
    """
    options = plain_options(design, task, keywords)
    if options is None or large_grid(design, task, keywords):
        return False
    preset = _PRESETS[options.variables]
    cold, warm = expected_seconds(preset, len(design.vertices))
    load = 0.0 if many else load_seconds(net)
    return warm + load <= _TIME * cold


def load_seconds(net: NetLike | None) -> float:
    """Return the seconds to load nets and the libraries that they need.

    >>> load_seconds("developable.onnx") < load_seconds("developable")
    True
    """
    nets, seconds = in_turn(net), measured()["load"]
    # Of several nets, the first of a library takes nearly all of its time.
    used = {"onnxruntime" if exported(one) else "torch" for one in nets}
    return sum(float(seconds[library]) for library in used)


def expected_seconds(preset: str, vertices: int) -> tuple[float, float]:
    """Return the expected seconds of a cold solve and of one from a net's result.

    Times are interpolated in proportion to powers of the number of vertices. The second is infinite
    for grids below the smallest measured one from which on the quality is the same.

    Parameters
    ----------
    preset : {"balanced", "accurate"}
    vertices : int
        Number of vertices of the grid.
    """
    rows = measured()["presets"][preset]
    good = [row["energy"] <= _ENERGY and row["strain"] <= _STRAIN for row in rows]
    least = next((k for k in range(len(rows)) if all(good[k:])), len(rows))
    sizes = np.array([float(row["vertices"]) for row in rows])
    cold, warm = (_power(vertices, sizes, [row[name] for row in rows]) for name in ("cold", "net"))
    known = least < len(rows) and vertices >= 0.9 * sizes[least]
    return cold, warm if known else float("inf")


def _power(at: float, sizes: Array, seconds: list[float]) -> float:
    """Interpolate a power law piecewise, continued by its first and last piece."""
    x, y = np.log(sizes), np.log(seconds)
    k = int(np.clip(np.searchsorted(x, np.log(at)) - 1, 0, len(x) - 2))
    slope = (y[k + 1] - y[k]) / (x[k + 1] - x[k])
    return float(np.exp(y[k] + slope * (np.log(at) - x[k])))


@cache
def measured() -> Json:
    """Return the measurements: seconds to load by library, and rows by preset and size."""
    found: Json = json.loads(FILE.read_text())
    return found

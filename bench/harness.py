"""What the sections of the bench share: surfaces, timing, tables, and comparisons of methods."""

from __future__ import annotations

import inspect
import os
import platform
import resource
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

import gso
from gso import linalg, metrics

ROOT = Path(__file__).resolve().parent.parent
BENCH = ROOT / "bench"
#: A column of :func:`compared`: heading, key of the rating, and how its values are summarised.
Column = str | tuple[str, str, Callable[[Sequence[Any]], Any]]


def reference() -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the 24 reference surfaces and their unit noise."""
    with np.load(BENCH / "data" / "bench24.npz") as data:
        return tuple([x.astype(float) for x in data[k]] for k in ("surfaces", "unit_noise"))  # type: ignore[return-value]


def progress(items: Any, text: str) -> Any:
    """Wrap an iterable in a progress bar, if stderr is a terminal."""
    return tqdm(items, desc=text, leave=False, disable=not sys.stderr.isatty())


def timed(function: Callable[..., Any], *given: Any, **keywords: Any) -> tuple[Any, float]:
    """Call a function and return its result and the seconds."""
    start = time.perf_counter()
    value = function(*given, **keywords)
    return value, time.perf_counter() - start


def solver(**keywords: Any) -> Callable[[Any], gso.Result]:
    """Return :func:`gso.tno.optimize` with these keywords."""
    return partial(gso.tno.optimize, **keywords)


def pure(run: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a method without the optional linear backends."""

    def hidden(case: Any) -> Any:
        modules = [linalg.backends()[k] for k in ("cholmod", "pardiso")]
        known = [m.available for m in modules]
        for module in modules:
            module.available = lambda: False
        try:
            return run(case)
        finally:
            for module, available in zip(modules, known, strict=True):
                module.available = available

    return hidden


def compared(
    title: str,
    runs: Mapping[str, Callable[[Any], Any]],
    cases: Sequence[Any],
    rate: Callable[[Any, Any], Mapping[str, Any]],
    columns: Sequence[Column],
    *,
    head: str = "method",
) -> dict[str, dict[str, Any]]:
    """Run every method on every case, print a table of summaries, and return it.

    Ratings are averaged unless a column says otherwise. The rating "s" is the time of the
    call, unless `rate` gives another; its column is the median.
    """
    asked = [c if isinstance(c, tuple) else (c, c, np.mean) for c in columns]
    asked += [("median s", "s", np.median), ("max s", "s", np.max)]
    found: dict[str, dict[str, Any]] = {}
    for name, run in runs.items():
        run(cases[0])  # imports and code generation of the first use
        rows = []
        for case in progress(cases, name):
            outcome, spent = timed(run, case)
            rows.append({"s": spent, **rate(case, outcome)})
        found[name] = {label: how([row[key] for row in rows]) for label, key, how in asked}
    labels = [label for label, _, _ in asked]
    table(title, [head, *labels], [[name, *row.values()] for name, row in found.items()])
    return found


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Print a table."""
    text = [[c if isinstance(c, str) else f"{c:.4g}" for c in row] for row in [columns, *rows]]
    widths = [max(map(len, column)) for column in zip(*text, strict=True)]
    print(f"\n{title}")
    for row in (text[0], ["-" * w for w in widths], *text[1:]):
        cells = [c.rjust(w) if k else c.ljust(w) for k, (c, w) in enumerate(zip(row, widths))]
        print("  " + "  ".join(cells))
    sys.stdout.flush()


def quality(before: np.ndarray, after: np.ndarray) -> dict[str, float]:
    """Rate a developable surface by the metrics of both triangulations (splits) of the quads."""
    unit = metrics.unit(before)
    return {
        "loss_gc": metrics.loss_gc(after, scale=unit),
        "other split": metrics.loss_gc(after, scale=unit, split=1),
        "worse": metrics.loss_gc_worst(after, scale=unit),
        "every 2nd": metrics.loss_gc_half(after, scale=unit),
        "K_A-r": metrics.K_A_r(before, after),
        "K_A-r worse": metrics.K_A_r_worst(before, after),
        "d_H %": metrics.d_H(before, after),
        "fairness": metrics.fairness_ratio(before, after),
    }


@contextmanager
def axes_of(path: str, **labels: str) -> Iterator[Any]:
    """Yield axes to draw on, and write the picture."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7, 4.5), constrained_layout=True)
    yield axes
    axes.set(yscale="log", **labels)
    axes.legend()
    figure.savefig(path)


def machine() -> dict[str, Any]:
    """Describe the machine and the versions of packages."""
    packages = ("numpy", "scipy", "casadi", "libigl", "trimesh")
    return {
        "python": platform.python_version(),
        "machine": platform.machine(),
        "cores": os.cpu_count(),
        "packages": {p: version(p) for p in packages},
        "peak_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
    }


def called(section: Callable[..., Any], settings: Mapping[str, str]) -> Any:
    """Call a section with those of the settings, as text, that it has parameters for."""
    kinds = {"int": int, "float": float, "bool": lambda text: text not in ("0", "no", "false")}
    parameters = inspect.signature(section).parameters
    return section(
        **{
            name: kinds.get(parameter.annotation, Path if "Path" in parameter.annotation else str)(
                settings[name]
            )
            for name, parameter in parameters.items()
            if name in settings
        }
    )

"""What the sections of the bench share: surfaces, timing, tables, and comparisons of methods."""

from __future__ import annotations

import importlib
import inspect
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import patch

import numpy as np
from tqdm import tqdm

import gso
from gso import linalg, metrics

ROOT = Path(__file__).resolve().parent.parent
BENCH = ROOT / "bench"
#: Presets that sections compare.
PRESETS = ("fast", "balanced", "accurate")
#: A column of :func:`compare`: heading, key of the rating if it is another, and how its values
#: are summarised if not by their mean.
Column = str | tuple[Any, ...]


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


def energy(result: gso.Result) -> float:
    """Return the final value of the objective."""
    return sum(result.energy.values())


def quietly(function: Callable[..., Any], *given: Any, **keywords: Any) -> Any:
    """Call a function without warnings: results that are not usable are counted."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return function(*given, **keywords)


def run_apart(function: Callable[..., Any], *given: Any) -> Any:
    """Call a function in a process of its own, whose memory is the function's."""
    with get_context("spawn").Pool(1) as pool:
        return pool.apply(function, given)


def example(name: str) -> ModuleType:
    """Import one of the examples."""
    sys.path.insert(0, str(ROOT / "examples"))
    return importlib.import_module(name)


def solver(**keywords: Any) -> Callable[[Any], gso.Result]:
    """Return :func:`gso.tno.optimize` with these keywords."""
    return partial(gso.tno.optimize, **keywords)


def pure(run: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a method without the optional linear backends."""

    def hidden(case: Any) -> Any:
        with ExitStack() as stack:
            for name in ("cholmod", "pardiso"):
                module = linalg.backends()[name]
                stack.enter_context(patch.object(module, "available", return_value=False))
            return run(case)

    return hidden


def compare(
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
    call, unless `rate` gives another; without a column of it there are the median and the largest.
    """
    given = [c if isinstance(c, tuple) else (c, np.mean) for c in columns]
    asked = [c if len(c) == 3 else (c[0], *c) for c in given]
    if not any(key == "s" for _, key, _ in asked):
        asked += [("median s", "s", np.median), ("max s", "s", np.max)]
    found: dict[str, dict[str, Any]] = {}
    for name, run in runs.items():
        run(cases[0])  # imports and code generation of the first use
        rows = []
        for case in progress(cases, name):
            outcome, spent = timed(run, case)
            rows.append({"s": spent, **rate(case, outcome)})
        found[name] = {label: how([row[key] for row in rows]) for label, key, how in asked}
    return tabulate(title, [head], found)


def tabulate(
    title: str, heads: Sequence[str], rows: Mapping[Any, Mapping[str, Any]]
) -> dict[str, Any]:
    """Print a table, and return it.

    Rows are figures by the headings of their columns. A row is named by a text, or by a tuple of
    texts, which stand below `heads`.
    """
    names = [name if isinstance(name, tuple) else (name,) for name in rows]
    cells = [[*name, *row.values()] for name, row in zip(names, rows.values(), strict=True)]
    table(title, [*heads, *next(iter(rows.values()), ())], cells)
    return {", ".join(name): row for name, row in zip(names, rows.values(), strict=True)}


def medians(rows: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Return the median of each figure."""
    return {name: float(np.median([row[name] for row in rows])) for name in rows[0]}


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
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4.5), layout="constrained")
    axes = figure.subplots()
    yield axes
    axes.set(yscale="log", **labels)
    axes.legend()
    figure.savefig(path)


def call(section: Callable[..., Any], settings: Mapping[str, str]) -> Any:
    """Call a section with those of the settings, as text, that it has parameters for."""
    kinds = {"int": int, "float": float, "bool": lambda text: text not in ("0", "no", "false")}
    parameters = inspect.signature(section).parameters
    given = {}
    for name in parameters.keys() & settings.keys():
        kind = parameters[name].annotation
        given[name] = kinds.get(kind, Path if "Path" in kind else str)(settings[name])
    return section(**given)

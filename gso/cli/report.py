"""Reports on results and surfaces: tables as text, records as JSON."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from gso.errors import ConvergenceWarning
from gso.metrics import INFO
from gso.typing import Json

if TYPE_CHECKING:
    from gso.result import Result


@contextmanager
def status_only() -> Iterator[None]:
    """Suppress convergence warnings, because the printed status says the same."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        yield


def record(file: str, out: str, result: Result, unit: str = "") -> Json:
    """Summarise a result of a file; `unit` names its unit of length, if known."""
    from gso.result import record_of

    return {"input": file, "output": out, **record_of(result, unit)}


def text(record: Json) -> str:
    """Format a record: headline, table of metrics, status, notes, and reasons against it."""
    lines = [*filter(None, [record["headline"]]), f"{record['input']} -> {record['output']}", ""]
    lines += table(record["metrics"])
    lines += ["", f"{record['task']}: {record['message']}"]
    spent = f"{record['iterations']} iterations, {record['seconds']:.2f} s"
    lines.append(spent + (f", {record['backend']}" if record["backend"] else ""))
    if record["details"]:
        lines.append(", ".join(f"{k} {_short(v)}" for k, v in record["details"].items()))
    if record["spline"]:
        lines.append(_spline(record["spline"]))
    lines += [f"note: {note}" for note in record["notes"]]
    lines += [f"not usable: {reason['text']}" for reason in record["reasons"]]
    if not (record["usable"] or record["reasons"]):
        lines.append("this result is not usable as it is")
    return "\n".join(lines)


def _spline(said: Json) -> str:
    n, m = said["controls"]
    return (
        f"spline of {n} x {m} control points: mean |K| {_short(said['curvature'])} 1/size^2, "
        f"at most {_short(said['mesh']['between_max'])} from the mesh between its vertices, "
        f"{_short(said['design']['between_max'])} from the input"
    )


def line(record: Json) -> str:
    """Format a record in one line."""
    values = record["metrics"]
    shown = [record["headline"]] if record["headline"] else []
    # The first metric of a task says most about its result: show it if there is no headline.
    for name in [name.removesuffix("_before") for name in values][: 1 - len(shown)]:
        was = f"{_short(values[f'{name}_before'])} -> " if f"{name}_before" in values else ""
        shown.append(f"{name} {was}{_short(values[name])}")
    shown += [] if record["usable"] else ["not usable"]
    shown += [reason["text"] for reason in record["reasons"]]
    return "; ".join([f"{record['input']} -> {record['output']}", *shown, record["message"]])


def table(metrics: Mapping[str, float | str | None]) -> list[str]:
    """Format metrics as lines of name, value and unit."""
    rows = [(name, _short(value), unit(name)) for name, value in metrics.items()]
    return columns(rows)


def columns(rows: Iterable[tuple[str, ...]]) -> list[str]:
    """Format rows of cells as lines with left-aligned columns."""
    rows = list(rows)
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def unit(name: str) -> str:
    """Return the unit of a metric, "" if it has none or is unknown."""
    info = INFO.get(name) or INFO.get(name.removesuffix("_before"))
    return info.unit if info else ""


def _short(value: float | str | None) -> str:
    if value is None:
        return "-"
    return value if isinstance(value, str) else f"{value:.4g}"

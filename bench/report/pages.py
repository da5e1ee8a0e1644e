"""The report as Markdown and as one self-contained HTML file."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from report.figures import Figure
from report.sections import HEADINGS, SECTIONS, Row
from report.timing import PHASES, Timing, exponent
from report.verdict import Loss

_TEMPLATE = Path(__file__).with_name("page.html")
_SOURCES = {"paper": "paper", "package": "gso", "peer": "peer"}


@dataclass
class Table:
    """Cells as text; `kinds` gives the source of each row: paper, package or peer."""

    head: list[str]
    rows: list[list[str]]
    kinds: list[str]


@dataclass
class Chapter:
    """A chapter of the report."""

    title: str
    text: list[str] = field(default_factory=list)
    items: list[str] = field(default_factory=list)
    table: Table | None = None
    figures: Sequence[Figure] = ()


def number(value: float | None) -> str:
    """Return a number with four digits."""
    return "" if value is None else f"{value:.4g}"


def duration(seconds: float | None) -> str:
    """Format a time in milliseconds or seconds.

    >>> duration(0.0132), duration(38.256)
    ('13.2 ms', '38.3 s')
    """
    if seconds is None:
        return ""
    return f"{1e3 * seconds:.3g} ms" if seconds < 1.0 else f"{seconds:.3g} s"


def quality_table(columns: Sequence[str], rows: Sequence[Row]) -> Table:
    """Return a table of quality and time; times with NumPy kernels only if there are any."""
    both = any(row.seconds_numpy for row in rows)
    times = ["time", "10 to 90 %", *(["time, NumPy"] if both else [])]
    head = ["", "method", *(HEADINGS[c] for c in columns), *times, "iterations"]
    cells = []
    for row in rows:
        # The paper does not publish all figures.
        blank = "not given" if row.source == "paper" else ""
        figures = [number(row.figures.get(c)) or blank for c in columns]
        time = duration(row.seconds.get("median")) or blank
        spread, again = "", ""
        if "p10" in row.seconds:
            low, high, count = (row.seconds[k] for k in ("p10", "p90", "count"))
            spread = f"{duration(low)} to {duration(high)} of {count:.0f}"
        if row.seconds_numpy:
            again = f"{duration(row.seconds_numpy['median'])} of {row.seconds_numpy['count']:.0f}"
        if row.absent:
            figures, time = ["–"] * len(columns), row.absent
        count_text = f"{row.count:,}" if row.count else blank
        last = [number(row.iterations), count_text, row.note]
        spent = [time, spread, *([again] if both else [])]
        cells.append([_SOURCES[row.source], row.name, *figures, *spent, *last])
    return Table([*head, "surfaces", "note"], cells, [row.source for row in rows])


def timing_table(timings: Sequence[Timing]) -> Table:
    """Return a table of time against size."""
    head = ["task", "method", "grid", "median", "fastest", "slowest", "solves", "iterations"]
    head += ["peak MB", *(f"{p} %" for p in PHASES), "limit", "solve / limit", "backend"]
    rows = []
    for t in timings:
        grid = f"{t.size} x {t.size}"
        if t.absent:
            rows.append([t.task, t.method, grid, t.absent] + [""] * (len(head) - 4))
            continue
        spread = [duration(v) for v in (t.median, min(t.seconds), max(t.seconds))]
        parts = [f"{100.0 * t.shares[p]:.0f}" if p in t.shares else "" for p in PHASES]
        bound = [duration(t.limit), number(t.solve / t.limit) if t.limit else "", t.backend]
        done = [str(len(t.seconds)), str(t.iterations or "")]
        rows.append([t.task, t.method, grid, *spread, *done, f"{t.peak_mb:.0f}", *parts, *bound])
    return Table(head, rows, ["package"] * len(rows))


def exponents(timings: Sequence[Timing]) -> list[str]:
    """Return the fitted exponents as sentences."""
    groups: dict[tuple[str, str], list[Timing]] = {}
    for t in timings:
        groups.setdefault((t.task, t.method), []).append(t)
    return [
        f"{task} {method}: time grows as the number of vertices to the power {power:.2f}"
        for (task, method), some in groups.items()
        if (power := exponent(some)) is not None
    ]


def loss_items(losses: Sequence[Loss]) -> list[str]:
    """Return the losses as sentences."""
    titles = {section.name: section.title for section in SECTIONS}
    return [f"{titles[loss.section]}. {loss}" for loss in losses]


def markdown(title: str, chapters: Sequence[Chapter], folder: Path) -> str:
    """Return the report as Markdown; paths of pictures are relative to the folder."""
    parts = [f"# {title}"]
    for chapter in chapters:
        parts.append(f"## {chapter.title}")
        parts += chapter.text
        if chapter.items:
            parts.append("\n".join(f"- {item}" for item in chapter.items))
        if chapter.table is not None:
            parts.append(_markdown_table(chapter.table))
        for figure in chapter.figures:
            if figure.path is not None:
                place = figure.path.relative_to(folder).as_posix()
                parts.append(f"![{figure.caption}]({place})")
            parts.append(f"*{figure.caption}*")
    return "\n\n".join(parts) + "\n"


def _markdown_table(table: Table) -> str:
    rows = [table.head, ["---"] * len(table.head), *table.rows]
    return "\n".join("| " + " | ".join(cell.replace("|", r"\|") for cell in r) + " |" for r in rows)


def html(title: str, chapters: Sequence[Chapter]) -> str:
    """Return the report as one HTML file with embedded pictures."""
    from jinja2 import Environment

    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["embedded"] = _embedded
    template = environment.from_string(_TEMPLATE.read_text(encoding="utf-8"))
    return template.render(title=title, chapters=chapters)


def _embedded(path: Any) -> str:
    return "data:image/png;base64," + base64.b64encode(Path(path).read_bytes()).decode()

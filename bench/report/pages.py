"""The report as Markdown, and the same as one self-contained HTML file."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from report import kernels
from report.figures import Figures
from report.published import INPUT
from report.sections import HEADINGS
from report.timing import PHASES, Timing, exponent
from report.verdict import against_limit

_SOURCES = {"paper": "paper", "package": "gso", "peer": "peer"}
Cells = Sequence[str]


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


def table(head: Cells, rows: Iterable[Cells]) -> str:
    """Return a table in Markdown.

    >>> print(table(["a", "b"], [["|x|", "1"]]))
    | a | b |
    | --- | --- |
    | \\|x\\| | 1 |
    """
    lines = ([cell.replace("|", r"\|") for cell in row] for row in rows)
    return "\n".join(f"| {' | '.join(line)} |" for line in (head, ["---"] * len(head), *lines))


def quality_table(section: Mapping[str, Any]) -> str:
    """Return quality and time of a section; times with NumPy kernels only if there are any."""
    both = any(row["seconds_numpy"] for row in section["rows"])
    head = ["", "method", *section["headings"], "time", "10 to 90 %"]
    head += [*(["time, NumPy"] if both else []), "iterations", "surfaces", "note"]
    return table(head, [_quality(row, section["columns"], both) for row in section["rows"]])


def _quality(row: Mapping[str, Any], columns: Cells, both: bool) -> Cells:
    # The paper does not publish all figures.
    blank = "not given" if row["source"] == "paper" else ""
    figures = [number(row["figures"].get(c)) or blank for c in columns]
    spent, again, spread = row["seconds"], row["seconds_numpy"], ""
    time = duration(spent.get("median")) or blank
    if "p10" in spent:
        spread = f"{duration(spent['p10'])} to {duration(spent['p90'])} of {spent['count']:.0f}"
    if row["absent"]:
        figures, time = ["–"] * len(columns), row["absent"]
    times = [time, spread]
    if both:
        times.append(f"{duration(again['median'])} of {again['count']:.0f}" if again else "")
    count = f"{row['count']:,}" if row["count"] else blank
    last = [number(row["iterations"]), count, row["note"]]
    return [_SOURCES[row["source"]], row["name"], *figures, *times, *last]


def pair_table(pairs: Iterable[Mapping[str, Any]]) -> str:
    """Return a table of published rows and the package's rows of their names."""
    rows = []
    for p in pairs:
        metric = HEADINGS.get(p["metric"], "time, s")
        within = "" if p["low"] is None else f"{number(p['low'])} to {number(p['high'])}"
        other = f"{p['other']}, published" if p["published"] else p["other"]
        figures = [number(p["theirs"]), number(p["ours"]), within]
        rows.append([p["section"], metric, other, p["own"], *figures, p["better"]])
    head = ["table", "figure", "theirs", "ours", "theirs", "ours", "interval", "better"]
    return table(head, rows)


def timing_table(timings: Iterable[Timing]) -> str:
    """Return a table of time against size."""
    head = ["task", "method", "grid", "median", "fastest", "slowest", "solves", "iterations"]
    head += ["peak MB", *(f"{p} %" for p in PHASES), "limit", "solve / limit", "backend"]
    rows = []
    for t in timings:
        row = [t.task, t.method, f"{t.size} x {t.size}", t.absent]
        if t.seconds:
            row[3:] = [duration(v) for v in (t.median, min(t.seconds), max(t.seconds))]
            row += [str(len(t.seconds)), str(t.iterations or ""), f"{t.peak_mb:.0f}"]
            row += [f"{100.0 * t.shares[p]:.0f}" if p in t.shares else "" for p in PHASES]
            row += [duration(t.limit), number(t.solve / t.limit) if t.limit else "", t.backend]
        rows.append(row + [""] * (len(head) - len(row)))
    return table(head, rows)


def exponents(timings: Iterable[Timing]) -> list[str]:
    """Return the fitted exponents as sentences."""
    return [
        f"{task} {method}: time grows as the number of vertices to the power {power:.2f}"
        for (task, method), some in groupby(timings, key=lambda t: (t.task, t.method))
        if (power := exponent(some)) is not None
    ]


def markdown(
    result: dict[str, Any], times: Sequence[Timing], figures: Figures, folder: Path
) -> str:
    """Return the report as Markdown; paths of pictures are relative to the folder."""
    packages = ", ".join(f"{k} {v}" for k, v in result["machine"]["packages"].items() if v)
    context = {"result": result, "times": times, "figures": figures}
    context |= {"folder": folder, "packages": packages, "input": INPUT, "kernels": kernels}
    context |= {"quality_table": quality_table, "timing_table": timing_table}
    context |= {"pair_table": pair_table}
    text = _template("page.md", context | {"limits": against_limit(times)})
    blocks = re.split(r"\n\s*\n", text.strip())
    # A paragraph has one line; lists and tables have one for each item.
    return "\n\n".join(b if b[:2] in ("- ", "| ") else " ".join(b.split()) for b in blocks) + "\n"


def html(text: str, folder: Path) -> str:
    """Return the report, Markdown, as one HTML file with embedded pictures of the folder."""
    (_, title), *blocks = [_block(block, folder) for block in text.strip().split("\n\n")]
    chapters = [content for mark, content in blocks if mark == "##"]
    return _template("page.html", {"title": title, "chapters": chapters, "blocks": blocks})


def _block(block: str, folder: Path) -> tuple[str, Any]:
    """Return the mark at the start of a block of Markdown, and its content."""
    mark, _, content = block.partition(" ")
    if mark in ("#", "##"):
        return mark, content
    if mark == "-":
        return mark, [line[2:] for line in block.splitlines()]
    if mark == "|":
        head, _, *rows = (line[2:-2].split(" | ") for line in block.splitlines())
        return mark, [[cell.replace(r"\|", "|") for cell in row] for row in (head, *rows)]
    if picture := re.fullmatch(r"!\[(.*)\]\((.*)\)", block):
        data = base64.b64encode((folder / picture[2]).read_bytes()).decode()
        return "!", (picture[1], f"data:image/png;base64,{data}")
    return "", block.strip("*")


def _template(name: str, context: dict[str, Any]) -> str:
    from jinja2 import Environment, FileSystemLoader, select_autoescape

    loader, escaped = FileSystemLoader(Path(__file__).parent), select_autoescape()
    found = Environment(loader=loader, autoescape=escaped, trim_blocks=True, lstrip_blocks=True)
    return found.get_template(name).render(context)

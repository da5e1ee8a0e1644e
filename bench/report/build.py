"""A whole run: measure what is not stored yet, then write JSON, Markdown, figures and HTML."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tqdm import tqdm

from gso.io import replacing
from gso.metrics import loss_gc
from report import examples, figures, kernels, pages, store
from report.quality import Records, blocks, measured
from report.sections import HEADINGS, SECTIONS, rows
from report.settings import Settings
from report.store import Store
from report.surfaces import Surfaces
from report.timing import Timing, pieces, timings
from report.verdict import losses, pairs, unmeasured

#: Surfaces of each method whose figures a test compares.
COMPARED = 2


@contextmanager
def bar(total: int, text: str) -> Iterator[Callable[..., None]]:
    """Show a progress bar; where stderr is no terminal, a line every minute."""
    with tqdm(total=total, desc=text, mininterval=0.1 if sys.stderr.isatty() else 60.0) as shown:

        def tick(what: str, count: int = 1) -> None:
            shown.set_postfix_str(what, refresh=False)
            shown.update(count)

        yield tick


def run(settings: Settings, surfaces: Surfaces, out: Path, command: str) -> dict[str, Any]:
    """Measure, write the report to a folder, and return the results.

    They are the content of ``results.json`` and the "records" of the first surfaces.
    """
    kept = Store(out / "pieces")
    total = sum(b.stop - b.start for b in blocks(settings, surfaces))
    with bar(total, "surfaces") as tick:
        records = measured(settings, surfaces, kept, tick)
    with bar(len(pieces(settings)), "sizes") as tick:
        times = timings(settings, kept, tick)
    with bar(3, "examples") as tick:
        shown = examples.solved(settings, surfaces, kept, tick)
    drawn = figures.drawn(out / "figures", records, times, shown)
    count = min(len(surfaces), settings.counts["fast"])
    curved = sum(loss_gc(surfaces[k], scale=1.0) for k in range(count)) / count
    result = {
        "command": command,
        "run": settings.name,
        "machine": store.machine(),
        "kernels": kernels.described(),
        "surfaces": {"name": surfaces.name, "count": count, "loss_gc": curved},
        **_figures(records, times),
    }
    text = pages.markdown(result, times, drawn, out)
    _write(out / "results.json", json.dumps(result, indent=1) + "\n")
    _write(out / "report.md", text)
    _write(out / "report.html", pages.html(text, out))
    return result | {"records": _first(records)}


def _figures(records: Records, times: list[Timing]) -> dict[str, Any]:
    """Return what was measured, for ``results.json``."""
    found = losses(records)
    sections = {
        section.name: {
            "title": section.title,
            "columns": list(section.columns),
            "headings": [HEADINGS[column] for column in section.columns],
            "rows": [asdict(row) for row in rows(section, records)],
        }
        for section in SECTIONS
    }
    return {
        "sections": sections,
        "pairs": pairs(sections),
        "figure_6": figures.curves(records),
        "timing": [asdict(t) for t in times],
        "exponents": pages.exponents(times),
        "losses": [asdict(loss) | {"lost": bool(loss.lost), "text": str(loss)} for loss in found],
        "unmeasured": unmeasured(records),
    }


def _first(records: Records) -> dict[str, list[Any]]:
    """Return the tables' metrics of the first surfaces, by task, level and method."""
    shown = {column for section in SECTIONS for column in section.columns}
    return {
        f"{task}/{sigma:g}/{name}": [
            {k: v for k, v in record.get("figures", {}).items() if k in shown}
            for record in given[:COMPARED]
        ]
        for (task, sigma, name), given in records.items()
    }


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as file:
        file.write(text.encode())

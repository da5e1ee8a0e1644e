"""A whole run: measure what is not stored yet, then write JSON, Markdown, figures and HTML."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from harness import machine
from tqdm import tqdm

from gso.io import replacing
from gso.metrics import loss_gc
from report import examples, figures, kernels, pages, store
from report.chapters import chapters
from report.quality import Records, blocks, measured
from report.sections import HEADINGS, SECTIONS, rows
from report.settings import Settings
from report.store import Store
from report.surfaces import Surfaces
from report.timing import Timing, pieces, timings
from report.verdict import Loss, losses, unmeasured

TITLE = "gso: quality and time, beside the paper and its peers"
#: Packages whose versions are reported, in addition to those of ``bench/harness.py``.
_PACKAGES = ("gso", "numba", "cvxopt", "pypardiso", "torch", "matplotlib", "pymeshlab", "vtk")


@contextmanager
def bar(total: int, text: str) -> Iterator[Callable[..., None]]:
    """Show a progress bar; print lines instead if stderr is not a terminal."""
    watched = sys.stderr.isatty()
    with tqdm(total=total, desc=text, disable=not watched) as shown:
        done, told = 0, -1

        def tick(what: str, count: int = 1) -> None:
            nonlocal done, told
            done += count
            shown.set_postfix_str(what, refresh=False)
            shown.update(count)
            percent = 100 * done // max(total, 1)
            if not watched and percent // 5 > told // 5:
                told = percent
                print(f"{text}: {percent} %, {what}", file=sys.stderr, flush=True)

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
    found = losses(records)
    drawn = _figures(out / "figures", records, times, shown)
    result = _results(settings, surfaces, command, records, times, found)
    text = chapters(result, records, times, found, drawn)
    _write(out / "results.json", json.dumps(result, indent=1) + "\n")
    _write(out / "report.md", pages.markdown(TITLE, text, out))
    _write(out / "report.html", pages.html(TITLE, text))
    return result | {"records": _first(records)}


def _results(
    settings: Settings,
    surfaces: Surfaces,
    command: str,
    records: Records,
    times: list[Timing],
    found: list[Loss],
) -> dict[str, Any]:
    known = machine()
    known["processor"] = store.processor()
    known["packages"] |= store.installed(_PACKAGES)
    count = min(len(surfaces), settings.counts["fast"])
    return {
        "command": command,
        "run": settings.name,
        "machine": known,
        "kernels": kernels.described(),
        "surfaces": {
            "name": surfaces.name,
            "count": count,
            "loss_gc": sum(loss_gc(surfaces[k], scale=1.0) for k in range(count)) / count,
        },
        "sections": {
            section.name: {
                "title": section.title,
                "columns": list(section.columns),
                "headings": [HEADINGS[column] for column in section.columns],
                "rows": [asdict(row) for row in rows(section, records)],
            }
            for section in SECTIONS
        },
        "figure_6": {
            metric: {
                name: figures.intervals(records, metric, name)
                for name in figures.CURVES
                if ("developable", 0.0, name) in records
            }
            for metric in ("K_A_r_worst", "d_H")
        },
        "timing": [asdict(t) for t in times],
        "exponents": pages.exponents(times),
        "losses": [asdict(loss) | {"lost": bool(loss.lost), "text": str(loss)} for loss in found],
        "unmeasured": unmeasured(records),
    }


def _figures(
    folder: Path, records: Records, times: list[Timing], shown: dict[tuple[str, float], Any]
) -> dict[str, list[figures.Figure]]:
    with bar(6, "figures") as tick:
        found = {}
        for number, make in {
            "5": lambda: [figures.figure_5(folder)],
            "6": lambda: [figures.figure_6(folder, records)],
            "7": lambda: figures.figure_7(folder, shown["developable", 0.0]),
            "8": lambda: figures.figure_8(folder, shown["flatten", 0.0]),
            "9": lambda: figures.figure_9(
                folder, {s: some for (task, s), some in shown.items() if task == "denoise"}
            ),
            "time": lambda: [
                figures.time_against_size(folder, times),
                figures.shares(folder, times),
            ],
        }.items():
            found[number] = make()
            tick(number, 1)
    return found


#: Surfaces of each method whose figures a test compares.
COMPARED = 2


def _first(records: Records) -> dict[str, list[Any]]:
    """Return the tables' metrics of the first surfaces, by task, level and method."""
    shown = {column for section in SECTIONS for column in section.columns}
    return {
        "/".join((task, f"{sigma:g}", name)): [
            {k: v for k, v in record.get("figures", {}).items() if k in shown}
            for record in given[:COMPARED]
        ]
        for (task, sigma, name), given in records.items()
    }


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as file:
        file.write(text.encode())

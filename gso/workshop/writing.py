"""The files of a fabrication: parts, sheets, surfaces, and the page."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from gso import io
from gso.workshop import writers
from gso.workshop.page import page
from gso.workshop.panels import Made
from gso.workshop.part import Drawing, Part

#: Gap between parts that are drawn side by side, as a share of the largest.
_GAP = 0.05
_FOLDERS = ("parts", "sheets", "surfaces")


def written(
    place: Path,
    parts: Sequence[Part],
    sheets: Sequence[Drawing],
    found: Iterable[Made],
    certificate: dict[str, Any],
    formats: Sequence[str],
    layers: str,
    paper: str | None,
) -> list[str]:
    """Write all files, delete those of an earlier call that are not written again."""
    earlier = _earlier(place)
    files: list[str] = []

    def write(drawing: Drawing, name: str, **options: Any) -> None:
        (place / name).parent.mkdir(exist_ok=True)
        writers.write(drawing, place / name, **options)
        files.append(name)

    for suffix in formats:
        options = {} if suffix == "pdf" else {"layers": layers}
        for part in parts:
            write(Drawing((part,), title=part.name), f"parts/{part.name}.{suffix}", **options)
        for number, drawing in enumerate(sheets, start=1):
            write(drawing, f"sheets/sheet-{number}.{suffix}", **options)
    if paper is not None and parts:
        write(beside(parts), "parts.pdf", paper=paper)
    for one in found:
        for panel in one.panels:
            name = f"surfaces/{panel.name}.obj"
            (place / name).parent.mkdir(exist_ok=True)
            io.write(panel.surface, place / name)
            files.append(name)
    with io.replacing(place / "index.html") as file:
        file.write(page(certificate, parts, sheets).encode())
    files += ["index.html", "certificate.json"]
    for name in earlier - set(files):
        (place / name).unlink(missing_ok=True)
    return files


def _earlier(place: Path) -> set[str]:
    """Return the drawings and surfaces that an earlier call wrote, by its certificate."""
    try:
        files = json.loads((place / "certificate.json").read_text(encoding="utf-8"))["files"]
        kept = {str(name) for name in files}
    except (OSError, ValueError, KeyError, TypeError):
        return set()
    return {n for n in kept if n.count("/") == 1 and n.split("/")[0] in _FOLDERS and ".." not in n}


def beside(parts: Sequence[Part]) -> Drawing:
    """Place parts side by side, in rows of about equal width and height."""
    gap = _GAP * max(max(part.size) for part in parts)
    area = sum((part.size[0] + gap) * (part.size[1] + gap) for part in parts)
    wide = max(1.3 * area**0.5, max(part.size[0] for part in parts))
    out = []
    x = y = high = 0.0
    for part in sorted(parts, key=lambda p: -p.size[1]):
        if x > 0 and x + part.size[0] > wide:
            x, y, high = 0.0, y + high + gap, 0.0
        out.append(part.shifted(-part.low + [x, y]))
        x, high = x + part.size[0] + gap, max(high, part.size[1])
    return Drawing(tuple(out), title="parts")

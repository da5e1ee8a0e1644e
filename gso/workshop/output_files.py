"""The files of a fabrication: parts, sheets, surfaces, and the page."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gso import io
from gso.io.atomic import write_bytes
from gso.typing import Json, Keywords
from gso.workshop import writers
from gso.workshop.job_folder import CERTIFICATE, PAGE, PAPER, SOLIDS
from gso.workshop.page import page_html
from gso.workshop.page_views import Views
from gso.workshop.part import Drawing, Part
from gso.workshop.writers import strokes
from gso.workshop.writers.layers import layer_set
from gso.workshop.writers.pdf import check_paper

#: Gap between parts that are drawn side by side, as a share of the largest.
_GAP = 0.05


@dataclass(frozen=True)
class Drawings:
    """How drawings are written.

    Attributes
    ----------
    formats : tuple of str
    layers : str
    paper : str or None
        Of the PDF with all parts; None for none.
    bend_text : bool
    step : bool
        Whether the folded parts are written as solids.

    Raises
    ------
    OptionError
        A format, the layers or the paper are not known.
    GSOError
        A package that a format needs is not installed.
    """

    formats: tuple[str, ...]
    layers: str = "operations"
    paper: str | None = None
    bend_text: bool = False
    step: bool = False

    def __post_init__(self) -> None:
        for name in (*self.formats, *(() if self.paper is None else ("pdf",))):
            writers.require_package(writers.get(name))
        if self.step:
            io.check_package(".step")
        layer_set(self.layers)
        if self.paper is not None:
            check_paper(self.paper)

    def options(self, suffix: str) -> Keywords:
        """Return the options of a writer."""
        out: Keywords = {"layers": self.layers, "bend_text": self.bend_text}
        return out | ({"paper": self.paper} if suffix == "pdf" and self.paper else {})


def written(
    place: Path,
    parts: Sequence[Part],
    sheets: Sequence[Drawing],
    views: Views,
    certificate: Json,
    drawings: Drawings,
    earlier: Set[str],
    solids: Sequence[io.Solid] = (),
) -> list[str]:
    """Write all files but the certificate; delete earlier ones that are not written again."""
    files: list[str] = []

    def write(drawing: Drawing, name: str, suffix: str, **more: Any) -> None:
        (place / name).parent.mkdir(exist_ok=True)
        writers.write(drawing, place / name, **drawings.options(suffix), **more)
        files.append(name)

    for suffix in drawings.formats:
        for part in parts:
            drawing = Drawing((part,), title=strokes.title(part))
            write(drawing, f"parts/{part.name}.{suffix}", suffix)
        for number, drawing in enumerate(sheets, start=1):
            write(drawing, f"sheets/sheet-{number}.{suffix}", suffix)
    if drawings.paper is not None and parts:
        found = {part.name: views.place(part.name) for part in parts}
        at = {name: (one[0], one[2]) for name, one in found.items() if one is not None}
        write(beside(parts), PAPER, "pdf", places=at, steps=views.step_texts())
    for one in views.shown:
        for panel in one.made.panels:
            name = f"surfaces/{panel.name}.obj"
            (place / name).parent.mkdir(exist_ok=True)
            io.write(panel.surface, place / name)
            files.append(name)
    if solids:
        io.save_solids(solids, place / SOLIDS)
        files.append(SOLIDS)
    write_bytes(place / PAGE, page_html(certificate, parts, sheets, views).encode())
    files += [PAGE, CERTIFICATE]
    for name in earlier - set(files):
        (place / name).unlink(missing_ok=True)
    return files


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

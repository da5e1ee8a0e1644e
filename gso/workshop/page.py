"""One page to look at: it turns, folds and explodes, and works without a network.

The page is complete without its script: the verdict, tables, drawings, sheets, and pictures of the
parts in their places. The script (sources in ``web/``, built to ``gso/workshop/web``) adds what
moves.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Callable, Sequence
from functools import lru_cache
from html import escape
from importlib.resources import files

from gso.typing import Json
from gso.wording import listed, places
from gso.workshop.page_data import data_for_page
from gso.workshop.page_drawings import part_drawing, sheet_drawing
from gso.workshop.page_tables import designs_table, parts_table, seams_table
from gso.workshop.page_text import addresses, guided, mm
from gso.workshop.page_views import Views, assembly_sheet, place_picture, whole_pictures
from gso.workshop.part import Drawing, Part
from gso.workshop.writers.layers import layer_set

#: Kinds of lines, and what they mean.
_KINDS = {
    "outline": "cut",
    "roll": "roll",
    "guide": "guide lines: curved least along them",
    "mountain": "bend down, away from you",
    "valley": "bend up, towards you",
    "mark": "engrave: marks, creases, notches",
    "seam": "sew or weld",
    "sheet": "sheet",
}


def page_html(
    certificate: Json, parts: Sequence[Part], sheets: Sequence[Drawing], views: Views
) -> str:
    """Return the page as HTML.

    Parameters
    ----------
    certificate : dict
        As :func:`gso.fabricate` writes it: ``usable``, ``reasons``, ``notes``, ``designs`` and
        ``sheets`` are read.
    parts : sequence of Part
    sheets : sequence of Drawing
    views : Views
        Of what was made of the designs.
    """
    address = addresses(certificate, parts)
    good = certificate["usable"]
    title = listed([escape(one["name"]) for one in certificate["designs"]], 3)
    said = "can be made as it was asked for" if good else "cannot be made as it was asked for"
    if views.shown and not parts:
        said = "is as it was asked for" if good else "is not as it was asked for"
    data = data_for_page(views.shown, parts, certificate)
    arrays = data.pop("arrays")
    lines = [
        "<!DOCTYPE html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{title}{': flat parts' if parts else ''}</title>",
        f"<style>{_file('page.css')}{_colours()}</style></head><body>",
        f'<header><h1 class="{"good" if good else "bad"}">{title} {said}</h1>',
        *_reasons(certificate["reasons"]),
        "</header><main>",
        '<div id="viewer"></div>',
        *_section("parts", "Parts", [parts_table(certificate, parts, views, address)]),
        *_section("drawings", "Drawings", _drawings(parts, views, address) if parts else []),
        *_section("sheets", "Sheets", _sheets(certificate, parts, sheets)),
        *_section("seams", "Seams", [seams_table(views, address)]),
        *_section("places", "Places" if parts else "Pictures", whole_pictures(views, address)),
        *_section("assembly", "Assembly", assembly_sheet(views, address)),
        *_section("designs", "Designs", [designs_table(certificate["designs"])]),
        *(f"<p>{escape(note)}</p>" for note in certificate["notes"]),
        "</main>",
        _packed("page-data", json.dumps(data, separators=(",", ":"), allow_nan=False).encode()),
        _packed("page-arrays", arrays),
        _script(),
        f"<script>{_file('boot.js')}</script>",
        "</body></html>",
    ]
    return "\n".join(lines) + "\n"


@lru_cache(maxsize=1)
def _script() -> str:
    """Return the script, which is the same for all pages of a process."""
    return _packed("page-script", _file("page.js").encode())


def _file(name: str) -> str:
    return (files("gso.workshop") / "web" / name).read_text("utf-8").strip()


def _packed(name: str, data: bytes) -> str:
    """Return data for the script of the page: compressed, as base64."""
    code = base64.b64encode(zlib.compress(data, 9)).decode()
    return f'<script type="text/plain" id="{name}">{code}</script>'


def _section(name: str, title: str, lines: Sequence[str]) -> list[str]:
    """Return a section, or nothing if it has no content."""
    if not any(lines):
        return []
    return [f'<section id="{name}"><h2>{title}</h2>', *lines, "</section>"]


def _reasons(reasons: Sequence[Json]) -> list[str]:
    if not reasons:
        return []
    return ["<ul>", *(f"<li>{escape(reason['text'])}</li>" for reason in reasons), "</ul>"]


def _drawings(parts: Sequence[Part], views: Views, address: Callable[[str], str]) -> list[str]:
    """Return the drawing of every part, all at one scale, with its place in its design."""
    largest = max(max(part.size) for part in parts)
    lines = [_legend(), f'<div class="gallery" style="--most:{largest:.6g}">']
    for k, part in enumerate(parts):
        wide, high = part.size
        said = f", {part.count} times" if part.count > 1 else ""
        said += "".join(f"; {zone.in_words()}" for zone in part.zones)
        said += f"; made of {part.made_of}" if part.faces else ""
        said += guided(part)
        seams, _ = views.mates(part.name)
        said += f"; {places('seam', seams)}" if seams else ""
        lines += [
            f'<figure id="{escape(address(part.name)[1:])}" class="part" data-part="{k}">',
            part_drawing(part, k),
            place_picture(views, part.name),
            f"<figcaption><b>{escape(part.name)}</b>: {mm(wide)} x {mm(high)} "
            f'<span data-unit="mm">mm</span>{escape(said)}</figcaption></figure>',
        ]
    return [*lines, "</div>"]


def _sheets(certificate: Json, parts: Sequence[Part], sheets: Sequence[Drawing]) -> list[str]:
    lines = []
    for k, drawing in enumerate(sheets):
        share = certificate["sheets"][k]["utilisation"]
        words = f"sheet {k + 1}: {100 * share:.1f} % of its area"
        drawn = sheet_drawing(drawing, parts)
        lines.append(f'<figure class="sheet">{drawn}<figcaption>{words}</figcaption></figure>')
    return lines


def _colours() -> str:
    layers = layer_set("operations")
    return "".join(f".{kind}{{--line:{layers[kind].colour}}}" for kind in _KINDS)


def _legend() -> str:
    said = (f'<span><i class="{kind}"></i>{escape(words)}</span>' for kind, words in _KINDS.items())
    return f'<p class="legend">{"".join(said)}</p>'

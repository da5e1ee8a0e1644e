"""One page to look at: the verdict, the table, the sheets and the parts, without a network."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from html import escape
from itertools import islice
from xml.etree.ElementTree import tostring

import numpy as np

from gso.io.svg_page import SVGPage
from gso.typing import Json
from gso.wording import listed
from gso.workshop.assembly_view import assembly
from gso.workshop.certificate import codes
from gso.workshop.panels import Made
from gso.workshop.part import Drawing, Part
from gso.workshop.writers import strokes
from gso.workshop.writers.layers import layer_set

#: Numbers of parts and of designs that are drawn, and the least number but 0 that is written.
_SHOWN, _PICTURED, _LEAST = 120, 12, 0.001
_STYLE = """
body { font: 14px system-ui, sans-serif; margin: 2em; color: #222; }
table { border-collapse: collapse; margin: 1em 0; }
td, th { border-bottom: 1px solid #ccc; padding: 3px 10px; text-align: right; }
td:first-child, th:first-child { text-align: left; }
.good { color: #087f23; } .bad { color: #b00020; }
figure { display: inline-block; margin: 8px; vertical-align: top; }
figcaption { font-size: 12px; }
svg { border: 1px solid #ddd; background: #fff; }
path, line { fill: none; stroke-width: 1px; vector-effect: non-scaling-stroke; }
path.bend { stroke: #222; stroke-width: 0.6px; }
a text { font-weight: bold; stroke: #fff; stroke-width: 3px; paint-order: stroke; }
path.rim { stroke: #000; stroke-width: 1.6px; }
figure:target { outline: 3px solid #ff8000; }
.legend span { margin-right: 1.5em; white-space: nowrap; }
.legend i { display: inline-block; width: 2em;
border-top-style: solid; border-top-width: 3px; vertical-align: middle; margin-right: 0.4em; }
"""
#: Kinds of lines, what they mean, and how they are drawn beyond their colour in drawings.
_KINDS = {
    "outline": ("cut", "fill: #f6f2ea;"),
    "roll": ("roll", "stroke-dasharray: 2 2;"),
    "guide": ("guide lines: curved least along them", "stroke-dasharray: 1 3;"),
    "mountain": ("bend down, away from you", ""),
    "valley": ("bend up, towards you", ""),
    "mark": ("engrave: marks, creases, notches", ""),
    "seam": ("sew or weld", "stroke-dasharray: 4 3;"),
    "sheet": ("sheet", ""),
}


def page(
    certificate: Json, parts: Sequence[Part], sheets: Sequence[Drawing], found: Iterable[Made]
) -> str:
    """Return the page as HTML."""
    address = _addresses(certificate, parts)
    good = certificate["usable"]
    names = [escape(one["name"]) for one in certificate["designs"]]
    title = listed(names, 3)
    said = "can be made as it was asked for" if good else "cannot be made as it was asked for"
    lines = [
        "<!DOCTYPE html>",
        f'<html lang="en"><meta charset="utf-8"><title>{title}: flat parts</title>',
        f"<style>{_STYLE}{_colours()}</style>",
        f'<h1 class="{"good" if good else "bad"}">{title} {said}</h1>',
    ]
    if certificate["reasons"]:
        lines += [
            "<ul>",
            *(f"<li>{escape(r['text'])}</li>" for r in certificate["reasons"]),
            "</ul>",
        ]
    lines += [f"<p>{escape(note)}</p>" for note in certificate["notes"]]
    lines.append(_designs(certificate["designs"]))
    for made in islice(found, _PICTURED):
        lines.append(f"<h2>{escape(made.name)}: the parts in their places</h2>")
        titles = ("from the front; thin lines are bends", "from behind")
        for picture, said in zip(assembly(made, address), titles, strict=True):
            lines.append(f"<figure>{picture}<figcaption>{said}</figcaption></figure>")
    lines.append(_legend())
    for number, drawing in enumerate(sheets):
        share = certificate["sheets"][number]["utilisation"]
        lines.append(_figure(drawing, f"sheet {number + 1}: {100 * share:.1f} % of its area", 900))
    lines.append("<h2>Parts</h2>")
    for part in parts[:_SHOWN]:
        wide, high = part.size
        text = f"{part.name}: {wide:.1f} x {high:.1f} mm"
        text += f", {part.count} times" if part.count > 1 else ""
        text += "".join(f"; {zone.in_words()}" for zone in part.zones)
        text += f"; made of {part.made_of}" if part.faces else ""
        text += _guided(part)
        lines.append(_figure(Drawing((part,)), text, 240, address(part.name).lstrip("#")))
    if len(parts) > _SHOWN:
        lines.append(f"<p>and {len(parts) - _SHOWN} more</p>")
    return "\n".join([*lines, "</html>"]) + "\n"


def _guided(part: Part) -> str:
    """Say how straight the guide lines of a part are; empty without any."""
    if not part.guides:
        return ""
    angle = np.degrees(max(guide.angle for guide in part.guides))
    return f"; no bends, guide lines up to {angle:.2g} degrees from straight"


def _addresses(certificate: Json, parts: Sequence[Part]) -> Callable[[str], str]:
    """Return a function that gives the place on the page of the part that a panel is made as.

    It is empty for parts that are not drawn.
    """
    names = [part.name for part in parts]
    own = dict(zip(names, strokes.identifiers(parts), strict=True))
    for record in certificate["designs"]:
        for entry in record.get("parts", ()):
            if entry["same_as"]:
                own[entry["name"]] = own[entry["same_as"]]
    shown = {own[name] for name in names[:_SHOWN]}
    return lambda name: f"#part-{own[name]}" if own[name] in shown else ""


def _colours() -> str:
    layers = layer_set("operations")
    return "\n".join(
        f".{kind} {{ stroke: {layers[kind].colour}; border-color: {layers[kind].colour}; {more} }}"
        for kind, (_, more) in _KINDS.items()
    )


def _legend() -> str:
    said = (
        f'<span><i class="{kind}"></i>{escape(words)}</span>' for kind, (words, _) in _KINDS.items()
    )
    return f'<p class="legend">{"".join(said)}</p>'


def _designs(designs: Sequence[Json]) -> str:
    heads = ("design", "copies", "parts", "parts per m²", "distance, mean mm", "largest mm")
    more = ("allowed mm", "strain % (99 %)", "smallest bend radius mm", "seam mismatch mm")
    every = (*heads, *more, "verdict")
    rows = ["<table><tr>", *(f"<th>{h}</th>" for h in every), "</tr>"]
    for one in designs:
        strain = one.get("strain_max")
        cells = [
            escape(one["name"]),
            str(len(one["copies"])),
            str(len(one.get("parts", []))),
            _number(one.get("parts_per_m2")),
            *(_number(one.get(k)) for k in ("deviation_mean", "deviation_max", "allowed")),
            _number(None if strain is None else 100 * strain),
            _number(one.get("bend_radius_min")),
            _number(one.get("seam_mismatch_max")),
            _verdict(one["reasons"]),
        ]
        rows.append("<tr>" + "".join(f"<td>{c}</td>" for c in cells) + "</tr>")
    return "".join([*rows, "</table>"])


def _verdict(reasons: Sequence[Json]) -> str:
    if not reasons:
        return '<span class="good">yes</span>'
    return f'<span class="bad">no: {escape(codes(reasons))}</span>'


def _number(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.3g}" if value >= _LEAST or value == 0.0 else f"&lt; {_LEAST:g}"


def _figure(drawing: Drawing, text: str, width: int, place: str = "") -> str:
    low, high = drawing.bounds
    size = np.maximum(high - low, 1e-9)
    height = max(int(width * size[1] / size[0]), 8)
    if height > 2 * width:
        width, height = int(2 * width * size[0] / size[1]) + 1, 2 * width
    room = 0.01 * float(size.max())
    page = SVGPage(low - room, high + room, digits=5)
    page.root.attrib |= {"width": str(width), "height": str(height)}
    draw = partial(page.path, page.root)
    for border in strokes.sheet(drawing):
        draw([border.points], closed=True, kind="sheet")
    for part in drawing.parts:
        draw([part.outline, *part.holes], closed=True, kind="outline")
        notches = [np.stack([n.at, n.at + 1.2 * room * n.inward]) for n in part.notches]
        draw([*part.marks, *part.creases, *notches], kind="mark")
        draw(part.seams, kind="seam")
        for kind in ("guide", "roll", "mountain", "valley"):
            draw([line.points for line in strokes.lines(part) if line.kind == kind], kind=kind)
        if drawing.sheet is not None:
            tall = min(1.1 * room, 0.8 * part.size[0] / max(len(part.name), 1))
            middle = 0.5 * (part.low + part.outline.max(axis=0))
            page.text(page.root, part.name, middle - [0.0, 0.5 * tall], tall)
    picture = tostring(page.root, "unicode")
    name = f' id="{escape(place)}"' if place else ""
    return f"<figure{name}>{picture}<figcaption>{escape(text)}</figcaption></figure>"

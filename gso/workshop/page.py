"""One page to look at: the verdict, the table, the sheets and the parts, without a network."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np

from gso.typing import Array
from gso.workshop.certificate import codes
from gso.workshop.part import Drawing, Part
from gso.workshop.writers.layers import layer_set

#: Number of parts that are drawn, and the least number other than 0 that is written.
_SHOWN, _LEAST = 120, 0.001
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
text { font-family: sans-serif; text-anchor: middle; dominant-baseline: central; }
.legend span { margin-right: 1.5em; white-space: nowrap; }
.legend i { display: inline-block; width: 2em;
border-top-style: solid; border-top-width: 3px; vertical-align: middle; margin-right: 0.4em; }
"""
#: Kinds of lines, what they mean, and how they are drawn beyond their colour in drawings.
_KINDS = {
    "outline": ("cut", "fill: #f6f2ea;"),
    "mountain": ("bend down, away from you", ""),
    "valley": ("bend up, towards you", ""),
    "mark": ("engrave: marks, creases, notches", ""),
    "seam": ("sew or weld", "stroke-dasharray: 4 3;"),
    "sheet": ("sheet", ""),
}


def page(certificate: dict[str, Any], parts: Sequence[Part], sheets: Sequence[Drawing]) -> str:
    """Return the page as HTML."""
    good = certificate["usable"]
    names = [escape(one["name"]) for one in certificate["designs"]]
    title = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
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
    lines += [_designs(certificate["designs"]), _legend()]
    for number, drawing in enumerate(sheets):
        share = certificate["sheets"][number]["utilisation"]
        lines.append(_figure(drawing, f"sheet {number + 1}: {100 * share:.1f} % of its area", 900))
    lines.append("<h2>Parts</h2>")
    for part in parts[:_SHOWN]:
        wide, high = part.size
        text = f"{part.name}: {wide:.1f} x {high:.1f} mm"
        text += f", {part.count} times" if part.count > 1 else ""
        lines.append(_figure(Drawing((part,)), text, 240))
    if len(parts) > _SHOWN:
        lines.append(f"<p>and {len(parts) - _SHOWN} more</p>")
    return "\n".join([*lines, "</html>"]) + "\n"


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


def _designs(designs: Sequence[dict[str, Any]]) -> str:
    heads = ("design", "copies", "parts", "distance, mean mm", "largest mm", "allowed mm")
    more = ("strain % (99 %)", "smallest bend radius mm", "seam mismatch mm", "verdict")
    rows = ["<table><tr>", *(f"<th>{h}</th>" for h in (*heads, *more)), "</tr>"]
    for one in designs:
        strain = one.get("strain_p99")
        cells = [
            escape(one["name"]),
            str(len(one["copies"])),
            str(len(one.get("parts", []))),
            *(_number(one.get(k)) for k in ("deviation_mean", "deviation_max", "allowed")),
            _number(None if strain is None else 100 * strain),
            _number(one.get("bend_radius_min")),
            _number(one.get("seam_mismatch_max")),
            _verdict(one["reasons"]),
        ]
        rows.append("<tr>" + "".join(f"<td>{c}</td>" for c in cells) + "</tr>")
    return "".join([*rows, "</table>"])


def _verdict(reasons: Sequence[dict[str, Any]]) -> str:
    if not reasons:
        return '<span class="good">yes</span>'
    return f'<span class="bad">no: {escape(codes(reasons))}</span>'


def _number(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.3g}" if value >= _LEAST or value == 0.0 else f"&lt; {_LEAST:g}"


def _figure(drawing: Drawing, text: str, width: int) -> str:
    low, high = drawing.bounds
    size = np.maximum(high - low, 1e-9)
    height = max(int(width * size[1] / size[0]), 8)
    if height > 2 * width:
        width, height = int(2 * width * size[0] / size[1]) + 1, 2 * width
    room = 0.01 * float(size.max())
    box = f"{-room:.6g} {-room:.6g} {size[0] + 2 * room:.6g} {size[1] + 2 * room:.6g}"
    out = [f'<figure><svg width="{width}" height="{height}" viewBox="{box}">']
    corner = np.array([low[0], high[1]])
    if drawing.sheet is not None:
        x, y = drawing.sheet
        out.append(_path([np.array([[0, 0], [x, 0], [x, y], [0, y]])], corner, "sheet", True))
    depth = 0.012 * float(size.max())
    for part in drawing.parts:
        out.append(_path([part.outline, *part.holes], corner, "outline", True))
        notches = [np.stack([n.at, n.at + depth * n.inward]) for n in part.notches]
        out.append(_path([*part.marks, *part.creases, *notches], corner, "mark", False))
        out.append(_path(list(part.seams), corner, "seam", False))
        for name, sign in (("mountain", 1), ("valley", -1)):
            lines = [b.line for b in part.bends if sign * b.angle > 0]
            out.append(_path(lines, corner, name, False))
        if drawing.sheet is not None:
            x, y = ((0.5 * (part.low + part.outline.max(axis=0)) - corner) * [1.0, -1.0]).tolist()
            tall = min(0.016 * float(size.max()), 1.2 * part.size[0] / max(len(part.name), 1))
            said = escape(part.name)
            out.append(f'<text x="{x:.5g}" y="{y:.5g}" font-size="{tall:.4g}">{said}</text>')
    return "".join([*out, f"</svg><figcaption>{escape(text)}</figcaption></figure>"])


def _path(lines: list[Array], corner: Array, name: str, closed: bool) -> str:
    if not lines:
        return ""
    text = []
    for line in lines:
        points = (line - corner) * [1.0, -1.0]
        text.append("M" + "L".join(f"{x:.5g} {y:.5g}" for x, y in points.tolist()))
        text.append("Z" if closed else "")
    return f'<path class="{name}" d="{"".join(text)}"/>'

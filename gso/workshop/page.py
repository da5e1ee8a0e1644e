"""One page to look at: the verdict, the table, the sheets and the parts, without a network."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np

from gso.typing import Array
from gso.workshop.part import Drawing, Part

#: Number of parts that are drawn.
_SHOWN = 120
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
.cut { stroke: #d00; fill: #f6f2ea; } .mountain { stroke: #06c; } .valley { stroke: #093; }
.mark { stroke: #a0a; } .seam { stroke: #888; stroke-dasharray: 4 3; } .sheet { stroke: #999; }
"""


def page(certificate: dict[str, Any], parts: Sequence[Part], sheets: Sequence[Drawing]) -> str:
    """Return the page as HTML."""
    good = certificate["usable"]
    said = "can be made as it was asked for" if good else "cannot be made as it was asked for"
    lines = [
        "<!DOCTYPE html>",
        '<html lang="en"><meta charset="utf-8"><title>gso fabricate</title>',
        f"<style>{_STYLE}</style>",
        f'<h1 class="{"good" if good else "bad"}">It {said}</h1>',
    ]
    if certificate["reasons"]:
        lines += ["<ul>", *(f"<li>{escape(r)}</li>" for r in certificate["reasons"]), "</ul>"]
    lines += [_designs(certificate["designs"])]
    for number, drawing in enumerate(sheets):
        share = certificate["sheets"][number]["utilisation"]
        lines.append(_figure(drawing, f"sheet {number + 1}: {100 * share:.1f} % used", 900))
    lines.append("<h2>Parts</h2>")
    for part in parts[:_SHOWN]:
        wide, high = part.size
        text = f"{part.name}: {wide:.1f} x {high:.1f} mm"
        text += f", {part.count} times" if part.count > 1 else ""
        lines.append(_figure(Drawing((part,)), text, 240))
    if len(parts) > _SHOWN:
        lines.append(f"<p>and {len(parts) - _SHOWN} more</p>")
    return "\n".join([*lines, "</html>"]) + "\n"


def _designs(designs: Sequence[dict[str, Any]]) -> str:
    heads = ("design", "copies", "parts", "distance mm", "at most", "allowed", "strain % (99 %)")
    more = ("bend radius mm", "seam mismatch mm", "verdict")
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
            '<span class="bad">no</span>' if one["reasons"] else '<span class="good">yes</span>',
        ]
        rows.append("<tr>" + "".join(f"<td>{c}</td>" for c in cells) + "</tr>")
    return "".join([*rows, "</table>"])


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


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
    for part in drawing.parts:
        out.append(_path([part.outline, *part.holes], corner, "cut", True))
        out.append(_path([*part.marks, *part.creases], corner, "mark", False))
        out.append(_path(list(part.seams), corner, "seam", False))
        for name, sign in (("mountain", 1), ("valley", -1)):
            lines = [b.line for b in part.bends if sign * b.angle > 0]
            out.append(_path(lines, corner, name, False))
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

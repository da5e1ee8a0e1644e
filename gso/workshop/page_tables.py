"""Tables of the page: parts, seams, designs."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from html import escape

import numpy as np

from gso.typing import Json
from gso.workshop.certificate import codes
from gso.workshop.page_text import head, mm, mm2, number, small_mm
from gso.workshop.page_views import Views
from gso.workshop.part import Part


def parts_table(
    certificate: Json, parts: Sequence[Part], views: Views, address: Callable[[str], str]
) -> str:
    """Return the table of parts, one row for each that is drawn; empty without parts."""
    heads = (
        *("part", "count", "length mm", "width mm", "area mm2", "bends", "largest angle °"),
        *("least radius mm", "holes", "seams", "joined to"),
    )
    records = {
        entry["name"]: entry
        for record in certificate["designs"]
        for entry in record.get("parts", ())
    }
    rows = []
    for k, part in enumerate(parts):
        record, (long, wide) = records[part.name], part.size
        seams, others = views.mates(part.name)
        cells = [
            _linked(part.name, address),
            str(part.count),
            mm(long),
            mm(wide),
            mm2(part.area),
            str(record["bends"]),
            f"{record['bend_angle_max']:.1f}",
            mm(record["bend_radius_min"]),
            str(record["holes"]),
            str(len(seams)),
            ", ".join(_linked(name, address) for name in others) or "-",
        ]
        rows.append((f' data-part="{k}"', cells))
    return _table(heads, rows, "parts") if rows else ""


def seams_table(views: Views, address: Callable[[str], str]) -> str:
    """Return the table of seams: which parts each joins; empty without seams."""
    heads = ("seam", "design", "part", "other part", "length mm", "angle °", "difference mm")
    rows: list[tuple[str, list[str]]] = []
    for one in views.shown:
        panels = one.made.panels
        for seam in one.made.matings:
            names = [panels[side.panel].name for side in (seam.one, seam.two)]
            angle = np.degrees(seam.angle)
            cells = [
                f"<b>{seam.number}</b>" + (f" (mark {seam.kind})" if seam.kind else ""),
                escape(one.made.name),
                _linked(names[0], address),
                "itself" if names[0] == names[1] else _linked(names[1], address),
                mm(one.scale * seam.length),
                f"{abs(angle):.1f} {'down' if angle > 0 else 'up'}" if np.isfinite(angle) else "-",
                small_mm(seam.mismatch(one.panels)),
            ]
            rows.append((f' data-seam="{len(rows)}"', cells))
    return _table(heads, rows, "seams") if rows else ""


def designs_table(designs: Sequence[Json]) -> str:
    """Return the table of designs, with what was measured."""
    heads = ("design", "copies", "parts", "parts per m²", "distance, mean mm", "largest mm")
    more = ("allowed mm", "strain %, largest", "smallest bend radius mm", "seam mismatch mm")
    rows = [
        '<div class="wide"><table><tr>',
        *(f"<th>{head(h)}</th>" for h in (*heads, *more, "verdict")),
        "</tr>",
    ]
    for one in designs:
        strain = one.get("strain_max")
        cells = [
            escape(one["name"]),
            str(len(one["copies"])),
            str(len(one.get("parts", []))),
            number(one.get("parts_per_m2")),
            *(small_mm(one.get(k)) for k in ("deviation_mean", "deviation_max", "allowed")),
            number(None if strain is None else 100 * strain),
            small_mm(one.get("bend_radius_min")),
            small_mm(one.get("seam_mismatch_max")),
            _verdict(one["reasons"]),
        ]
        rows.append("<tr>" + "".join(f"<td>{c}</td>" for c in cells) + "</tr>")
    return "".join([*rows, "</table></div>"])


def _table(heads: Sequence[str], rows: Sequence[tuple[str, list[str]]], kind: str) -> str:
    """Return a table that the page can sort; rows have attributes and cells."""
    lines = [f'<div class="wide"><table class="sortable {kind}"><thead><tr>']
    lines += [f"<th>{head(words)}</th>" for words in heads]
    lines.append("</tr></thead><tbody>")
    lines += [f"<tr{more}>{''.join(map(_cell, cells))}</tr>" for more, cells in rows]
    return "".join([*lines, "</tbody></table></div>"])


def _cell(content: str) -> str:
    """Return a cell; one that is a length or an area has the number itself."""
    alone = re.fullmatch(r"<span (data-mm[^>]*)>([^<]*)</span>", content)
    return f"<td>{content}</td>" if alone is None else f"<td {alone[1]}>{alone[2]}</td>"


def _linked(name: str, address: Callable[[str], str]) -> str:
    return f'<a href="{escape(address(name))}">{escape(name)}</a>'


def _verdict(reasons: Sequence[Json]) -> str:
    if not reasons:
        return '<span class="good">yes</span>'
    return f'<span class="bad">no: {escape(codes(reasons))}</span>'

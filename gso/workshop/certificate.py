"""The certificate: what was made, measured against what was asked."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from types import MappingProxyType

import numpy as np

from gso.io.json_file import plain
from gso.mesh import Mesh
from gso.typing import Array, Json
from gso.workshop.nesting import Nested
from gso.workshop.panels import Panel
from gso.workshop.part import Drawing, Part
from gso.workshop.parts import Fitted
from gso.workshop.traced_guides import is_curved

#: Entries of a record that are lengths, in the mesh's unit.
_LENGTHS = (
    "diagonal",
    "size",
    "allowed",
    "deviation_mean",
    "deviation_max",
    "bend_radius_min",
    "seam_gap",
    "thickness",
)
#: Square millimetres of a square metre.
_SQUARE_METRE = 1e6
_PACKAGES = ("gso", "numpy", "scipy", "shapely", "ezdxf", "spyrrow")


def codes(reasons: Sequence[Json]) -> str:
    """Return the codes of a record's reasons, each once."""
    return ", ".join(dict.fromkeys(reason["code"] for reason in reasons))


def digest(mesh: Mesh) -> str:
    """Return the SHA-256 of a mesh's vertices and faces."""
    out = hashlib.sha256()
    for array in (mesh.vertices.astype("<f8"), mesh.faces.astype("<i8")):
        out.update(repr(array.shape).encode())
        out.update(np.ascontiguousarray(array).tobytes())
    return out.hexdigest()


@cache
def versions() -> Mapping[str, str]:
    """Return the versions of Python and of the packages that matter."""
    out = {"python": platform.python_version()}
    for name in _PACKAGES:
        try:
            out[name] = version(name)
        except PackageNotFoundError:
            continue
    return MappingProxyType(out)


def design_record(fitted: Fitted, parts: Sequence[Part], copies: Sequence[str]) -> Json:
    """Describe one design and its parts, in millimetres.

    Parameters
    ----------
    fitted : Fitted
    parts : sequence of Part
        Its parts, one of each panel.
    copies : sequence of str
        Names of the designs that are made the same, itself included.
    """
    made, panels, scale = fitted.made, fitted.panels, fitted.scale
    own = dict(made.record)
    for name in _LENGTHS:
        if own.get(name) is not None:
            own[name] = scale * own[name]
    if "deviation_at" in own:
        own["deviation_at"] = [scale * x for x in own["deviation_at"]]
    if "area" in own:
        own["area"] = scale**2 * own["area"]
    mismatch = [seam.mismatch(panels) for seam in made.matings]
    worst = int(np.argmax(mismatch)) if mismatch else -1
    own |= {
        "name": made.name,
        "copies": list(copies),
        "seams": len(made.matings),
        "seam_mismatch_max": mismatch[worst] if mismatch else 0.0,
        "seam_mismatch_at": made.matings[worst].number if mismatch else None,
        "parts": [
            part_record(panel, part)
            | {"joined": [{"seam": s.number, "to": made.panels[o].name} for s, o in made.mates(k)]}
            for k, (panel, part) in enumerate(zip(panels, parts, strict=True))
        ],
    }
    if own.get("area", 0.0) > 0.0:
        own["parts_per_m2"] = len(parts) / (own["area"] / _SQUARE_METRE)
    record: Json = plain(own)
    return record


def part_record(panel: Panel, part: Part) -> Json:
    """Describe one part, in millimetres: its size as it is drawn."""
    wide, high = part.size
    angles = np.degrees(np.abs(panel.angles))
    return {
        "name": part.name,
        "count": part.count,
        "length": wide,
        "width": high,
        "area": part.area,
        "holes": len(part.holes),
        "bends": len(part.bends),
        "bend_angle_max": float(angles.max(initial=0.0)),
        "bend_radius_min": float(panel.radii.min(initial=np.inf)),
        "curved": bool(part.guides) or (not len(panel.bends) and is_curved(panel)),
        "guide_lines": len(part.guides),
        "guide_angle_max": float(np.degrees(max((g.angle for g in part.guides), default=0.0))),
        "zones": [
            {
                "kind": zone.kind,
                "bent_by": "press" if zone.pressed else "roll",
                "radius_min": zone.least,
                "radius_max": zone.most,
                "angle": float(np.degrees(zone.angle)),
                "text": zone.in_words(),
            }
            for zone in part.zones
        ],
        "faces": list(part.faces),
        "notches": len(part.notches),
        "chord": chord(part.outline),
    }


def add_sheets(records: Sequence[Json], sheets: Sequence[Drawing]) -> None:
    """Add to the record of each part the numbers of its sheets, in order: one for each copy.

    Copies of parts that are alike are given out in the order of their records.

    Parameters
    ----------
    records : sequence of dict
        Of designs, whose parts have ``count`` and ``same_as``; they are changed.
    sheets : sequence of Drawing
        The first one has the number 1.

    Examples
    --------
    >>> square = Part("a", np.zeros((4, 2)))
    >>> parts = [{"name": "a", "same_as": None, "count": 1},
    ...          {"name": "b", "same_as": "a", "count": 2}]
    >>> add_sheets([{"parts": parts}], [Drawing((square, square)), Drawing((square,))])
    >>> [part["sheets"] for part in parts]
    [[1], [1, 2]]
    """
    numbers: dict[str, list[int]] = {}
    for number, drawing in enumerate(sheets, start=1):
        for part in drawing.parts:
            numbers.setdefault(part.name, []).append(number)
    for record in records:
        for entry in record.get("parts", ()):
            free = numbers.get(entry["same_as"] or entry["name"], [])
            entry["sheets"] = free[: entry["count"]]
            del free[: entry["count"]]


def nesting_record(nested: Nested, spacing: float, sheet: tuple[float, float]) -> Json:
    """Describe sheets with parts in their places; lengths are in millimetres."""
    return {
        "sheets": [{"utilisation": share} for share in nested.utilisation],
        "nesting": plain(
            {
                "method": nested.method,
                "density": nested.density,
                "spacing": spacing,
                "sheet": list(sheet),
                "notes": list(nested.notes),
            }
        ),
    }


def chord(outline: Array) -> float:
    """Estimate how far a polygon is from the smooth curve through its points.

    Corners of more than 30 degrees count as corners of the curve.

    >>> turn = np.linspace(0, 2 * np.pi, 101)[:-1]
    >>> circle = 50.0 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    >>> round(chord(circle), 3)
    0.025
    """
    way = np.roll(outline, -1, axis=0) - outline
    size = np.linalg.norm(way, axis=1)
    angle = np.arctan2(way[:, 1], way[:, 0])
    turn = np.abs((np.diff(angle, prepend=angle[-1]) + np.pi) % (2.0 * np.pi) - np.pi)
    smooth = np.where(turn < np.radians(30.0), turn, 0.0)
    at_ends = np.maximum(smooth, np.roll(smooth, -1))
    return float((size * at_ends / 8.0).max(initial=0.0))

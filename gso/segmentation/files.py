"""Files of a design in pieces: the pieces, their patterns, the table."""

from __future__ import annotations

import json
import math
import os
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gso import io
from gso.errors import MeshError
from gso.mesh import Mesh
from gso.mesh.attributes import Attributes, Labels

if TYPE_CHECKING:
    from gso.segmentation.found import Segmentation


def save(found: Segmentation, folder: str | PathLike[str], unit: str = "mm") -> list[str]:
    """Write the files of :meth:`Segmentation.save`, and return their names."""
    from gso.segmentation.found import whole_pattern

    place = Path(os.fsdecode(folder))
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MeshError(f"{place}: {error.strerror}") from None
    names = ["pieces.obj"]
    io.write(grouped(found), place / names[0])
    if any(sheet is not None for sheet in found.sheets):
        mesh, flat = whole_pattern(found)
        names.append("patterns.svg")
        io.save_flat(flat, mesh, place / names[-1], unit=unit)
    for number, sheet in enumerate(found.sheets):
        if sheet is not None:
            names.append(f"pattern_{found.name(number)}.svg")
            io.save_flat(sheet.flat, sheet.mesh, place / names[-1], unit=unit)
    names.append("pieces.json")
    with io.replacing(place / names[-1]) as file:
        file.write(json.dumps(record(found, unit), indent=2).encode() + b"\n")
    return names


def grouped(found: Segmentation) -> Mesh:
    """Return the whole surface with a group of faces (``g``) for each piece."""
    order = np.argsort(found.of_face, kind="stable")
    names = tuple(found.name(k) for k in range(len(found)))
    labels = {"g": Labels(names, found.of_face[order])}
    design = found.design
    return Mesh(design.vertices, design.faces[order], attributes=Attributes(labels=labels))


def record(found: Segmentation, unit: str) -> dict[str, Any]:
    """Return metrics, reasons, notes and the table as JSON-compatible values."""
    return {
        "unit": unit,
        "usable": found.usable,
        "metrics": _plain(found.metrics),
        "reasons": list(found.reasons),
        "notes": list(found.notes),
        "pieces": [_plain(row) for row in found.table()],
        "seams": [
            {"between": [found.name(a), found.name(b)], "length": length}
            for (a, b), length in found.seams().items()
        ],
        "alike": [[found.name(k) for k in group] for group in found.alike() if len(group) > 1],
        "seconds": found.seconds,
    }


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    """Replace numbers that JSON lacks by None."""
    return {
        k: v if isinstance(v, str) else (float(v) if math.isfinite(v) else None)
        for k, v in values.items()
    }

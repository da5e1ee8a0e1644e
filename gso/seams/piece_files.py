"""Files of a design in pieces: the pieces, their patterns, the table."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gso import io
from gso.errors import MeshError
from gso.io.json_file import plain, write_json
from gso.mesh import Attributes, Labels, Mesh
from gso.typing import AnyPath, Json

#: Names of files that an earlier call may have left.
_PATTERN = re.compile(r"pattern(s|_[\w.-]+)\.svg")

if TYPE_CHECKING:
    from gso.seams.segmentation import Segmentation


def save(found: Segmentation, folder: AnyPath, unit: str = "mm") -> list[str]:
    """Write the files of :meth:`Segmentation.save`, and return their names."""
    from gso.seams.segmentation import whole_pattern

    place = Path(os.fsdecode(folder))
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MeshError(f"{place}: {error.strerror}") from None
    earlier = _written(place)
    names = ["pieces.obj"]
    io.write(grouped(found), place / names[0])
    if any(sheet is not None for sheet in found.sheets):
        mesh, flat, bends = whole_pattern(found)
        names.append("patterns.svg")
        io.save_flat(flat, mesh, place / names[-1], unit=unit, bends=bends)
    for number, sheet in enumerate(found.sheets):
        if sheet is not None:
            names.append(f"pattern_{_spelled(found.name(number))}.svg")
            bends = sheet.folded.lines(sheet.flat)
            io.save_flat(sheet.flat, sheet.mesh, place / names[-1], unit=unit, bends=bends)
    names.append("pieces.json")
    known = record(found, unit) | {"files": names}
    write_json(place / names[-1], known)
    for name in earlier - set(names):
        (place / name).unlink(missing_ok=True)
    return names


def _written(folder: Path) -> set[str]:
    """Return the patterns that an earlier call wrote to a folder, by its record."""
    try:
        files = json.loads((folder / "pieces.json").read_text(encoding="utf-8"))["files"]
        return {name for name in files if _PATTERN.fullmatch(name)}
    except (OSError, ValueError, KeyError, TypeError):
        return set()


def _spelled(name: str) -> str:
    """Return a piece's name as a part of a file's name."""
    return re.sub(r"[^\w.-]+", "_", name)


def grouped(found: Segmentation) -> Mesh:
    """Return the whole surface with a group of faces (``g``) for each piece."""
    order = np.argsort(found.of_face, kind="stable")
    names = tuple(found.name(k) for k in range(len(found)))
    labels = {"g": Labels(names, found.of_face[order])}
    design = found.design
    return Mesh(design.vertices, design.faces[order], attributes=Attributes(labels=labels))


def record(found: Segmentation, unit: str) -> Json:
    """Return metrics, reasons, notes and the table as JSON-compatible values."""
    return {
        "unit": unit,
        "usable": found.usable,
        "metrics": plain(found.metrics),
        "reasons": [reason.record(unit) for reason in found.reasons],
        "notes": list(found.notes),
        "pieces": [plain(row) for row in found.table()],
        "seams": [
            {"between": [found.name(a), found.name(b)], "length": length}
            for (a, b), length in found.seams().items()
        ],
        "alike": [[found.name(k) for k in group] for group in found.alike() if len(group) > 1],
        "seconds": found.seconds,
    }

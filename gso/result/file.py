"""Results in files: NumPy archives of arrays and a JSON record."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gso.cut_pieces import Pieces
from gso.errors import MeshError
from gso.mesh import Mesh
from gso.mesh.attributes import Attributes
from gso.mesh.cut import Cut
from gso.pattern import Pattern
from gso.result.result import Result
from gso.spline import BSplineSurface
from gso.status import Progress, Status
from gso.typing import AnyPath, Array, Ints, Json

#: Arrays of any type by name.
Arrays: TypeAlias = dict[str, NDArray[Any]]

_FORMAT = 1
_PATTERN = ("flat", "faces", "vertex", "seams")


def _record(result: Result) -> Json:
    """Collect everything but the arrays, as JSON-compatible values."""
    return {
        "format": _FORMAT,
        "task": result.task,
        "formulation": result.formulation,
        "status": result.status.name,
        "iterations": result.iterations,
        "energy": result.energy,
        "seconds": result.seconds,
        "backend": result.backend,
        "device": "cpu",
        "warm_start": result.warm_start,
        "notes": list(result.notes),
        "reasons": list(result.reasons),
        "details": result.details,
        "metrics": result.metrics,
        "history": [asdict(p) for p in result.history],
        "components": [_record(part) for part in result.components],
    }


def arrays(result: Result) -> Arrays:
    """Return everything of a result as arrays by name; the record is JSON."""
    record = _record(result)
    out: Arrays = {
        "record": np.frombuffer(json.dumps(record, default=float).encode(), np.uint8),
        "design": result.design.vertices,
        "vertices": result.mesh.vertices,
        "faces": result.design.faces,
    }
    if result.ruled is not None:
        out |= result.ruled.arrays()
        out["vertices"] = result.ruled.moved
    if result.flat is not None:
        out["flat"] = result.flat
    own = result.pattern is not None and result.pattern.flat is not result.flat
    if result.pattern is not None and own and result.ruled is None:
        out |= {f"pattern_{name}": getattr(result.pattern, name) for name in _PATTERN}
    if result.cell_scale is not None:
        out["cell_scale"] = result.cell_scale
    if result.spline is not None:
        out |= result.spline.arrays()
    if result.pieces is not None:
        out |= _pieces_arrays(result.pieces)
    if result.components:
        label = np.full(len(result.design.vertices), -1)
        for number, part in enumerate(result.components):
            label[part.names] = number
        out["component"] = label
    if result.design.attributes is not None:
        out |= result.design.attributes.arrays()
    return out


def _pieces_arrays(pieces: Pieces) -> Arrays:
    return {
        "pieces_design": pieces.design.vertices,
        "pieces_faces": pieces.design.faces,
        "pieces_vertex": pieces.opened.vertex,
        "pieces_seams": pieces.opened.seams,
        "pieces_names": np.frombuffer(json.dumps(pieces.names).encode(), np.uint8),
    }


def _read_pieces(data: Arrays, opened: Mesh) -> Pieces | None:
    if "pieces_design" not in data:
        return None
    vertex, seams = data["pieces_vertex"].astype(np.int64), data["pieces_seams"].astype(np.int64)
    count = len(opened.vertices)
    good = vertex.shape == (count,) and seams.shape[1:] == (2, 2)
    if not good or not ((seams >= 0) & (seams < count)).all():
        raise MeshError("the seams do not fit the surface")
    design = Mesh(data["pieces_design"], data["pieces_faces"])
    if not ((vertex >= 0) & (vertex < len(design.vertices))).all():
        raise MeshError("the seams do not fit the design")
    names = tuple(map(str, json.loads(data["pieces_names"].tobytes())))
    surface = opened.replaced(design.vertices[vertex])
    return Pieces(design, Cut(surface, vertex, seams), names)


def read(path: AnyPath) -> Result:
    """Read a result; see :meth:`gso.Result.load`."""
    from gso.io.arrays import read_arrays
    from gso.io.source import read_bytes
    from gso.ruled.ruled_surface import RuledSurface

    try:
        data = read_arrays(read_bytes(path))
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None
    try:
        record = json.loads(data["record"].tobytes())
        if record["format"] != _FORMAT:
            raise MeshError(f"{path} was written by another version (format {record['format']})")
        said = Attributes.from_arrays(data, data["faces"])
        design = Mesh(data["design"], data["faces"], attributes=said)
        pattern = None if "ruled_faces" in data else _pattern(data, design)
        same = len(data["vertices"]) == len(design.vertices)
        result = _read(
            record,
            design,
            design.replaced(data["vertices"]) if same or pattern is None else pattern.mesh,
            None if "ruled_faces" in data else _read_array(data, "flat", (len(design.vertices), 2)),
            _read_array(data, "cell_scale", (len(design.faces),)),
            pattern,
        )
        result.ruled = RuledSurface.from_arrays(data, result.mesh.vertices)
        if result.ruled is not None:
            result.mesh, result.pattern = result.ruled.mesh, result.ruled.pattern
            result.flat = None if result.pattern.is_cut else result.pattern.flat
        result.spline = BSplineSurface.from_arrays(data)
        result.pieces = _read_pieces(data, design)
        label = _read_array(data, "component", (len(design.vertices),))
        if label is not None:
            _divide(result, record.get("components", []), label.astype(np.int64))
    except (KeyError, TypeError, ValueError) as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"{path} is no result of gso: {error}") from None
    return result


def _read(
    record: Json,
    design: Mesh,
    mesh: Mesh,
    flat: Array | None,
    cell_scale: Array | None,
    pattern: Pattern | None = None,
) -> Result:
    """Build a result from its record and arrays."""
    result = Result(
        record["task"],
        record["formulation"],
        design,
        mesh,
        flat,
        Status[record["status"]],
        record["iterations"],
        record["energy"],
        [Progress(**p) for p in record["history"]],
        record["seconds"],
        record["backend"],
        record["warm_start"],
        tuple(record["notes"]),
        record["details"],
        cell_scale=cell_scale,
        pattern=pattern,
        # Files of earlier versions have none.
        reasons=tuple(record.get("reasons", ())),
    )
    result.__dict__["metrics"] = record["metrics"]
    return result


def _divide(result: Result, records: list[Json], label: Ints) -> None:
    """Restore the component results from the arrays of the whole mesh."""
    from gso.components import split

    for record, piece in zip(records, split(result.design, label), strict=True):
        part = _read(
            record,
            piece.mesh,
            piece.of(result.mesh),
            None if result.flat is None else result.flat[piece.vertices],
            None if result.cell_scale is None else result.cell_scale[piece.faces],
        )
        part.names = piece.vertices
        result.components.append(part)


def _pattern(data: Arrays, design: Mesh) -> Pattern | None:
    """Read and check the pattern that a file stores besides the flat image; None without one."""
    if "pattern_flat" not in data:
        return None
    flat, faces, vertex, seams = (data[f"pattern_{name}"] for name in _PATTERN)
    count = len(flat)
    fits = flat.shape == (count, 2) and vertex.shape == (count,) and seams.shape[1:] == (2, 2)
    kept = faces >= 0
    if not fits or faces.shape != design.faces.shape or (kept != (design.faces >= 0)).any():
        raise ValueError("the arrays of the pattern do not fit each other")
    for name, ids, end in (
        ("faces", faces[kept], count),
        ("vertex", vertex, len(design.vertices)),
        ("seams", seams, count),
    ):
        if ids.dtype.kind not in "iu" or (ids.size and not 0 <= ids.min() <= ids.max() < end):
            raise ValueError(f"pattern_{name} points outside")
    if (vertex[faces[kept]] != design.faces[kept]).any():
        raise ValueError("the pattern's vertices are not those of the surface's faces")
    return Pattern(flat, faces, vertex, seams)


def _read_array(data: Arrays, name: str, shape: tuple[int, ...]) -> Array | None:
    """Return an array of a file after checking its shape; None if the file has none."""
    array = data.get(name)
    if array is not None and array.shape != shape:
        raise ValueError(f"{name} is an array {array.shape}, not {shape}")
    return array

"""Results in files: NumPy archives of arrays and a JSON record."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any, TypeAlias

import numpy as np

from gso.cut_pieces import Pieces
from gso.errors import MeshError
from gso.mesh import Attributes, Cut, Mesh
from gso.result.result import Result
from gso.result.strips_result import StripsResult
from gso.spline import BSplineSurface
from gso.status import Progress, Status
from gso.typing import AnyPath, Ints, Json
from gso.verdict.reason import Reason

#: Arrays of any type by name.
Arrays: TypeAlias = dict[str, np.ndarray]

_FORMAT = 3
#: Attributes that a file has as they are.
_PLAIN = ("task", "formulation", "iterations", "energy", "seconds", "backend", "warm_start")
#: Classes of results by their kind.
_KINDS: dict[str, type[Result]] = {kind.KIND: kind for kind in (Result, StripsResult)}


def _record(result: Result) -> Json:
    """Collect everything but the arrays, as JSON-compatible values."""
    return {
        "format": _FORMAT,
        "kind": result.KIND,
        **{name: getattr(result, name) for name in _PLAIN},
        "status": result.status.name,
        "device": "cpu",
        "notes": list(result.notes),
        "reasons": [reason.record() for reason in result.reasons],
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
        "vertices": result.on_design().vertices,
        "faces": result.design.faces,
        **result.arrays(),
    }
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
        "pieces_opened": pieces.opened.mesh.faces,
        "pieces_vertex": pieces.opened.vertex,
        "pieces_seams": pieces.opened.seams,
        "pieces_names": np.frombuffer(json.dumps(pieces.names).encode(), np.uint8),
    }


def _read_pieces(data: Arrays) -> Pieces | None:
    if "pieces_design" not in data:
        return None
    vertex, seams = data["pieces_vertex"].astype(np.int64), data["pieces_seams"].astype(np.int64)
    count = len(vertex)
    if seams.shape[1:] != (2, 2) or not ((seams >= 0) & (seams < count)).all():
        raise MeshError("the seams do not fit the surface")
    design = Mesh(data["pieces_design"], data["pieces_faces"])
    if not ((vertex >= 0) & (vertex < len(design.vertices))).all():
        raise MeshError("the seams do not fit the design")
    names = tuple(map(str, json.loads(data["pieces_names"].tobytes())))
    surface = Mesh(design.vertices[vertex], data["pieces_opened"])
    return Pieces(design, Cut(surface, vertex, seams), names)


def read(path: AnyPath) -> Result:
    """Read a result; see :meth:`gso.Result.load`."""
    from gso.io.arrays import read_arrays
    from gso.io.source import read_bytes

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
        kind = _KINDS[record["kind"]]
        scale = data.get("cell_scale")
        if scale is not None and scale.shape != (len(design.faces),):
            raise ValueError(f"cell_scale is an array {scale.shape}, not one value a face")
        result = _read(record, kind, design, cell_scale=scale, **kind.shape(data, design))
        result.spline = BSplineSurface.from_arrays(data)
        result.pieces = _read_pieces(data)
        label = data.get("component")
        if label is not None:
            if label.shape != (len(design.vertices),):
                raise ValueError(f"component is an array {label.shape}, not one value a vertex")
            _divide(result, record.get("components", []), label.astype(np.int64))
    except (KeyError, TypeError, ValueError) as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"{path} is no result of gso: {error}") from None
    return result


def _read(record: Json, kind: type[Result], design: Mesh, **shape: Any) -> Result:
    """Build a result from its record, and its surface and flat images by attribute."""
    result = kind(
        **{name: record[name] for name in _PLAIN},
        design=design,
        status=Status[record["status"]],
        history=[Progress(**p) for p in record["history"]],
        notes=tuple(record["notes"]),
        details=record["details"],
        reasons=tuple(map(Reason.read, record["reasons"])),
        **shape,
    )
    result.__dict__["metrics"] = record["metrics"]
    return result


def _divide(result: Result, records: list[Json], label: Ints) -> None:
    """Restore the component results from the arrays of the whole mesh."""
    from gso.components import split

    for record, piece in zip(records, split(result.design, label), strict=True):
        part = _read(
            record,
            Result,
            piece.mesh,
            mesh=piece.of(result.mesh),
            flat=None if result.flat is None else result.flat[piece.vertices],
            cell_scale=None if result.cell_scale is None else result.cell_scale[piece.faces],
        )
        part.names = piece.vertices
        result.components.append(part)

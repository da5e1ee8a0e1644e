"""STL, ascii and binary: triangles without connectivity, in single precision."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from gso import geometry
from gso.errors import MeshError
from gso.io.raw_surface import Surface, merged
from gso.io.source import doubles
from gso.io.text import Words
from gso.mesh import Mesh

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEAD = 84


def read(data: bytes) -> Surface:
    """Read the surface in an STL file; vertices with equal coordinates are merged."""
    announced = int.from_bytes(data[80:_HEAD], "little") if len(data) >= _HEAD else -1
    more = len(data) - _HEAD - announced * _RECORD.itemsize
    # Binary files may start with "solid" too; their length identifies them.
    exact = announced >= 0 and more == 0
    if not exact and data.lstrip()[:5].lower() == b"solid" and b"\0" not in data:
        corners = _read_text(data)
    elif len(data) < _HEAD:
        raise MeshError("the STL file is shorter than its header; it is cut off or no STL file")
    elif exact or (more > 0 and announced > 0):
        corners = doubles(np.frombuffer(data, _RECORD, announced, _HEAD)["corners"])
    else:
        raise MeshError(
            f"the STL header announces {announced} triangles, but the file has room for "
            f"{(len(data) - _HEAD) // _RECORD.itemsize}; it is cut off or no STL file"
        )
    if len(corners) == 0:
        raise MeshError("the STL file has no triangles")
    return Surface(*merged(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)))


def _read_text(data: bytes) -> np.ndarray:
    words = Words(data.lower())
    rows = words.rows(b"vertex")
    begun, ended = words.rows(b"facet").size, words.rows(b"endfacet").size
    if not words.rows(b"endsolid").size or begun != ended or rows.size != 3 * begun:
        raise MeshError(
            f"the STL file has {begun} times 'facet', {ended} times 'endfacet' and {rows.size} "
            "vertices, or no 'endsolid'; it is cut off"
        )
    words.refuse(rows, words.count[rows] != 4, "a vertex needs three numbers")
    return words.points(words.first[rows] + 1).reshape(-1, 3, 3)


def write(mesh: Mesh, file: BinaryIO) -> None:
    """Write the triangulated mesh as binary STL, in single precision."""
    corners = mesh.vertices[mesh.triangles]
    if np.abs(corners).max() > np.finfo(np.float32).max:
        raise MeshError("the coordinates are too large for the single precision of STL")
    normal = geometry.area_vectors(mesh.vertices, mesh.triangles)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    table = np.zeros(len(corners), _RECORD)
    table["normal"] = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    table["corners"] = corners
    file.write(b"binary STL".ljust(80, b" ") + len(table).to_bytes(4, "little"))
    file.write(table.tobytes())

"""PLY, ascii and binary: vertices and polygons; quads are kept."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import BinaryIO, NamedTuple

import numpy as np

from gso.errors import MeshError
from gso.io.raw_surface import Surface
from gso.io.source import doubles, face_table, ranges
from gso.io.text import Words
from gso.mesh import Mesh
from gso.typing import Array, Ints

_KINDS = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_CORNERS = ("vertex_indices", "vertex_index")
_HEADER_BYTES = 1 << 20


class _Property(NamedTuple):
    name: str
    kind: str
    count_kind: str | None = None


@dataclass
class _Element:
    name: str
    count: int
    properties: list[_Property]

    @property
    def least_bytes(self) -> int:
        """Size of a row whose lists are empty, in bytes."""
        return sum(int((p.count_kind or p.kind)[1]) for p in self.properties)

    def column(self, *names: str, lists: bool) -> int:
        """Return the position of the property with one of these names."""
        for k, p in enumerate(self.properties):
            if p.name in names and (p.count_kind is not None) == lists:
                return k
        raise MeshError(f"the element {self.name!r} of the PLY header has no {names[0]!r}")


class _Header(NamedTuple):
    order: str | None
    """Byte order, or None for ascii."""
    elements: list[_Element]
    size: int
    lines: int


def read(data: bytes) -> Surface:
    """Read the surface in a PLY file; only coordinates and corners are used."""
    header = _header(data)
    names = [e.name for e in header.elements]
    for name in ("vertex", "face"):
        if names.count(name) != 1 or not header.elements[names.index(name)].count:
            raise MeshError(f"the PLY file has no {name}; export the mesh with vertices and faces")
    header.elements[names.index("vertex")].column("x", lists=False)
    header.elements[names.index("face")].column(*_CORNERS, lists=True)
    if header.order is None:
        points, corners, count = _read_text(data, header)
    else:
        points, corners, count = _read_binary(data, header)
    if (count < 3).any():
        at = int((count < 3).argmax())
        raise MeshError(f"face {at} has {count[at]} corners; delete it")
    outside = (corners < 0) | (corners >= len(points))
    if outside.any():
        face = np.searchsorted(np.cumsum(count), outside.argmax(), side="right")
        raise MeshError(
            f"face {face} refers to vertex {corners[outside.argmax()]}, the last one is "
            f"{len(points) - 1}"
        )
    faces, polygon, notes = face_table(corners, count, points)
    return Surface(points, faces, notes, polygon=polygon)


def _header(data: bytes) -> _Header:
    if not data.startswith((b"ply\n", b"ply\r")):
        raise MeshError("a PLY file starts with the line 'ply', this one does not")
    ending = b"\r\n" if data.startswith(b"ply\r\n") else data[3:4]
    mark = ending + b"end_header"
    end = data.find(mark, 0, _HEADER_BYTES)
    if end < 0:
        raise MeshError("the PLY header does not end with 'end_header'; is the file cut off?")
    lines = data[:end].decode("ascii", "replace").split(ending.decode("ascii"))
    body = data.find(ending, end + len(mark))
    order: str | None = ""
    elements: list[_Element] = []
    for number, line in enumerate(lines[1:], start=2):
        words = line.split()
        try:
            match words:
                case [] | ["comment" | "obj_info", *_]:
                    pass
                case ["format", kind, _]:
                    order = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}[
                        kind
                    ]
                case ["element", name, count] if count.isdecimal():
                    elements.append(_Element(name, int(count), []))
                case ["property", "list", count_kind, kind, name] if _KINDS[count_kind][0] != "f":
                    elements[-1].properties.append(
                        _Property(name, _KINDS[kind], _KINDS[count_kind])
                    )
                case ["property", kind, name]:
                    elements[-1].properties.append(_Property(name, _KINDS[kind]))
                case _:
                    raise KeyError(line)
        except (KeyError, IndexError, ValueError):
            raise MeshError(
                f"line {number}: {line[:60]!r} has no meaning in a PLY header"
            ) from None
    if order == "":
        raise MeshError("the PLY header has no line 'format ascii 1.0' or the like")
    size = body + len(ending) if body >= 0 else len(data)
    return _Header(order, elements, size, len(lines) + 1)


def _cut_off(element: _Element) -> MeshError:
    return MeshError(
        f"the PLY header announces {element.count} of {element.name!r}, but the file ends before; "
        "it is cut off or its header is wrong"
    )


def _read_text(data: bytes, header: _Header) -> tuple[Array, Ints, Ints]:
    words = Words(data[header.size :], first_line=header.lines + 1)
    done = 0
    for element in header.elements:
        if not element.properties:
            continue
        if element.count > words.first.size - done:
            raise _cut_off(element)
        rows = np.arange(done, done + element.count)
        done += element.count
        first, size = words.first[rows], words.count[rows]
        if element.name == "vertex":
            width = len(element.properties)
            if any(p.count_kind for p in element.properties):
                raise MeshError("vertices with lists are not read from PLY text; write it binary")
            wrong = size != width
            said = f"a vertex has {size[wrong.argmax()]} numbers instead of {width}"
            words.refuse(rows, wrong, said)
            columns = np.array([element.column(c, lists=False) for c in "xyz"])
            order = np.argsort(columns)
            found = words.floats((first[:, None] + columns[order]).ravel()).reshape(-1, 3)
            points = np.empty_like(found)
            points[:, order] = found
        elif element.name == "face":
            at = element.column(*_CORNERS, lists=True)
            if any(p.count_kind for p in element.properties[:at]):
                raise MeshError(
                    "faces with other lists before their corners are not read from text"
                )
            words.refuse(rows, size <= at, "a face has no corners")
            count = words.ints(first + at)
            short = (count < 0) | (count > size - at - 1)
            words.refuse(rows, short, "a face has fewer numbers than it announces")
            corners = words.ints(ranges(first + at + 1, count))
    return points, corners, count


def _read_binary(data: bytes, header: _Header) -> tuple[Array, Ints, Ints]:
    position, order = header.size, header.order or "<"
    for element in header.elements:
        if not element.properties:
            continue
        if element.count * element.least_bytes > len(data) - position:
            raise _cut_off(element)
        wanted = None
        if element.name == "face":
            wanted = element.column(*_CORNERS, lists=True)
            if element.properties[wanted].kind[0] == "f":
                raise MeshError("the corners of the PLY file's faces are no whole numbers")
        table = _even_rows(data, position, element, order)
        if table is not None:
            position += table.nbytes
            if wanted is not None:
                corners = table[f"p{wanted}"].astype(np.int64).ravel()
                count = table[f"n{wanted}"].astype(np.int64)
        else:
            start, sizes, position = _uneven_rows(data, position, element, wanted, order)
            if wanted is not None:
                kind = np.dtype(order + element.properties[wanted].kind)
                raw = np.frombuffer(data, np.uint8)[ranges(start, sizes * kind.itemsize)]
                corners, count = raw.view(kind).astype(np.int64), sizes
        if element.name == "vertex":
            if table is None:
                raise MeshError("vertices with lists of different lengths are not read from PLY")
            xyz = [doubles(table[f"p{element.column(c, lists=False)}"]) for c in "xyz"]
            points = np.stack(xyz, axis=1)
    return points, corners, count


def _even_rows(data: bytes, position: int, element: _Element, order: str) -> np.ndarray | None:
    """Read all rows of an element as one table, or return None if list lengths differ."""
    layout: list[tuple[object, ...]] = []
    size = 0
    for k, p in enumerate(element.properties):
        if p.count_kind is None:
            layout.append((f"p{k}", order + p.kind))
            size += int(p.kind[1])
            continue
        kind = np.dtype(order + p.count_kind)
        if element.count == 0 or position + size + kind.itemsize > len(data):
            return None
        length = int(np.frombuffer(data, kind, 1, position + size)[0])
        size += kind.itemsize + length * int(p.kind[1])
        if length < 0 or size * element.count > len(data) - position:
            return None
        layout += [(f"n{k}", kind), (f"p{k}", order + p.kind, (length,))]
    if size * element.count > len(data) - position:
        return None
    table = np.frombuffer(data, np.dtype(layout), element.count, position)
    lists = [k for k, p in enumerate(element.properties) if p.count_kind]
    even = all((table[f"n{k}"] == table[f"p{k}"].shape[1]).all() for k in lists)
    return table if even else None


def _uneven_rows(
    data: bytes, position: int, element: _Element, wanted: int | None, order: str
) -> tuple[Ints, Ints, int]:
    """Walk over rows of varying length; return starts and lengths of the wanted list, and the end.

    All positions are byte offsets in `data`.
    """
    steps = [
        (struct.Struct(f"{order}{_CODES[p.count_kind]}") if p.count_kind else None, int(p.kind[1]))
        for p in element.properties
    ]
    start, sizes = [], []
    try:
        for _ in range(element.count):
            for k, (counter, item) in enumerate(steps):
                if counter is None:
                    position += item
                    continue
                (length,) = counter.unpack_from(data, position)
                position += counter.size
                if k == wanted:
                    start.append(position)
                    sizes.append(length)
                if length < 0:
                    raise _cut_off(element)
                position += length * item
    except struct.error:
        raise _cut_off(element) from None
    if position > len(data):
        raise _cut_off(element)
    return np.array(start, np.int64), np.array(sizes, np.int64), position


_CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I"}


def write(mesh: Mesh, file: BinaryIO) -> None:
    """Write a mesh as binary PLY (little endian, double precision); it reads back exactly."""
    n, m = len(mesh.vertices), len(mesh.faces)
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {n}",
        *(f"property double {c}" for c in "xyz"),
        f"element face {m}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    file.write(("\n".join(header) + "\n").encode("ascii"))
    file.write(mesh.vertices.astype("<f8").tobytes())
    width = mesh.faces.shape[1]
    rows = np.empty(m, np.dtype([("n", "u1"), ("p", "<i4", (width,))]))
    corner = mesh.faces >= 0
    rows["n"] = corner.sum(axis=1)
    rows["p"] = mesh.faces
    used = np.repeat(np.c_[np.ones(m, bool), corner], [1] + [4] * width, axis=1)
    file.write(rows.view(np.uint8).reshape(m, -1)[used].tobytes())

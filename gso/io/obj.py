"""Wavefront OBJ: vertices, polygons (quads are kept), face names and texture coordinates."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from gso.errors import MeshError
from gso.io.raw_surface import Surface
from gso.io.source import face_corners, ranges
from gso.io.text import Words, write_rows
from gso.mesh import Mesh
from gso.mesh.attributes import LABELS, Attributes, Labels
from gso.typing import Array, Ints

# Keywords whose data a mesh cannot store, and what they are called in the notes.
_LEFT_OUT = {
    b"vn": "normals",
    b"vp": "points of curves",
    b"p": "points",
    b"curv": "curves",
    b"surf": "surfaces",
}


def read(data: bytes) -> Surface:
    """Read the surface in an OBJ file.

    The reader uses these lines:

    - ``v x y z``. A single fourth number is a weight that divides the coordinates; further
      numbers are colours and are left out.
    - ``f`` with corners ``1``, ``1/2``, ``1//3`` or ``1/2/3``. Indices count from 1; negative
      ones count back from the last element before the line.
    - ``vt``, ``mtllib``, and the face names of ``o``, ``g``, ``s`` and ``usemtl``.

    Notes list normals, curves and other known content that is left out; :func:`polylines` reads
    the polylines.
    """
    words = Words(data, comment=b"#", joined=True)
    v, f = words.rows(b"v"), words.rows(b"f")
    if v.size == 0:
        raise MeshError("there is no vertex (a line 'v x y z') in it; is it an OBJ file?")
    if f.size == 0:
        raise MeshError("there is no face (a line 'f a b c d') in it; export the mesh's faces")
    points = _vertices(words, v)
    corners, index, count = _polygons(words, v, f)
    place, polygon, notes = face_corners(index, count, points)
    faces = np.where(place < 0, -1, index[place])
    texture, texture_corners, said = _texture(words, f, corners, count)
    if texture_corners is not None:
        texture_corners = np.where(place < 0, -1, texture_corners[place])
    libraries = tuple(filter(None, map(words.rest, words.rows(b"mtllib"))))
    attributes = Attributes(libraries, _labels(words, f, polygon), texture, texture_corners)
    return Surface(
        points,
        faces,
        notes + said + _left_out(words, v),
        None if attributes.empty else attributes,
        polygon,
    )


def _vertices(words: Words, v: Ints) -> Array:
    count = words.count[v] - 1
    short = count < 3
    words.refuse(v, short, f"a vertex needs three numbers, not {count[short.argmax()]}")
    first = words.first[v] + 1
    points = words.points(first)
    weighted = np.flatnonzero(count == 4)
    if weighted.size:
        weight = words.floats(first[weighted] + 3)
        words.refuse(v[weighted], weight == 0, "a vertex has the weight 0")
        with np.errstate(over="ignore"):
            points[weighted] /= weight[:, None]
    return points


def _polygons(words: Words, v: Ints, f: Ints) -> tuple[Ints, Ints, Ints]:
    """Return the words of all corners, their vertex indices, and corner counts of polygons."""
    count = words.count[f] - 1
    short = count < 3
    words.refuse(f, short, f"a face needs three corners or more, not {count[short.argmax()]}")
    corner, index = _vertices_of(words, v, f, "face")
    return corner, index, count


def _vertices_of(words: Words, v: Ints, rows: Ints, what: str) -> tuple[Ints, Ints]:
    """Return the words that refer to vertices in the rows of faces or polylines, and indices."""
    count = words.count[rows] - 1
    corner = ranges(words.first[rows] + 1, count)
    number = words.ints(corner, until=b"/")
    index = _from_front(number, v, rows, count)
    outside = (index < 0) | (index >= v.size)
    if outside.any():
        at = int(outside.argmax())
        words.fail(
            corner[at],
            f"a {what} refers to vertex {number[at]}, but "
            + ("vertices count from 1" if number[at] == 0 else f"the file has {v.size} vertices")
            + "; is the file cut off?",
        )
    return corner, index


def _from_front(number: Ints, rows: Ints, f: Ints, count: Ints) -> Ints:
    """Convert OBJ indices of the face rows `f` (from 1, or negative) to indices from 0.

    `rows` are the rows that define the elements referred to; `count` has the corners per face.
    """
    before = np.repeat(np.searchsorted(rows, f), count)
    return np.where(number < 0, before + number, number - 1)


def _texture(
    words: Words, f: Ints, corner: Ints, count: Ints
) -> tuple[Array | None, Ints | None, tuple[str, ...]]:
    """Return texture coordinates, their index for each corner (or -1), and notes on errors."""
    vt = words.rows(b"vt")
    if vt.size == 0:
        return None, None, ()
    try:
        width = words.count[vt] - 1
        most = int(width.max())
        words.refuse(vt, (width < 1) | (width > 3), "texture coordinates are one to three numbers")
        texture = np.zeros((vt.size, most))
        inside = np.arange(most) < width[:, None]
        texture[inside] = words.floats(ranges(words.first[vt] + 1, width))
        number = words.second_ints(corner, b"/")
        index = np.where(number == 0, -1, _from_front(number, vt, f, count))
        outside = (number != 0) & ((index < 0) | (index >= vt.size))
        if outside.any():
            at = int(outside.argmax())
            words.fail(
                corner[at],
                f"a face refers to texture coordinates {number[at]}, but the file has {vt.size}",
            )
    except MeshError as error:
        return None, None, (f"the texture coordinates (vt) were left out: {error}",)
    return (texture, index, ()) if (index >= 0).any() else (None, None, ())


def _labels(words: Words, f: Ints, polygon: Ints) -> dict[str, Labels]:
    """Return the names of the faces, by keyword."""
    labels = {}
    for keyword in LABELS:
        rows = words.rows(keyword.encode())
        which = np.searchsorted(rows, f) - 1
        said, of_face = np.unique(which, return_inverse=True)
        if said[-1] < 0:
            continue
        # Names without faces are left out.
        named = said[said >= 0]
        names = tuple(words.rest(row) for row in rows[named])
        labels[keyword] = Labels(names, (of_face.ravel() - (said[0] < 0))[polygon])
    return labels


def _left_out(words: Words, v: Ints) -> tuple[str, ...]:
    found = {keyword.decode(): words.rows(keyword).size for keyword in _LEFT_OUT}
    parts = [
        f"{size} {_LEFT_OUT[keyword.encode()]} ({keyword})"
        for keyword, size in found.items()
        if size
    ]
    if (words.count[v] > 5).any():
        parts.append("colours of vertices")
    out = (f"left out: {', '.join(parts)}",) if parts else ()
    lines = words.rows(b"l").size
    said = f"{lines} polylines (l): gso unfold and gso fabricate cut along them"
    return (*out, said) if lines else out


def polylines(data: bytes) -> list[Array]:
    """Return the points (k, 3) of each polyline (``l``) in an OBJ file."""
    words = Words(data, comment=b"#", joined=True)
    v, rows = words.rows(b"v"), words.rows(b"l")
    if not (rows.size and v.size):
        return []
    _, index = _vertices_of(words, v, rows, "polyline")
    ends = np.cumsum(words.count[rows] - 1)[:-1]
    return np.split(_vertices(words, v)[index], ends)


def write(mesh: Mesh, file: BinaryIO) -> None:
    """Write a mesh as OBJ; coordinates, face names and texture coordinates read back exactly."""
    said = mesh.attributes or Attributes()
    for name in said.libraries:
        _write_name(file, "mtllib", name)
    write_rows(file, "v %.17g %.17g %.17g\n", mesh.vertices)
    corners = said.texture_corners if said.texture is not None else None
    if said.texture is not None and corners is not None:
        write_rows(file, "vt" + " %.17g" * said.texture.shape[1] + "\n", said.texture)
    number = np.where(mesh.faces < 0, -1, mesh.faces + 1)
    formats, values = _face_formats(number, corners)
    begin = 0
    for end in (*_changes(said).tolist(), len(number)):
        if end > begin:
            write_rows(file, formats[begin:end], values[begin:end])
        if end < len(number):
            _write_changed(file, said, end)
        begin = end


def _face_formats(number: Ints, corners: Ints | None) -> tuple[list[str], Ints]:
    """Return one printf format per face, and its numbers; negative ones are padding."""
    size = (number >= 0).sum(axis=1)
    if corners is None:
        plain = {3: "f %d %d %d\n", 4: "f %d %d %d %d\n"}
        return [plain[k] for k in size.tolist()], number
    codes = np.where(number < 0, 0, 1 + (corners >= 0))
    kinds, which = np.unique(codes, axis=0, return_inverse=True)
    words = ("", " %d", " %d/%d")
    texts = ["f" + "".join(words[c] for c in kind) + "\n" for kind in kinds.tolist()]
    values = np.stack([number, np.where(corners < 0, -1, corners + 1)], axis=-1)
    return [texts[k] for k in which.ravel().tolist()], values.reshape(len(number), -1)


def _changes(said: Attributes) -> Ints:
    """Return the faces before which a face name changes."""
    every = [np.flatnonzero(np.diff(k.of_face, prepend=-1)) for k in said.labels.values()]
    return np.unique(np.concatenate(every)) if every else np.empty(0, np.int64)


def _write_changed(file: BinaryIO, said: Attributes, face: int) -> None:
    for keyword in LABELS:
        names = said.labels.get(keyword)
        if names is None:
            continue
        now = int(names.of_face[face])
        if now >= 0 and (face == 0 or now != names.of_face[face - 1]):
            _write_name(file, keyword, names.names[now])


def _write_name(file: BinaryIO, keyword: str, name: str) -> None:
    file.write(f"{keyword} {name}".rstrip().encode("utf-8", "surrogateescape") + b"\n")

"""OFF (Object File Format): vertices and polygons as text; quads are kept."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import BinaryIO, NamedTuple, NoReturn

import numpy as np

from gso.errors import MeshError
from gso.io.raw_surface import Surface
from gso.io.source import face_table, ranges
from gso.io.text import Words, write_rows
from gso.mesh import Mesh
from gso.typing import Ints

#: Additional numbers of a vertex, by the letters before OFF; colours have four or three.
_MORE = {b"ST": (2,), b"C": (4, 3), b"N": (3,)}
#: Possible lengths of a face's colour, tried where line breaks do not delimit the faces.
_COLOURS = (0, 3, 4, 1)


def read(data: bytes) -> Surface:
    """Read the surface in a text OFF file, without colours, normals and texture coordinates.

    Line breaks may be anywhere. If every vertex and face begins a line, the rest of its line
    is ignored. Otherwise vertices have as many numbers as the keyword (such as ``CNOFF``)
    announces, and the colours of all faces have the same length.
    """
    words = Words(data, comment=b"#")
    if words.first.size == 0:
        raise MeshError("there is nothing but comments in it")
    head = re.fullmatch(rb"((?:ST)?C?N?)OFF(\d{0,18})", words.raw(0).upper())
    if head is None:
        words.fail(0, f"an OFF file in three dimensions starts with OFF, not {words.quote(0)}")
    if words.start.size > 1 and words.raw(1).upper() == b"BINARY":
        words.fail(1, "binary OFF is not read; write the file as text")
    n, m, body = _counts(words, head[2])
    if n + m > words.start.size - body:
        _fail_counts(words, body, n, m, "has too few numbers for that")
    widths = [3]
    for letters in re.findall(rb"ST|C|N", head[1]):
        widths = [w + more for w in widths for more in _MORE[letters]]
    v, f, size = _found(words, body, n, m, widths)
    points = words.points(v)
    corner = ranges(f + 1, size)
    index = words.ints(corner)
    outside = (index < 0) | (index >= n)
    if outside.any():
        at = int(outside.argmax())
        words.fail(corner[at], f"a face refers to vertex {index[at]}, the last one is {n - 1}")
    faces, polygon, notes = face_table(index, size, points)
    return Surface(points, faces, notes, polygon=polygon)


def _counts(words: Words, glued: bytes) -> tuple[int, int, int]:
    """Return the numbers of vertices and faces, and the first word after the counts.

    `glued` is the vertex count where the file has no space after the keyword, else empty.
    """
    first = 0 if glued else 1
    if words.start.size < first + 2:
        words.fail(0, "the numbers of vertices and faces are missing; is the file cut off?")
    n = int(glued) if glued else int(words.ints(np.array([first]))[0])
    m = int(words.ints(np.array([first + 1]))[0])
    if min(n, m) < 0:
        words.fail(first, f"{n} vertices and {m} faces are announced: the file is damaged")
    body = first + 2
    # The number of edges is optional. A word on a new line with more numbers is a vertex.
    row = words.row(np.array([body - 1, min(body, words.start.size - 1)]))
    if row[0] == row[1] or words.count[row[1]] == 1:
        body = min(body + 1, words.start.size)
    return n, m, body


def _found(words: Words, body: int, n: int, m: int, widths: list[int]) -> tuple[Ints, Ints, Ints]:
    """Locate the first words of the vertices and faces, and the corner counts of the faces."""
    row = int(words.row(np.array([body]))[0])
    fresh = words.first[row] == body
    rows = np.arange(row, words.first.size) if fresh else np.empty(0, np.int64)
    lined = rows.size >= n + m
    begins: list[tuple[Ints, int]] = []
    if lined and (words.count[rows[:n]] >= 3).all():
        v, f = words.first[rows[:n]], words.first[rows[n : n + m]]
        size = words.ints_or(f, -1)
        if ((size >= 3) & (size < words.count[rows[n : n + m]])).all():
            return v, f, size
        begins.append((v, int(words.first[rows[n]])) if m else (v, words.start.size))
    for width in widths:
        if body + n * width <= words.start.size:
            begins.append((body + width * np.arange(n), body + n * width))
    walks = [(v, walk) for v, place in begins for walk in _walks(words, place, m)]
    whole = [(v, walk) for v, walk in walks if walk.fits]
    if whole:
        # Of several consistent readings, prefer one whose corner indices are valid.
        v, walk = next((x for x in whole if _inside(words, x[1], n)), whole[0])
        return v, walk.faces, walk.size
    if lined:
        words.refuse(rows[:n], words.count[rows[:n]] < 3, "a vertex needs three numbers")
    if not walks:
        _fail_counts(words, body, n, m, "ends before the last vertex")
    # Line breaks locate the faces if there are enough lines.
    walk = walks[0][1] if lined else max((w for _, w in walks), key=lambda w: w.good)
    if walk.good >= m:
        words.fail(walk.faces[-1], "more numbers follow the last face than a colour has")
    at = int(walk.faces[walk.good])
    if at >= words.start.size:
        _fail_counts(words, body, n, m, f"ends before face {walk.good}")
    corners = int(words.ints(np.array([at]))[0])
    words.fail(at, f"a face with {corners} corners needs as many numbers, >= 3")


class _Walk(NamedTuple):
    """One reading of the faces in sequence.

    `faces` and `size` hold the first word and the corner count of each face, `good` is the
    number of leading faces that are valid, `fits` tells whether this reading is consistent.
    """

    faces: Ints
    size: Ints
    good: int
    fits: bool


def _walks(words: Words, begin: int, m: int) -> Iterator[_Walk]:
    """Yield readings of the faces: each face begins a line, or has a colour of fixed length."""
    count = words.start.size
    size = words.ints_or(np.arange(count), -1)
    last = np.arange(count) + np.where((size >= 3) & (size < count), size, count)
    sound = np.append(last < count, False)
    ends = np.append(words.first[1:], count)
    after_line = ends[words.row(np.minimum(last, count - 1))]
    for colour in (None, *_COLOURS):
        after = after_line if colour is None else np.minimum(last + 1 + colour, count)
        jump = np.append(np.where(sound[:-1], after, count), count)
        # Pointer jumping: each step doubles the number of faces found.
        faces, twice = np.array([begin]), jump
        while faces.size < m + 1:
            faces = np.concatenate([faces, twice[faces]])
            twice = twice[twice]
        faces, end = faces[:m], int(faces[m])
        good = sound[faces]
        number = m if good.all() else int(good.argmin())
        whole = number == m and (colour is None or end == count)
        yield _Walk(faces, np.append(size, 0)[faces], number, whole)


def _inside(words: Words, walk: _Walk, n: int) -> bool:
    index = words.ints_or(ranges(walk.faces + 1, walk.size), -1)
    return bool(((index >= 0) & (index < n)).all())


def _fail_counts(words: Words, body: int, n: int, m: int, why: str) -> NoReturn:
    words.fail(
        min(body, words.start.size) - 1,
        f"{n} vertices and {m} faces are announced, but the file {why}; it is cut off",
    )


def write(mesh: Mesh, file: BinaryIO) -> None:
    """Write a mesh as OFF; coordinates read back exactly."""
    file.write(f"OFF\n{len(mesh.vertices)} {len(mesh.faces)} 0\n".encode("ascii"))
    write_rows(file, "%.17g %.17g %.17g\n", mesh.vertices)
    tri, quad = "3 %d %d %d\n", "4 %d %d %d %d\n"
    if mesh.is_triangles:
        write_rows(file, tri, mesh.faces)
    else:
        write_rows(file, np.where(mesh.faces[:, 3] < 0, tri, quad).tolist(), mesh.faces)

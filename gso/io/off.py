"""OFF, the Object File Format: vertices and polygons as text, quads kept as quads."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import BinaryIO, NamedTuple, NoReturn

import numpy as np

from gso.io.source import Ints, face_table, ranges
from gso.io.surface import Surface
from gso.io.text import Words, write_rows
from gso.mesh import Mesh
from gso.status import MeshError

#: Numbers of a vertex besides its coordinates, by the letters before OFF; colours may have
#: three numbers or four.
_MORE = {b"ST": (2,), b"C": (4, 3), b"N": (3,)}
#: Numbers of the colour behind a face's corners, where lines do not tell.
_COLOURS = (0, 3, 4, 1)


def read(data: bytes) -> Surface:
    """Surface in a text OFF file; colours, normals and texture coordinates are left out.

    Numbers may be broken into lines anywhere. Where every vertex and face begins a line,
    whatever stands behind it on the line is left out; elsewhere vertices have the numbers
    that the keyword announces, and all faces have equally many numbers of a colour.
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
    points = words.floats((v[:, None] + np.arange(3)).ravel()).reshape(-1, 3)
    corner = ranges(f + 1, size)
    index = words.ints(corner)
    outside = (index < 0) | (index >= n)
    if outside.any():
        at = int(outside.argmax())
        words.fail(corner[at], f"a face refers to vertex {index[at]}, the last one is {n - 1}")
    faces, notes = face_table(index, size, points)
    return Surface(points, faces, notes)


def _counts(words: Words, glued: bytes) -> tuple[int, int, int]:
    """Numbers of vertices and faces, and the first word behind the counts.

    Some programs write no space behind the keyword.
    """
    first = 0 if glued else 1
    if words.start.size < first + 2:
        words.fail(0, "the numbers of vertices and faces are missing; is the file cut off?")
    n = int(glued) if glued else int(words.ints(np.array([first]))[0])
    m = int(words.ints(np.array([first + 1]))[0])
    if min(n, m) < 0:
        words.fail(first, f"{n} vertices and {m} faces are announced: the file is damaged")
    body = first + 2
    # The number of edges follows, unless a vertex does: on another line, with more numbers.
    row = words.row(np.array([body - 1, min(body, words.start.size - 1)]))
    if row[0] == row[1] or words.count[row[1]] == 1:
        body = min(body + 1, words.start.size)
    return n, m, body


def _found(words: Words, body: int, n: int, m: int, widths: list[int]) -> tuple[Ints, Ints, Ints]:
    """First words of the vertices and of the faces, and the corners of the faces."""
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
        # Of several ways to read it, one whose corners are vertices.
        v, walk = next((x for x in whole if _inside(words, x[1], n)), whole[0])
        return v, walk.faces, walk.size
    if lined and (words.count[rows[:n]] < 3).any():
        words.fail_row(rows[(words.count[rows[:n]] < 3).argmax()], "a vertex needs three numbers")
    if not walks:
        _fail_counts(words, body, n, m, "ends before the last vertex")
    # The lines say where faces begin, if there are enough of them.
    walk = walks[0][1] if lined else max((w for _, w in walks), key=lambda w: w.good)
    if walk.good >= m:
        words.fail(walk.faces[-1], "more numbers follow the last face than a colour has")
    at = int(walk.faces[walk.good])
    if at >= words.start.size:
        _fail_counts(words, body, n, m, f"ends before face {walk.good}")
    corners = int(words.ints(np.array([at]))[0])
    words.fail(at, f"a face with {corners} corners needs as many numbers, >= 3")


class _Walk(NamedTuple):
    """Faces, one behind the other: their first words and sizes, how many are sound, and all."""

    faces: Ints
    size: Ints
    good: int
    fits: bool


def _walks(words: Words, begin: int, m: int) -> Iterator[_Walk]:
    """Go from face to face: each begins a line, or has a colour of a fixed length."""
    count = words.start.size
    size = words.ints_or(np.arange(count), -1)
    last = np.arange(count) + np.where((size >= 3) & (size < count), size, count)
    sound = np.append(last < count, False)
    ends = np.append(words.first[1:], count)
    after_line = ends[words.row(np.minimum(last, count - 1))]
    for colour in (None, *_COLOURS):
        after = after_line if colour is None else np.minimum(last + 1 + colour, count)
        jump = np.append(np.where(sound[:-1], after, count), count)
        # Twice as many faces with every step.
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

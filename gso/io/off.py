"""OFF, the Object File Format: vertices and polygons as text, quads kept as quads."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from gso.io.source import face_table, ranges
from gso.io.surface import Surface
from gso.io.text import Words, write_rows
from gso.mesh import Mesh
from gso.status import MeshError


def read(data: bytes) -> Surface:
    """Surface in a text OFF file; colours, normals and texture coordinates are ignored."""
    words = Words(data, comment=b"#")
    if words.first.size == 0:
        raise MeshError("there is nothing but comments in it")
    head = words.raw(0)
    if not head.endswith(b"OFF") or head[:-3].strip(b"STCN"):
        words.fail(0, f"an OFF file in three dimensions starts with OFF, not {words.quote(0)}")
    # The counts stand behind the keyword or on the next line.
    here = words.count[0] > 1
    body = 1 if here else 2
    if words.first.size < body or words.count[body - 1] - here < 2:
        words.fail(0, "the numbers of vertices and faces are missing; is the file cut off?")
    counts = words.first[body - 1] + int(here) + np.arange(2)
    n, m = words.ints(counts).tolist()
    rows = np.arange(body, words.first.size)
    if min(n, m) < 0 or n + m > rows.size:
        words.fail(
            counts[0],
            f"{n} vertices and {m} faces are announced, but {rows.size} lines follow; "
            "the file is cut off",
        )
    v, f = rows[:n], rows[n : n + m]
    if (words.count[v] < 3).any():
        words.fail_row(v[(words.count[v] < 3).argmax()], "a vertex needs three numbers")
    points = words.floats((words.first[v][:, None] + np.arange(3)).ravel()).reshape(-1, 3)
    size = words.ints(words.first[f])
    bad = (size < 3) | (size >= words.count[f])
    if bad.any():
        words.fail_row(
            f[bad.argmax()], f"a face with {size[bad.argmax()]} corners needs as many numbers, >= 3"
        )
    corner = ranges(words.first[f] + 1, size)
    index = words.ints(corner)
    outside = (index < 0) | (index >= n)
    if outside.any():
        at = int(outside.argmax())
        words.fail(corner[at], f"a face refers to vertex {index[at]}, the last one is {n - 1}")
    faces, notes = face_table(index, size, points)
    return Surface(points, faces, notes)


def write(mesh: Mesh, file: BinaryIO) -> None:
    """Write a mesh as OFF; coordinates read back exactly."""
    file.write(f"OFF\n{len(mesh.vertices)} {len(mesh.faces)} 0\n".encode("ascii"))
    write_rows(file, "%.17g %.17g %.17g\n", mesh.vertices)
    tri, quad = "3 %d %d %d\n", "4 %d %d %d %d\n"
    if mesh.is_triangles:
        write_rows(file, tri, mesh.faces)
    else:
        write_rows(file, np.where(mesh.faces[:, 3] < 0, tri, quad).tolist(), mesh.faces)

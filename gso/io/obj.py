"""Wavefront OBJ: vertices and polygons, quads kept as quads."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from gso.io.source import Array, Ints, face_table, ranges
from gso.io.text import Words, write_rows
from gso.mesh import Mesh
from gso.status import MeshError


def read(data: bytes) -> Mesh:
    """Mesh in an OBJ file.

    Read are ``v x y z`` (a fourth number is a weight by which the others are divided;
    more numbers are colours and ignored) and ``f`` with any of ``1``, ``1/2``, ``1//3``,
    ``1/2/3``, counted from the front or, when negative, from the last vertex before the
    line. Groups, objects, normals, textures, materials and curves are ignored.
    """
    words = Words(data, comment=b"#", joined=True)
    v, f = words.rows(b"v"), words.rows(b"f")
    if v.size == 0:
        raise MeshError("there is no vertex (a line 'v x y z') in it; is it an OBJ file?")
    if f.size == 0:
        raise MeshError("there is no face (a line 'f a b c d') in it; export the mesh's faces")
    points = _vertices(words, v)
    corners, count = _polygons(words, v, f)
    faces, notes = face_table(corners, count, points)
    return Mesh(points, faces, notes=notes)


def _vertices(words: Words, v: Ints) -> Array:
    count = words.count[v] - 1
    if (count < 3).any():
        row = v[(count < 3).argmax()]
        words.fail_row(row, f"a vertex needs three numbers, not {words.count[row] - 1}")
    first = words.first[v] + 1
    points = words.floats((first[:, None] + np.arange(3)).ravel()).reshape(-1, 3)
    weighted = np.flatnonzero(count == 4)
    if weighted.size:
        weight = words.floats(first[weighted] + 3)
        if (weight == 0).any():
            words.fail_row(v[weighted[(weight == 0).argmax()]], "a vertex has the weight 0")
        points[weighted] /= weight[:, None]
    return points


def _polygons(words: Words, v: Ints, f: Ints) -> tuple[Ints, Ints]:
    count = words.count[f] - 1
    if (count < 3).any():
        row = f[(count < 3).argmax()]
        words.fail_row(row, f"a face needs three corners or more, not {words.count[row] - 1}")
    corner = ranges(words.first[f] + 1, count)
    number = words.ints(corner, until=b"/")
    before = np.repeat(np.searchsorted(v, f), count)
    index = np.where(number < 0, before + number, number - 1)
    outside = (index < 0) | (index >= v.size)
    if outside.any():
        at = int(outside.argmax())
        words.fail(
            corner[at],
            f"a face refers to vertex {number[at]}, but "
            + ("vertices count from 1" if number[at] == 0 else f"the file has {v.size} vertices")
            + "; is the file cut off?",
        )
    return index, count


def write(mesh: Mesh, file: BinaryIO) -> None:
    """Write a mesh as OBJ; coordinates read back exactly."""
    write_rows(file, "v %.17g %.17g %.17g\n", mesh.vertices)
    tri, quad = "f %d %d %d\n", "f %d %d %d %d\n"
    number = np.where(mesh.faces < 0, -1, mesh.faces + 1)
    if mesh.is_triangles:
        write_rows(file, tri, number)
    else:
        write_rows(file, np.where(number[:, 3] < 0, tri, quad).tolist(), number)

"""Quad meshes with irregular vertices on the upper body of the Utah teapot.

Source of the shape: the teapot, Martin E. Newell, PhD thesis, University of Utah, 1975
(see ``teapot.py``). Source of the connectivity: three steps of Edwin Catmull and James
Clark, "Recursively generated B-spline surfaces on arbitrary topological meshes",
Computer-Aided Design 10(6), 1978, on a coarse triangle mesh. The first step makes three
quads of each triangle and leaves a vertex of valence 3 in its middle, while the inner
vertices of the triangle mesh keep their valence of 5 or 6.

The subdivision runs on a cylinder; each vertex is then put on the teapot at its angle and
height. The band of the body between its widest girth and the mouth is curved both ways,
and yet a cone fits it within one percent of its size.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import teapot
from _sheets import edges_of
from _write import Faces, Points, parser, write_obj

UPPER_BODY = 4
STEPS = 3


def with_hole() -> tuple[Points, Faces]:
    """Mesh the whole band: a ring, the hole of which is the mouth of the pot.

    Returns
    -------
    vertices : ndarray, (n, 3)
    faces : ndarray, (m, 4)
        Anticlockwise seen from outside; two boundary loops.
    """
    points, faces = _ring_of_triangles((12, 17, 13))
    return _on_teapot(*_subdivide(points, faces, np.array([], np.int64)))


def disk() -> tuple[Points, Faces]:
    """Mesh the half of the band with x > 0, which is the side of the spout.

    Returns
    -------
    vertices : ndarray, (n, 3)
    faces : ndarray, (m, 4)
        Anticlockwise seen from outside; one boundary loop.
    """
    points, faces = _strip_of_triangles((7, 10, 8), -np.pi / 2, np.pi / 2)
    top, bottom = np.flatnonzero(points[:, 2] == 0), np.flatnonzero(points[:, 2] == 1)
    corners = np.array([top[0], top[-1], bottom[0], bottom[-1]])
    return _on_teapot(*_subdivide(points, faces, corners))


def disk_with_hole() -> tuple[Points, Faces]:
    """Cut a hole into :func:`disk`: the faces round its middle vertex, three rings deep.

    Returns
    -------
    vertices : ndarray, (n, 3)
    faces : ndarray, (m, 4)
        Anticlockwise seen from outside; two boundary loops.
    """
    points, faces = disk()
    inside = np.zeros(len(points), bool)
    inside[np.linalg.norm(points - points.mean(axis=0), axis=1).argmin()] = True
    for _ in range(3):
        cut = inside[faces].any(axis=1)
        inside[faces[cut]] = True
    used, number = np.unique(faces[~cut], return_inverse=True)
    return points[used], number.reshape(-1, 4)


def _strip_of_triangles(counts: tuple[int, ...], start: float, stop: float) -> tuple[Points, Faces]:
    """Triangulate rows of segments on the unit cylinder, row 0 at z = 0, the last at z = 1."""
    angles = [np.linspace(start, stop, n + 1) for n in counts]
    depth = np.repeat(np.linspace(0.0, 1.0, len(counts)), [len(a) for a in angles])
    angle = np.concatenate(angles)
    points = np.stack([np.cos(angle), np.sin(angle), depth], axis=-1)
    first = np.cumsum([0, *(len(a) for a in angles)])
    faces = [
        face
        for row, (m, n) in enumerate(pairwise(counts))
        for face in _zip_rows(int(first[row]), m, int(first[row + 1]), n)
    ]
    return points, np.array(faces)


def _zip_rows(a: int, m: int, b: int, n: int) -> list[tuple[int, int, int]]:
    """Triangles between m segments from vertex `a` on and n segments from `b` on."""
    faces = []
    i = j = 0
    while i < m or j < n:
        if j == n or (i < m and (i + 1) * n <= (j + 1) * m):
            faces.append((a + i, b + j, a + i + 1))
            i += 1
        else:
            faces.append((a + i, b + j, b + j + 1))
            j += 1
    return faces


def _ring_of_triangles(counts: tuple[int, ...]) -> tuple[Points, Faces]:
    """Close the strip by merging the last vertex of each row with the first."""
    points, faces = _strip_of_triangles(counts, 0.0, 2 * np.pi)
    last = np.cumsum([n + 1 for n in counts]) - 1
    merged = np.arange(len(points))
    merged[last] -= np.array(counts)
    kept, number = np.unique(merged, return_inverse=True)
    return points[kept], number[faces]


def _subdivide(points: Points, faces: Faces, corners: Faces) -> tuple[Points, Faces]:
    # A step keeps the numbers of the vertices it starts from, so corners stay valid.
    for _ in range(STEPS):
        points, faces = catmull_clark(points, faces, corners)
    return points, faces


def catmull_clark(points: Points, faces: Faces, corners: Faces) -> tuple[Points, Faces]:
    """One step of Catmull and Clark (1978), with a cubic B-spline along the boundary.

    Parameters
    ----------
    points : ndarray, (n, d)
    faces : ndarray, (m, k)
        Faces with k corners each, of an oriented manifold.
    corners : ndarray of int
        Vertices that stay where they are.

    Returns
    -------
    points : ndarray
        The old vertices first, then one per edge, then one per face.
    faces : ndarray, (m k, 4)
    """
    n = len(points)
    edges, edge_of_side = edges_of(faces)
    inner = np.bincount(edge_of_side.ravel()) == 2

    centre = points[faces].mean(axis=1)
    middle = points[edges].mean(axis=1)
    beside = _scatter(edge_of_side.ravel(), np.repeat(centre, faces.shape[1], axis=0), len(edges))
    on_edge = np.where(inner[:, None], middle / 2 + beside / 4, middle)

    valence = np.bincount(edges.ravel(), minlength=n)[:, None]
    mean_face = _scatter(faces.ravel(), np.repeat(centre, faces.shape[1], axis=0), n) / valence
    mean_edge = _scatter(edges.ravel(), np.repeat(middle, 2, axis=0), n) / valence
    moved = (mean_face + 2 * mean_edge + (valence - 3) * points) / valence

    rim = edges[~inner]
    rim_middles = _scatter(rim.ravel(), np.repeat(middle[~inner], 2, axis=0), n)
    on_rim = np.unique(rim)
    moved[on_rim] = points[on_rim] / 2 + rim_middles[on_rim] / 4
    moved[corners] = points[corners]

    to_next, from_last = n + edge_of_side, n + np.roll(edge_of_side, 1, axis=1)
    in_face = np.broadcast_to(n + len(edges) + np.c_[np.arange(len(faces))], faces.shape)
    quads = np.stack([faces, to_next, in_face, from_last], axis=-1)
    return np.concatenate([moved, on_edge, centre]), quads.reshape(-1, 4)


def _scatter(index: Faces, values: Points, size: int) -> Points:
    total = np.zeros((size, values.shape[1]))
    np.add.at(total, index, values)
    return total


def _on_teapot(points: Points, faces: Faces) -> tuple[Points, Faces]:
    """Put each vertex on the upper body at its angle and at its height on the cylinder."""
    # Patches 4 to 7 follow each other clockwise from +x, a quarter turn each. An angle a
    # rounding error short of +x gives 4.0, which is the far end of the last patch.
    turn = np.mod(-np.arctan2(points[:, 1], points[:, 0]) / (np.pi / 2), 4.0)
    quarter = np.minimum(turn.astype(int), 3)
    on_body = np.empty((len(points), 3))
    for q in range(4):
        here = quarter == q
        on_body[here] = teapot.point(UPPER_BODY + q, points[here, 2], turn[here] - q)
    return on_body, faces


def main() -> None:
    """Write the meshes as OBJ quads."""
    args = parser(__doc__, "irregular").parse_args()
    title = "Upper body of the Utah teapot (Newell 1975), irregular quads"
    write_obj(args.out / "with_hole.obj", *with_hole(), title)
    write_obj(args.out / "disk.obj", *disk(), title)
    write_obj(args.out / "disk_with_hole.obj", *disk_with_hole(), title)


if __name__ == "__main__":
    main()

"""OBJ files, grid faces and command lines for the example scripts."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
Faces = NDArray[np.int64]


def parser(doc: str, name: str) -> argparse.ArgumentParser:
    """Parser with the first line of a docstring, and ``-o``: a place in examples/out."""
    found = argparse.ArgumentParser(description=doc.splitlines()[0])
    default = Path(__file__).resolve().parent / "out" / name
    found.add_argument("-o", "--out", type=Path, default=default)
    return found


def grid_faces(height: int, width: int) -> Faces:
    """Quads (i, j), (i+1, j), (i+1, j+1), (i, j+1) of a grid numbered row by row.

    >>> grid_faces(2, 2)
    array([[0, 2, 3, 1]])
    """
    v = np.arange(height * width).reshape(height, width)
    corners = (v[:-1, :-1], v[1:, :-1], v[1:, 1:], v[:-1, 1:])
    return np.stack([c.ravel() for c in corners], axis=1)


def write_obj(
    path: Path, vertices: Points, faces: Faces, title: str, groups: Sequence[str] = ()
) -> None:
    """Write a mesh as OBJ, six decimals, with `title` as its first comment.

    Folders that are missing are made.

    Parameters
    ----------
    path : Path
    vertices : ndarray, (n, 3)
    faces : ndarray, (m, k)
        Vertex indices from 0.
    title : str
    groups : sequence of str
        Group of each face, if they have any; faces of a group follow each other.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    # Adding 0.0 turns -0.0 into 0.0, so that symmetric shapes give tidy files.
    rounded = np.round(vertices, 6) + 0.0
    lines = [f"# {title}"]
    lines += ["v " + " ".join(f"{c:.6f}" for c in p) for p in rounded]
    last = None
    for face, group in zip_longest(faces, groups):
        if group != last:
            lines.append(f"g {group}")
            last = group
        lines.append("f " + " ".join(str(i + 1) for i in face))
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def write_grid(path: Path, points: Points, title: str) -> None:
    """Write an (h, w, 3) grid as an OBJ file of quads."""
    write_obj(path, points.reshape(-1, 3), grid_faces(*points.shape[:2]), title)

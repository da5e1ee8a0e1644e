"""OBJ files and grid faces for the example scripts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def grid_faces(height: int, width: int) -> NDArray[np.int64]:
    """Quads (i, j), (i+1, j), (i+1, j+1), (i, j+1) of a grid numbered row by row.

    >>> grid_faces(2, 2)
    array([[0, 2, 3, 1]])
    """
    v = np.arange(height * width).reshape(height, width)
    corners = (v[:-1, :-1], v[1:, :-1], v[1:, 1:], v[:-1, 1:])
    return np.stack([c.ravel() for c in corners], axis=1)


def write_obj(
    path: Path, vertices: NDArray[np.float64], faces: NDArray[np.int64], title: str
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
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    # Adding 0.0 turns -0.0 into 0.0, so that symmetric shapes give tidy files.
    rounded = np.round(vertices, 6) + 0.0
    lines = [f"# {title}"]
    lines += ["v " + " ".join(f"{c:.6f}" for c in p) for p in rounded]
    lines += ["f " + " ".join(str(i + 1) for i in f) for f in faces]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def write_grid(path: Path, points: NDArray[np.float64], title: str) -> None:
    """Write an (h, w, 3) grid as an OBJ file of quads."""
    write_obj(path, points.reshape(-1, 3), grid_faces(*points.shape[:2]), title)

"""Faces that are inverted beside a seam, which is no fold of one piece."""

from __future__ import annotations

import numpy as np

from gso import faults
from gso.geometry import quad_area_vectors
from gso.mesh.topology import four_corners
from gso.result import Result
from gso.typing import Ints


def inverted_at_seams(result: Result) -> Ints:
    """Return the faces with reversed normals that at a seam lie on the neighbouring piece.

    A sharp edge between two pieces alone is no fold, such as the rim of a thin shell.

    Parameters
    ----------
    result : Result
        A joint solve with its pieces.
    """
    if result.pieces is None:
        raise ValueError("a result without pieces has no seams")
    folds = np.setdiff1d(faults.folded(result.pieces.design), faults.folded(result.mesh))
    corners = four_corners(result.mesh.faces[folds])
    before, after = (
        quad_area_vectors(mesh.vertices, corners) for mesh in (result.design, result.mesh)
    )
    return np.asarray(folds[np.einsum("fd,fd->f", before, after) < 0.0])

"""Types of arrays and of input, as annotations name them; shapes are in the docstrings."""

from __future__ import annotations

from os import PathLike
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


class Polyhedron(Protocol):
    """A surface with vertices and faces: :class:`gso.Mesh`, ``trimesh.Trimesh``."""

    @property
    def vertices(self) -> ArrayLike:
        """Coordinates, (n, 3)."""

    @property
    def faces(self) -> ArrayLike:
        """Vertices of each face."""


#: What :func:`gso.as_mesh` takes: a mesh, a grid of points, vertices and faces, or a file.
MeshLike: TypeAlias = "Polyhedron | ArrayLike | tuple[ArrayLike, ArrayLike] | PathLike[str]"

"""A mesh from whatever a user has."""

from __future__ import annotations

import os
import sys
from typing import Any

import numpy as np

from gso.mesh import Mesh
from gso.status import MeshError


def as_mesh(x: Any) -> Mesh:
    """Mesh from a mesh, a grid of points, vertices and faces, or a file.

    Parameters
    ----------
    x : Mesh, array_like (H, W, 3), (vertices, faces), trimesh.Trimesh, str or PathLike
        A `Mesh` comes back as it is.

    Returns
    -------
    Mesh

    Raises
    ------
    MeshError
        `x` is none of these, or its geometry is refused (see :class:`gso.Mesh`).

    Examples
    --------
    >>> as_mesh(([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]))
    Mesh(4 vertices, 1 faces, quads)
    """
    if isinstance(x, Mesh):
        return x
    if isinstance(x, (str, bytes, os.PathLike)):
        from gso.io import load

        return load(os.fsdecode(x))
    # Whoever holds a Trimesh has imported trimesh: no need to do it here.
    trimesh = sys.modules.get("trimesh")
    if trimesh is not None and isinstance(x, trimesh.Trimesh):
        return Mesh(x.vertices, x.faces)
    if trimesh is not None and isinstance(x, trimesh.Scene):
        raise MeshError("a trimesh.Scene is no single mesh; give scene.to_mesh()")
    if isinstance(x, (tuple, list)) and len(x) == 2:
        return Mesh(*x)
    try:
        points = np.asarray(x)
    except (TypeError, ValueError):
        points = np.empty(0, object)
    if points.ndim == 3 and points.shape[2] == 3 and points.dtype.kind in "iuf":
        return Mesh.from_grid(points)
    what = f"an array {points.shape}" if points.dtype.kind in "iuf" else f"{type(x).__name__}"
    raise MeshError(
        f"{what} is no surface: give a Mesh, an array (H, W, 3), a pair (vertices, faces), a "
        "trimesh.Trimesh, or the path of a mesh file"
    )

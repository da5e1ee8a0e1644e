"""Meshes as grids, the input of nets, and results back at their vertices."""

from __future__ import annotations

import numpy as np

from gso.errors import MeshError
from gso.mesh import Mesh
from gso.net.catalogue import SIZE
from gso.net.tasks import NetTask
from gso.parametrization import Patch, as_patch
from gso.typing import Array


def grid_of(mesh: Mesh, task: NetTask) -> tuple[Array, Patch | None]:
    """Return the grid (H, W, 3) of a mesh, or that of the patch to which it is resampled.

    Raises
    ------
    MeshError
        The mesh is no grid and cannot be resampled to one, or the task takes only grids.
    """
    if mesh.grid is not None:
        return mesh.grid, None
    if task.noisy:
        raise MeshError("denoising nets take grids, and this mesh is none")
    patch = as_patch(mesh, SIZE)
    return patch.grid, patch


def at_vertices(mesh: Mesh, grid: Array, patch: Patch | None, values: Array) -> Array:
    """Return a net's result at the vertices of a mesh, (n, 3), or (n, 2) for a flat image.

    Vertices without a face keep their positions, or are at the origin of a flat image.

    Parameters
    ----------
    mesh : Mesh
    grid, patch
        What :func:`grid_of` returned for it.
    values : ndarray, (H, W, 3) or (H, W, 2)
        The net's result for the grid.
    """
    surface = values.shape[-1] == 3
    points = mesh.vertices.copy() if surface else np.zeros((len(mesh.vertices), 2))
    if patch is None:
        points[mesh.grid_index] = values
    elif surface:
        points[patch.vertices] += patch.at_vertices(values - grid)
    else:
        points[patch.vertices] = patch.at_vertices(values)
    return points

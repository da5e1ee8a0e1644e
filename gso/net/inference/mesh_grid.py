"""Meshes as grids, the input of nets, and results back at their vertices."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from gso.errors import MeshError
from gso.mesh import Mesh
from gso.net.catalogue import SIZE
from gso.net.inference.harm import harmless
from gso.net.tasks import NetTask
from gso.parametrization import Patch, as_patch
from gso.typing import Array

#: Share of the curvature after the harmonic map below which the result by the flat image is taken.
#: It fills less of its grid, so that vertices move farther where both are as good.
_CLEARLY = 0.8


def predicted(mesh: Mesh, task: NetTask, ask: Callable[[Array], Array], guarded: bool) -> Array:
    """Return a net's result at the vertices of a mesh, (n, 3), or (n, 2) for a flat image.

    A mesh that is no grid is resampled to one by a harmonic map. Surfaces are also resampled by
    their flat image, whose result is taken where it leaves clearly less curvature. Vertices
    without a face keep their positions, or are at the origin of a flat image.

    Parameters
    ----------
    mesh : Mesh
    task : NetTask
    ask : callable
        Returns the result (H, W, 3) or (H, W, 2) for a grid (H, W, 3), without a guard.
    guarded : bool
        Whether the result may do no harm; see :func:`gso.net.predict`.

    Raises
    ------
    MeshError
        The mesh is no grid and cannot be resampled to one, or the task takes only grids.
    """
    found = []
    for grid, patch in _grids(mesh, task):
        values = ask(grid)
        points = mesh.vertices.copy() if not task.flat else np.zeros((len(mesh.vertices), 2))
        if patch is None:
            points[mesh.grid_index] = values
        elif task.flat:
            points[patch.vertices] = patch.at_vertices(values)
        else:
            points[patch.vertices] += patch.at_vertices(values - grid)
        found.append(points)
    if task.harm is None:
        return found[0]
    harm = task.harm

    def harm_of(points: Array) -> tuple[float, ...]:
        return harm(mesh.replaced(points))

    best = found[0]
    if len(found) > 1 and harm_of(found[1])[0] < _CLEARLY * harm_of(best)[0]:
        best = found[1]
    return harmless(mesh.vertices, best, harm_of) if guarded else best


def _grids(mesh: Mesh, task: NetTask) -> Iterator[tuple[Array, Patch | None]]:
    """Yield the grid of a mesh, or those of the patches to which it is resampled."""
    if mesh.grid is not None:
        yield mesh.grid, None
        return
    if task.noisy:
        raise MeshError("denoising nets take grids, and this mesh is none")
    why, none = None, True
    for flat in (False,) if task.flat else (False, True):
        try:
            patch = as_patch(mesh, SIZE, flat=flat)
        except MeshError as error:
            why = error
            continue
        none = False
        yield patch.grid, patch
    if none and why is not None:
        raise MeshError(str(why))

"""Meshes with fewer triangles."""

from __future__ import annotations

import numpy as np

from gso import faults, metrics
from gso.mesh import Mesh, Nearest
from gso.mesh.topology import neighbour_means

#: Rounds in which folded triangles are smoothed, and the one from which their neighbours move too.
_ROUNDS, _WIDER = 20, 4


def decimated(mesh: Mesh, count: int) -> Mesh:
    """Return a mesh of about `count` triangles that lies close to another; that one if it fails.

    Edges are collapsed where quadrics say that it changes the surface least. Triangles that this
    folds onto their neighbours are smoothed.

    Source: Garland and Heckbert 1997, Surface simplification using quadric error metrics.

    Parameters
    ----------
    mesh : Mesh
    count : int

    Examples
    --------
    >>> x, y = np.meshgrid(np.linspace(0, 1, 33), np.linspace(0, 1, 33), indexing="ij")
    >>> light = decimated(Mesh.from_grid(np.dstack([x, y, x * y])), 200)
    >>> len(light.faces) <= 200, bool(light.vertices[:, 2].max() > 0.99)
    (True, True)
    """
    import igl

    triangles = mesh.triangles
    if len(triangles) <= count:
        return mesh
    found = igl.qslim(
        np.ascontiguousarray(mesh.vertices), np.ascontiguousarray(triangles, np.int64), int(count)
    )
    # Some versions return first whether `count` was reached.
    points, faces = [x for x in found if isinstance(x, np.ndarray)][:2]
    if not len(faces):
        return mesh
    return _unfolded(Mesh(points, faces), Nearest(mesh), mesh)


def within(mesh: Mesh, distance: float, count: int) -> tuple[Mesh, float]:
    """Decimate to `count` triangles, or to more where these lie farther away than a distance.

    Returns
    -------
    light : Mesh
    away : float
        The largest distance between both surfaces, both ways; 0 where nothing was gained.
    """
    while 2 * count <= len(mesh.triangles):
        light = decimated(mesh, count)
        far = metrics.largest_distance(mesh, light)
        if light is not mesh and far <= distance:
            return light, far
        count *= 2
    return mesh, 0.0


def _unfolded(light: Mesh, surface: Nearest, original: Mesh) -> Mesh:
    """Smooth folded triangles on the surface; return the original if they stay."""
    faces, n = light.triangles, len(light.vertices)
    free = light.used.copy()
    free[light.edges[light.boundary_edges].ravel()] = False
    mean = neighbour_means(light.edges, n)
    points = light.vertices.copy()
    for number in range(_ROUNDS):
        bad = faults.folded(light)
        if not len(bad):
            return light
        moved = np.zeros(n, bool)
        moved[faces[bad]] = True
        if number >= _WIDER:
            moved |= mean @ moved > 0
        k = np.flatnonzero(moved & free)
        points[k] = 0.5 * points[k] + 0.5 * surface.locate(mean[k] @ points)[2]
        light = light.replaced(points)
    return original

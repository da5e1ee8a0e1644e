"""Planes by which a surface is nearly its own mirror image."""

from __future__ import annotations

import numpy as np

from gso import geometry
from gso.geometry.vectors import unit
from gso.mesh import Mesh, Nearest
from gso.typing import Array

#: Number of angles at which planes are tried, and of the best of them that are refined, up to an
#: angle in radians.
_ANGLES, _MOST, _FINE = 48, 4, 1e-4
#: Largest mean distance of a surface from its mirror image, relative to its size.
_SAME = 0.01
#: Number of points whose images are measured.
_POINTS = 400


def mirror_lines(mesh: Mesh) -> list[Array]:
    """Find the planes through a surface's mean normal that mirror it, the best first.

    Meshes need not correspond: distances of mirrored points from the surface are measured.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    list of ndarray, (3,)
        Unit vectors: for each plane, the direction in it that is perpendicular to the mean
        normal. None for surfaces without a mean normal, such as tubes.

    Examples
    --------
    >>> u, v = np.mgrid[-1:1:9j, -2:2:17j]
    >>> (line,) = mirror_lines(Mesh.from_grid(np.stack([u, v, 0.3 * u * u * v], axis=-1)))
    >>> bool(abs(line[0]) < 1e-3)
    True
    """
    from scipy.optimize import minimize_scalar

    normals = geometry.area_vectors(mesh.vertices, mesh.triangles)
    area = np.linalg.norm(normals, axis=1)
    total = normals.sum(axis=0)
    if np.linalg.norm(total) < 0.1 * area.sum():
        return []
    middle = np.average(mesh.vertices[mesh.triangles].mean(axis=1), axis=0, weights=area)
    up = unit(total)
    one = unit(np.cross(up, np.eye(3)[np.abs(up).argmin()]))
    two = np.cross(up, one)
    used = mesh.vertices[mesh.used]
    points = used[:: max(len(used) // _POINTS, 1)] - middle
    near = Nearest(mesh)

    def away(angle: float) -> float:
        across = np.cos(angle) * one + np.sin(angle) * two
        mirrored = points - 2.0 * (points @ across)[:, None] * across
        return float(near.nearest(mirrored + middle)[1].mean())

    step = np.pi / _ANGLES
    angles = step * np.arange(_ANGLES)
    far = np.array([away(angle) for angle in angles])
    low = np.flatnonzero((far < np.roll(far, 1)) & (far <= np.roll(far, -1)))
    found = []
    for k in low[np.argsort(far[low], kind="stable")][:_MOST]:
        around = (angles[k] - step, angles[k] + step)
        best = minimize_scalar(away, bounds=around, method="bounded", options={"xatol": _FINE})
        if best.fun <= _SAME * mesh.size:
            found.append((float(best.fun), float(best.x)))
    return [np.sin(angle) * one - np.cos(angle) * two for _, angle in sorted(found)]

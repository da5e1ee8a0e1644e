"""Proofs that an image of a mesh in the plane covers no point twice, without testing pairs."""

from __future__ import annotations

import numpy as np

from gso.faults.boxes import overlapping
from gso.mesh import Mesh
from gso.typing import Array, Flags

#: Relative distance up to which a point counts as on a line.
_ON = 1e-12
#: Directions that are tried.
_TRIES = 8


def simple_boundary(mesh: Mesh, flat: Array) -> bool:
    """Tell whether an image with anticlockwise triangles certainly covers no point twice.

    The number of triangles over a point is then the sum of the winding numbers of the boundary
    loops around it. If no loop meets itself or another, these are 0 or 1 for loops that run
    anticlockwise and 0 or -1 for the others, as around holes. So at most one triangle covers each
    point if the anticlockwise loops are apart.

    Parameters
    ----------
    mesh : Mesh
        Its connectivity is used.
    flat : ndarray, (n, 2)
        The image, all of whose triangles have positive area.

    Returns
    -------
    bool
        False also where it is not certain, as where the boundary touches itself.

    Examples
    --------
    >>> mesh = Mesh.from_grid(np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))]))
    >>> simple_boundary(mesh, mesh.vertices[:, :2])
    True
    """
    loops = mesh.boundary_loops
    after = [np.roll(loop, -1) for loop in loops]
    ids = np.stack([np.concatenate(loops), np.concatenate(after)])
    p, q = flat[ids]
    pairs = overlapping(np.minimum(p, q), np.maximum(p, q))
    apart = (ids[:, None, pairs[:, 0]] != ids[None, :, pairs[:, 1]]).all(axis=(0, 1))
    i, j = pairs[apart].T
    margin = _ON * float(np.ptp(flat[ids[0]], axis=0).max()) ** 2
    clear = _beside(p[i], q[i], p[j], q[j], margin) | _beside(p[j], q[j], p[i], q[i], margin)
    if not clear.all():
        return False
    boxes = [
        (flat[loop].min(axis=0), flat[loop].max(axis=0))
        for loop, following in zip(loops, after, strict=True)
        if _cross(flat[loop] - flat[loop[0]], flat[following] - flat[loop[0]]).sum() > 0
    ]
    if not boxes:
        return False
    low, high = (np.array(side) for side in zip(*boxes, strict=True))
    return not len(overlapping(low, high))


def upright(normals: Array) -> Array | None:
    """Return a unit vector with positive products with all normals (t, 3), if one is found.

    By the perceptron algorithm, from the mean.

    >>> upright(np.eye(3)) @ np.eye(3) > 0
    array([ True,  True,  True])
    """
    axis = normals.sum(axis=0)
    for _ in range(_TRIES):
        axis = axis / max(float(np.linalg.norm(axis)), 1e-300)
        rise = normals @ axis
        if (rise > 0).all():
            return np.asarray(axis)
        worst = normals[rise.argmin()]
        axis = axis + worst / max(float(np.linalg.norm(worst)), 1e-300)
    return None


def _beside(p: Array, q: Array, a: Array, b: Array, margin: float) -> Flags:
    """Mark the segments a b (k, 2) whose ends are on one side of the lines p q."""
    one, two = (_cross(q - p, x - p) for x in (a, b))
    return ((one > margin) & (two > margin)) | ((one < -margin) & (two < -margin))


def _cross(a: Array, b: Array) -> Array:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]

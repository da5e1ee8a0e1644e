"""Rigid motions that bring points closest to others (Procrustes)."""

from __future__ import annotations

import numpy as np

from gso.typing import Array

#: Singular value, relative to the largest, that counts as zero.
_THIN = 1e-9


def closest_motion(points: Array, targets: Array) -> tuple[Array, Array]:
    """Find the rotation (d, d) and shift (d,) that bring points (k, d) closest to targets.

    Least squares, without reflection, in the plane or in space: the image of p is
    ``rotation @ p + shift``. Where the points do not determine the rotation (one point, or
    collinear points in space), it is the smallest possible.

    >>> square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    >>> turn, shift = closest_motion(square, square @ np.array([[0.0, 1], [-1, 0]]) + 5)
    >>> (turn @ square.T).T + shift
    array([[5., 5.],
           [5., 6.],
           [4., 6.],
           [4., 5.]])
    """
    here, there = points.mean(axis=0), targets.mean(axis=0)
    p, q = points - here, targets - there
    turn = _planar(p, q) if points.shape[1] == 2 else _spatial(p, q)
    return turn, there - turn @ here


def _planar(p: Array, q: Array) -> Array:
    number = np.array([1.0, 1j])
    turn = (p @ number).conj() @ (q @ number)
    turn = turn / abs(turn) if abs(turn) > 0 else 1.0 + 0.0j
    return np.array([[turn.real, -turn.imag], [turn.imag, turn.real]])


def _spatial(p: Array, q: Array) -> Array:
    from scipy.spatial.transform import Rotation

    u, s, vt = np.linalg.svd(q.T @ p)
    if s[0] <= _THIN**2 * max(float((p * p).sum()), 1e-300):
        return np.eye(3)
    if s[1] <= _THIN * s[0]:
        return np.asarray(Rotation.align_vectors(u[:, 0], vt[0])[0].as_matrix())
    return np.asarray(u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt)

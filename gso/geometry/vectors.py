"""Vectors as rows of arrays."""

from __future__ import annotations

import numpy as np

from gso.typing import Array


def cross(a: Array, b: Array) -> Array:
    """Return cross products of vectors along the last axis; faster than ``numpy.cross``."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def lengths(a: Array) -> Array:
    """Return the lengths of vectors along the last axis."""
    squared: Array = np.einsum("...d,...d->...", a, a)
    return np.sqrt(squared)


def unit(a: Array) -> Array:
    """Return vectors of length one; zero vectors stay zero."""
    return a / np.maximum(lengths(a), 1e-300)[..., None]


def fold_angles(left: Array, right: Array, way: Array) -> Array:
    """Return angles (k,) at edges between two faces, in radians, positive for mountain folds.

    Parameters
    ----------
    left, right : ndarray, (k, 3)
        Unit normals of the faces to the left and to the right of each edge.
    way : ndarray, (k, 3)
        Directions of the edges.

    Examples
    --------
    >>> up, front = np.array([[0.0, 0, 1]]), np.array([[0.0, -1, 0]])
    >>> np.degrees(fold_angles(up, front, np.array([[2.0, 0, 0]])))
    array([90.])
    """
    sine = np.einsum("kd,kd->k", cross(left, right), unit(way))
    return np.asarray(np.arctan2(sine, np.einsum("kd,kd->k", left, right)))

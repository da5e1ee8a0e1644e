"""Angles by which chains of edges turn."""

from __future__ import annotations

import numpy as np

from gso.typing import Array, Ints


def chain_turns(edges: Ints, vertices: Array) -> Array:
    """Return the angles in radians by which chains of edges turn where two of them meet.

    Parameters
    ----------
    edges : ndarray of int, (k, 2)
    vertices : ndarray, (n, 3)

    Examples
    --------
    >>> corner = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]])
    >>> np.degrees(chain_turns(np.array([[0, 1], [2, 1]]), corner)).round()
    array([90.])
    """
    ends = np.concatenate([edges, edges[:, ::-1]])
    ends = ends[np.argsort(ends[:, 0], kind="stable")]
    at, first, count = np.unique(ends[:, 0], return_index=True, return_counts=True)
    inner = first[count == 2]
    one, two = (vertices[ends[inner + k, 1]] - vertices[at[count == 2]] for k in (0, 1))
    size = np.linalg.norm(one, axis=1) * np.linalg.norm(two, axis=1)
    cosine = -np.einsum("kd,kd->k", one, two) / np.maximum(size, 1e-300)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))

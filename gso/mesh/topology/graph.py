"""Graphs as sparse matrices, and their connected components."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gso.typing import Array, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


def edge_graph(count: int, a: Ints, b: Ints, weight: Array | None = None) -> csr_matrix:
    """Build the sparse matrix (count, count) of a graph, with a weight for each edge.

    Parameters
    ----------
    count : int
        Number of nodes.
    a, b : ndarray of int, (e,)
        Ends of the edges.
    weight : ndarray, (e,), optional
        Weights of 0 or more; ones by default. SciPy takes zeros for missing edges: they become
        1e-300.
    """
    from scipy.sparse import coo_matrix

    values = np.ones(len(a)) if weight is None else np.maximum(weight, 1e-300)
    return coo_matrix((values, (a, b)), shape=(count, count)).tocsr()


def neighbour_means(edges: Ints, count: int) -> csr_matrix:
    """Return the matrix (n, n) that gives the mean of each node's neighbours along edges (e, 2)."""
    from scipy.sparse import diags

    rows, columns = np.concatenate([edges, edges[:, ::-1]]).T
    matrix = edge_graph(count, rows, columns)
    return diags(1.0 / np.maximum(matrix.sum(axis=1).A1, 1.0)) @ matrix


def label_components(count: int, a: Ints, b: Ints) -> Ints:
    """Number the connected components of a graph, in the order of their first nodes.

    Parameters
    ----------
    count : int
        Number of nodes.
    a, b : ndarray of int, (e,)
        Ends of the edges.

    Returns
    -------
    ndarray of int, (count,)
        The component of each node.

    Examples
    --------
    >>> label_components(5, np.array([0, 3]), np.array([2, 4]))
    array([0, 1, 0, 2, 2])
    """
    from scipy.sparse.csgraph import connected_components

    label = connected_components(edge_graph(count, a, b), directed=False)[1]
    return np.asarray(label, np.int64)

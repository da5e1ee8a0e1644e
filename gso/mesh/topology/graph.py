"""Graphs that are given by their edges."""

from __future__ import annotations

import numpy as np

from gso.typing import Ints


def component_labels(count: int, a: Ints, b: Ints) -> Ints:
    """Number the connected components of a graph: the component (count,) of every node.

    Parameters
    ----------
    count : int
        Number of nodes.
    a, b : ndarray of int, (e,)
        Ends of the edges.

    Examples
    --------
    >>> component_labels(4, np.array([0, 1]), np.array([1, 3])).tolist()
    [0, 0, 1, 0]
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    links = coo_matrix((np.ones(len(a)), (a, b)), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], np.int64)

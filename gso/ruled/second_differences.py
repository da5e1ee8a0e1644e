"""Second differences of strips, along them and across: a quadratic energy."""

from __future__ import annotations

import numpy as np

from gso.ruled.strip_weights import Weights
from gso.ruled.system import System
from gso.typing import Array


class Differences:
    """The terms "moved", "bent", "crease" and "even" of the energy.

    Parameters
    ----------
    system : System
        The layout's unknowns.
    start : ndarray, (n, 3)
        Positions that displacements refer to.
    width : float
        Mean width of the faces.
    rulings : int
        Number of rulings.
    """

    def __init__(self, system: System, start: Array, width: float, rulings: int):
        from scipy.sparse import csr_matrix

        strips = system.strips
        self._start = start
        along = 1.0 / (rulings * width**2)
        kinds = [("moved", strips.along, along), ("bent", strips.along, along)]
        if len(strips.across):
            kinds.append(("crease", strips.creased, along / (strips.count - 1)))
            kinds.append(("even", strips.across, strips.count / rulings))
        #: Name of the weight, operator, band storage of the second derivatives.
        self._terms = []
        for key, triples, factor in kinds:
            rows = np.repeat(np.arange(len(triples)), 3)
            ones = np.tile([1.0, -2.0, 1.0], len(triples))
            matrix = csr_matrix((ones, (rows, triples.ravel())), (len(triples), strips.size))
            operator = 2.0 * factor * (matrix.T @ matrix).tocsr()
            block = 2.0 * factor * np.outer([1.0, -2.0, 1.0], [1.0, -2.0, 1.0])
            block = np.kron(block, np.eye(3)).astype(np.float64)
            every = np.broadcast_to(block, (len(triples), 9, 9))
            band = system.matrix([(system.blocks(triples), every)])
            self._terms.append((key, operator, band))

    def energy(self, vertices: Array, w: Weights) -> tuple[float, Array]:
        """Return twice the energy, and its gradient."""
        total, gradient = 0.0, np.zeros_like(vertices)
        for key, operator, _ in self._terms:
            x = vertices - self._start if key == "moved" else vertices
            slope = getattr(w, key) * (operator @ x)
            total += float((x * slope).sum())
            gradient += slope
        return total, gradient

    def matrix(self, w: Weights) -> Array:
        """Return the band storage of the second derivatives."""
        return np.asarray(sum(getattr(w, key) * band for key, _, band in self._terms))

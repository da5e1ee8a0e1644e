"""Selection of the weight of a quadratic penalty without a solve for each weight.

The smoother of weight w is H = (I + w K)^-1. Lanczos steps with the inverse of
I + s K, with one factorisation for one shift s, give Gauss quadratures of every y^T f(K) y.
Hence they give residual and trace for all w within about a decade of s (Golub and
Meurant 2010), the trace with random signs (Hutchinson 1990), and the smoothed surface for
each of these weights.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gso.linalg import Pattern, SingularError, choose, spd
from gso.typing import Array, Solve

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

STEPS = 10
PROBES = 2
ROUNDS = 6
REACH = np.arange(-1.5, 3.05, 0.1)  # decades around the shift that are evaluated
NEAR = 1.2  # an optimum within this many decades of the shift is accepted
STEEPEST = 1e14  # with larger entries of weight K, the identity is lost to rounding


class Family:
    """Smoothed surfaces for a range of weights.

    Parameters
    ----------
    factor : callable
        Returns a solver of I + w K for a weight w; see :func:`factoring`.
    points : ndarray, (n, 3)
        The data.
    shift : float
        Centre of the range of weights.
    """

    def __init__(self, factor: Callable[[float], Solve], points: Array, shift: float):
        count = len(points)
        signs = np.random.default_rng(0).choice([-1.0, 1.0], (count, PROBES))
        start = np.hstack([points, signs])
        length = np.linalg.norm(start, axis=0)
        solve = factor(shift)
        vector, last = start / np.where(length > 0, length, 1.0), np.zeros_like(start)
        beta = np.zeros(start.shape[1])
        basis, diagonal, beside = [], [], []
        for _ in range(min(STEPS, count)):
            basis.append(vector)
            image = solve(vector) - beta * last
            alpha = (image * vector).sum(axis=0)
            image -= alpha * vector
            for earlier in basis:
                image -= earlier * (earlier * image).sum(axis=0)
            beta = np.linalg.norm(image, axis=0)
            diagonal.append(alpha)
            beside.append(beta)
            # An exhausted Krylov space, as of an eigenvector, continues with zeros.
            last, vector = vector, image / np.where(beta > 1e-13, beta, np.inf)
        tridiagonal = np.zeros((start.shape[1], len(basis), len(basis)))
        k = np.arange(len(basis))
        tridiagonal[:, k, k] = np.transpose(diagonal)
        tridiagonal[:, k[1:], k[:-1]] = tridiagonal[:, k[:-1], k[1:]] = np.transpose(beside[:-1])
        theta, mix = np.linalg.eigh(tridiagonal)
        self.eigenvalues = (1 / np.clip(theta, 1e-14, 1.0) - 1) / shift
        self.first = mix[:, 0, :]
        self.mix, self.basis, self.length, self.count = mix, np.stack(basis), length, count
        # Far ones are just accurate enough to move the shift there.
        self.weights = shift * 10**REACH

    def removed(self) -> tuple[Array, Array]:
        """Compute the sum of squared residuals, and the trace of I - H, for each weight."""
        share = self.weights[:, None, None] * self.eigenvalues
        share = share / (1 + share)
        energy = (self.first[:3] * self.length[:3, None]) ** 2
        residual = (share[:, :3] ** 2 * energy).sum(axis=(1, 2))
        trace = (share[:, 3:] * self.first[3:] ** 2).sum(axis=(1, 2)) * (self.count / PROBES)
        return residual, trace

    def smooth(self, weight: float) -> Array:
        """Compute the smoothed surface (n, 3) for a weight in the range."""
        share = 1 / (1 + weight * self.eigenvalues[:3])
        mixed = (
            np.einsum("ckm,cm->ck", self.mix[:3], share * self.first[:3]) * self.length[:3, None]
        )
        return np.asarray(np.einsum("knc,ck->nc", self.basis[:, :, :3], mixed))


@dataclass(frozen=True)
class Choice:
    """A smoothed surface, the weight of the penalty, and the trace of the smoother."""

    points: Array
    weight: float
    dof: float


Criterion = Callable[[Array, Array, int], Array]


def largest_weight(penalty: csc_matrix) -> float:
    """Compute the largest weight at which I is not lost in I + weight K; inf if K is zero."""
    steepest = float(np.abs(penalty.diagonal()).max())
    return STEEPEST / steepest if steepest > 0 else np.inf


def best_weight(penalty: csc_matrix, points: Array, start: float, criterion: Criterion) -> Choice:
    """Minimise a criterion of (sum of squared residuals, trace of I - H, n) over weights."""
    most = largest_weight(penalty)
    shift, low, high = min(start, most), 0.0, np.inf
    factor = factoring(penalty)
    for _ in range(ROUNDS):
        family = Family(factor, points, shift)
        residual, trace = family.removed()
        score = criterion(residual, trace, len(points))
        # A shift from which the search went up becomes a lower bound, and conversely.
        outside = (family.weights < low) | (family.weights > high)
        best = int(np.argmin(np.where(outside, np.inf, score)))
        weight = float(family.weights[best])
        if abs(np.log10(weight / shift)) < NEAR:
            break
        low, high = (shift, high) if weight > shift else (low, shift)
        if weight >= most and shift >= most:
            break
        shift = min(weight, most)
    return Choice(family.smooth(weight), weight, len(points) - float(trace[best]))


def gcv(caution: float) -> Criterion:
    """Return the criterion of generalised cross-validation (Golub, Heath and Wahba 1979).

    A `caution` above one increases the cost of degrees of freedom and so avoids interpolation
    (Cummins, Filloon and Nychka 2001).
    """

    def score(residual: Array, trace: Array, count: int) -> Array:
        left = count - caution * (count - trace)
        safe = np.log(np.maximum(residual, 1e-300)) - 2 * np.log(np.maximum(left, 1e-300))
        # Without residual degrees of freedom, prefer more smoothing.
        return np.where(left > 1e-3 * count, safe, 1e6 - trace)

    return score


def unbiased_risk(variance: float) -> Criterion:
    """Return Mallows' unbiased risk estimate (1973) for a known noise variance per coordinate."""

    def score(residual: Array, trace: Array, count: int) -> Array:
        return residual / (3 * count) + variance * (1 - 2 * trace / count)

    return score


def factoring(penalty: csc_matrix) -> Callable[[float], Solve]:
    """Return a function that factorises I + weight K and returns a solver of sides (n, c).

    >>> from scipy.sparse import identity
    >>> factoring(identity(3))(1.0)(np.ones((3, 1))).ravel()
    array([0.5, 0.5, 0.5])
    """
    from scipy.sparse import coo_matrix, identity, tril

    count = penalty.shape[0]
    half, k = tril(penalty, format="coo"), np.arange(count)
    # All diagonal entries are stored, and come first in their columns.
    values = np.r_[half.data, np.zeros(count)]
    lower = coo_matrix((values, (np.r_[half.row, k], np.r_[half.col, k])), penalty.shape).tocsc()
    lower.sort_indices()
    solver = choose(Pattern(count, lower.indptr, lower.indices))

    def factored(weight: float) -> Solve:
        data = weight * lower.data
        data[lower.indptr[:-1]] += 1.0
        try:
            solver.factor(data)
        except SingularError:
            # Indefinite by rounding, which an LU factorisation tolerates.
            return spd(identity(count) + weight * penalty)
        solve: Solve = solver.solve
        return solve

    return factored

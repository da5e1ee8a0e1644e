"""The share of signal in each mode of a noisy grid: an empirical Bayes estimate.

A grid is decomposed into products of one-dimensional modes. Mode (i, j) has the energy E_ij,
the squared length of its coefficient vector. Noise has the same variance sigma^2 in every
mode; the signal has more variance in low modes than in high ones. The ratio s of the signal's
variance to sigma^2 follows a decaying law with five parameters,

    log s_ij = a - p log(1 + t_ij / p),      t_ij = T ((i / m)^q + (j / n)^q),

with T such that s = 1 at (m, 0) and (0, n): m and n are the modes, one per direction, at which
signal and noise are equal. Large p gives a stretched exponential, as for analytic surfaces,
small p a power law, as for rough ones. The parameters maximise the restricted likelihood
(Patterson and Thompson 1971): planes are fitted, not penalised. The best linear estimate
scales a mode by s / (1 + s) (Wiener 1949).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np

from gso.typing import Array, Ints

# Parameters are (a, log m, log n, log q, log p). A weak Gaussian prior regularises the fit on
# tiny grids; on larger ones it has little effect.
CENTRE = np.array([12.0, 1.0, 1.0, np.log(1.3), np.log(8.0)])
SPREAD = np.array([20.0, 5.0, 5.0, 0.7, 1.0])
LOWEST = np.array([0.5, -3.0, -3.0, np.log(0.3), np.log(0.5)])
HIGHEST = np.array([75.0, 9.0, 9.0, np.log(8.0), np.log(60.0)])
LARGEST_STEP = np.array([3.0, 0.7, 0.7, 0.4, 0.7])
# Noise variance, for a grid of radius one, up to which the fit does not look for short waves.
NO_WAVES = 1e-8


def _starts(modes: tuple[int, ...], levels: tuple[float, ...]) -> Array:
    return np.array(
        [(a, np.log(m), np.log(n), *CENTRE[3:]) for m, n in product(modes, modes) for a in levels]
    )


# Initial parameters of the fit: for smooth surfaces, and for waves as short as a few samples.
STARTS = _starts((2, 5, 12), (6.0, 14.0))
WAVES = _starts((2, 5, 12, 25, 45), (6.0, 14.0, 25.0))
WAVES = WAVES[WAVES[:, 1:3].max(axis=1) > STARTS[:, 1].max()]


@lru_cache(maxsize=64)
def bins(n: int) -> tuple[Ints, Array, Array]:
    """Compute start, size and centre of bins of neighbouring modes.

    Modes below 12 have a bin each; the width of later bins is about an eighth of their mode
    number, over which the law hardly changes. So 64 modes make 28 bins, 256 make 40.
    """
    edges = [0]
    while edges[-1] < n:
        edges.append(edges[-1] + (1 if edges[-1] < 12 else edges[-1] // 8))
    bounds = np.array([*edges[:-1], n])
    size = np.diff(bounds)
    return bounds[:-1], size.astype(float), bounds[:-1] + (size - 1) / 2


@dataclass(frozen=True)
class Law:
    """A fitted law: its parameters, the noise variance, and the value of the criterion."""

    parameters: Array
    variance: float
    score: float


class Spectrum:
    """Mode energies of one surface, pooled into bins.

    Parameters
    ----------
    energy : ndarray, (H, W)
        Squared lengths of the coefficient vectors.
    floor : float
        Variance below which noise cannot be distinguished from rounding.
    """

    def __init__(self, energy: Array, floor: float = 0.0):
        (a, na, ci), (b, nb, cj) = bins(energy.shape[0]), bins(energy.shape[1])
        pooled = np.add.reduceat(np.add.reduceat(energy, a, axis=0), b, axis=1)
        count = 3 * na[:, None] * nb
        self.keep = (ci[:, None] + cj > 1).ravel()
        self.count = count.ravel()[self.keep]
        self.energy = pooled.ravel()[self.keep] + self.count * max(floor, 1e-200)
        self.total = self.count.sum()
        self.log_i, self.log_j = _log(ci), _log(cj)

    def fit(self, start: Array | None = None) -> Law:
        """Fit the parameters from a given start, or from the most likely of a list.

        The criterion is minus twice the restricted log-likelihood, with sigma^2 profiled out,
        plus the prior. Waves a few samples long are a separate optimum from that of a smooth
        surface. If parameters for such waves are a more likely start, and the noise variance
        found is large enough to contain waves, the fit is repeated from there.
        """
        if start is not None:
            return self._improved(start)
        scores = self._scores(STARTS)
        law = self._improved(STARTS[scores.argmin()])
        # With m or n beyond the last mode, the signal would be as flat as noise.
        waves = WAVES[(WAVES[:, 1:3] <= [self.log_i[-1], self.log_j[-1]]).all(axis=1)]
        if law.variance > NO_WAVES and len(waves):
            among = self._scores(waves)
            if among.min() < scores.min():
                return min(law, self._improved(waves[among.argmin()]), key=lambda x: x.score)
        return law

    def _improved(self, point: Array, steps: int = 40, tolerance: float = 1e-2) -> Law:
        """Minimise the criterion by Fisher scoring with Levenberg's damping."""
        score, gradient, hessian, variance = self._expand(point)
        damping = 1e-2
        for _ in range(steps):
            step = np.linalg.solve(hessian + np.diag(damping * np.diag(hessian) + 1e-9), gradient)
            step /= max(1.0, (np.abs(step) / LARGEST_STEP).max())
            candidate = np.clip(point + step, LOWEST, HIGHEST)
            trial = self._expand(candidate)
            if not trial[0] < score:
                damping *= 5
                if damping > 1e5:
                    break
                continue
            gain = score - trial[0]
            point, (score, gradient, hessian, variance) = candidate, trial
            damping = max(damping / 5, 1e-7)
            if gain < tolerance:
                break
        return Law(point, variance, score)

    def _scores(self, points: Array) -> Array:
        """Compute the criterion at each of many points (n, 5)."""
        share = _log_share(points, self.log_i, self.log_j).reshape(len(points), -1)
        v = 1 + np.exp(share[:, self.keep])
        variance = (self.energy / v).sum(axis=1) / self.total
        away = ((points - CENTRE) / SPREAD) ** 2
        cost: Array = self.total * np.log(variance) + np.log(v) @ self.count + away.sum(axis=1)
        return cost

    def _expand(self, point: Array) -> tuple[float, Array, Array, float]:
        """Compute criterion, negative gradient, expected Hessian and noise variance at a point."""
        share, slope = _log_share_and_slope(point, self.log_i, self.log_j)
        signal = np.exp(share.ravel()[self.keep])
        slope = slope.reshape(5, -1)[:, self.keep]
        v = 1 + signal
        per_mode = self.energy / v
        variance = per_mode.sum() / self.total
        kept = signal / v
        away = (point - CENTRE) / SPREAD
        score = self.total * np.log(variance) + self.count @ np.log(v) + (away**2).sum()
        slope = slope * kept
        gradient = slope @ (per_mode / variance - self.count) - 2 * away / SPREAD
        weighted = slope * self.count
        shared = weighted.sum(axis=1)
        hessian = weighted @ slope.T - np.outer(shared, shared) / self.total
        hessian[np.arange(5), np.arange(5)] += 2 / SPREAD**2
        return float(score), gradient, hessian, float(variance)


def shrinkage(law: Law, height: int, width: int) -> Array:
    """Compute the share of signal in each mode, (H, W) in [0, 1]; one for the modes of a plane.

    >>> law = Law(CENTRE, 1.0, 0.0)
    >>> shrinkage(law, 4, 4)[:2, :2].round(3)
    array([[1.  , 1.  ],
           [1.  , 0.97]])
    """
    i, j = np.arange(height), np.arange(width)
    signal = np.exp(_log_share(law.parameters, _log(i), _log(j)))
    kept: Array = signal / (1 + signal)
    kept[i[:, None] + j < 2] = 1.0
    return kept


def _log(index: Array | Ints) -> Array:
    return np.asarray(np.log(np.maximum(index, 1e-80)))


def _powers(point: Array, log_i: Array, log_j: Array) -> tuple[Array, Array]:
    m, n, q = point[..., 1, None], point[..., 2, None], np.exp(point[..., 3, None])
    u = np.exp(np.minimum(q * (log_i - m), 50.0))
    v = np.exp(np.minimum(q * (log_j - n), 50.0))
    return u, v


def _log_share(point: Array, log_i: Array, log_j: Array) -> Array:
    """Compute log s_ij, (..., i, j), at points (..., 5)."""
    u, v = _powers(point, log_i, log_j)
    a, p = point[..., 0, None, None], np.exp(point[..., 4, None, None])
    return np.asarray(a - p * np.log1p(np.expm1(a / p) * (u[..., :, None] + v[..., None, :])))


def _log_share_and_slope(point: Array, log_i: Array, log_j: Array) -> tuple[Array, Array]:
    u, v = _powers(point, log_i, log_j)
    a, q, p = point[0], np.exp(point[3]), np.exp(point[4])
    grow = np.exp(a / p)
    both = u[:, None] + v
    x = 1 + (grow - 1) * both
    log_x = np.log(x)
    fall = both / x
    rate = -p * (grow - 1) / x
    qu, qv = q * u, q * v
    slope = np.stack(
        [
            1 - grow * fall,
            -rate * qu[:, None],
            -rate * qv,
            rate * ((qu * (log_i - point[1]))[:, None] + qv * (log_j - point[2])),
            a * grow * fall - p * log_x,
        ]
    )
    return a - p * log_x, slope

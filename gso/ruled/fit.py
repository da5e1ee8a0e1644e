"""The solve for a strip of planar quads near a design; the unknowns are the ends of the rulings.

The energy is the mean squared distance of the design's samples from the strip, with small
weights on its smoothness. A last phase lowers the largest distance: it weights the samples by
rising powers of their distances. Quads are made planar first by a penalty, then exactly: steps are
tangential to the planar strips, and Newton's method leads back to these.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from gso.ruled import strip
from gso.ruled.chords import chords
from gso.ruled.domain import Domain
from gso.typing import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

#: Longest step of an end, relative to the mean width of the quads: the planarity of a quad is far
#: from linear beyond it.
_REACH = 0.5
#: Damping, relative to the mean diagonal, at the start and at most.
_DAMPING, _MOST = 1e-3, 1e3
#: Relative decrease of the energy at which a phase ends.
_TOLERANCE = 1e-4


@dataclass(frozen=True)
class Weights:
    """Weights of the energy, for designs whose diagonal is one.

    Attributes
    ----------
    moved, bent : float
        Second differences along the strip, of the displacement and of the position.
    ends : float
        Distance of the ends from the continued outline.
    gap : float
        Missing distance between successive rulings.
    least : float
        The distance that they keep, relative to the mean.
    planar : float
        Squared distance between the diagonals of a quad; 0 where quads are planar exactly.
    """

    moved: float = 1e-4
    bent: float = 1e-7
    ends: float = 1e-2
    gap: float = 1e2
    least: float = 0.1
    planar: float = 0.0


#: Powers of the distance in the last phase, the iterations of each, and the share of the weight
#: that all samples have in common.
_POWERS, _EACH, _COMMON = (3, 4, 5, 6, 8), 8, 0.1
#: Phases: weights of `moved` and of `planar`, and the largest number of iterations.
_PHASES = ((1e-4, 1.0, 15), (1e-6, 100.0, 15), (1e-7, 0.0, 25))


class Energy:
    """The energy of strips near a design with a diagonal of one.

    Parameters
    ----------
    domain : Domain
        The design.
    first, second : ndarray, (m, 2)
        Ends of the first rulings in the plane, beyond the outline.
    samples : ndarray of int, optional
        Vertices of the design that attract the strip; all that are used by default.
    """

    def __init__(self, domain: Domain, first: Array, second: Array, samples: Array | None = None):
        ids = np.flatnonzero(domain.mesh.used) if samples is None else samples
        self.points = domain.mesh.vertices[ids]
        self.weights = np.full(len(ids), 1.0 / len(ids))
        self.start = np.stack([domain.points(first), domain.points(second)], axis=1)
        step = np.diff(self.start, axis=0)
        self.width = float(np.linalg.norm(step, axis=2).mean())
        up, _ = domain.sample(domain.normals, 0.5 * (first + second))
        up /= np.linalg.norm(up, axis=1, keepdims=True)
        #: Normals at the rulings, on the side from which gaps are positive.
        self.up = up if strip.gaps(self.start, up)[0].sum() > 0 else -up
        along = np.gradient(self.start, axis=0)
        along /= np.maximum(np.linalg.norm(along, axis=2, keepdims=True), 1e-300)
        #: Projections (m, 2, 3, 3) that leave out movements along the outline.
        self._across = np.eye(3) - along[..., :, None] * along[..., None, :]

    def distances(self, ends: Array) -> Array:
        """Return the distances of the samples from a strip."""
        return strip.nearest_distances(ends, self.points)

    def weighted(self, weights: Array) -> Energy:
        """Return the energy with other weights of the samples, whose sum should be one."""
        other = copy(self)
        other.weights = weights
        return other

    def residuals(self, ends: Array, w: Weights) -> tuple[Array, csr_matrix]:
        """Return residuals whose squared norm is the energy, and their Jacobian."""
        from scipy.sparse import vstack

        parts = [
            *self._distance(ends),
            self._second(ends - self.start, w.moved),
            self._second(ends, w.bent),
            self._outline(ends, w.ends),
            *self._gaps(ends, w),
        ]
        if w.planar:
            value, slope = strip.planarity(ends)
            root = np.sqrt(w.planar / len(value))
            parts.append((root * value, root * slope))
        values, slopes = zip(*parts, strict=True)
        return np.concatenate(values), vstack(slopes, format="csr")

    def _distance(self, ends: Array) -> list[tuple[Array, csr_matrix]]:
        """Distances of the samples: normal to the strip; in full from its border."""
        at, border = strip.nearest(ends, self.points)
        x, along, across = strip.surface(ends, at)
        normal = np.cross(along, across)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        s, t = at.s, at.t
        share = np.stack([(1 - s) * (1 - t), (1 - s) * t, s * (1 - t), s * t], axis=1)
        root = np.sqrt(self.weights)[:, None]
        share *= root
        away = root * (x - self.points)
        height = (away * normal).sum(axis=1)
        slope = share[:, :, None] * normal[:, None]
        out = [(height, strip.rows(at.quad, slope, len(ends)))]
        k = np.flatnonzero(border)
        tangential = away[k] - height[k, None] * normal[k]
        for d in range(3):
            axis = np.eye(3)[d] - normal[k, d : d + 1] * normal[k]
            slope = share[k, :, None] * axis[:, None]
            out.append((tangential[:, d], strip.rows(at.quad[k], slope, len(ends))))
        return out

    def _second(self, values: Array, weight: float) -> tuple[Array, csr_matrix]:
        from scipy.sparse import diags, identity, kron

        count, scale = len(values), np.sqrt(weight / len(values)) / self.width
        matrix = diags([1.0, -2.0, 1.0], [0, 1, 2], shape=(count - 2, count))
        slope = (scale * kron(matrix, identity(6))).tocsr()
        return slope @ values.ravel(), slope

    def _outline(self, ends: Array, weight: float) -> tuple[Array, csr_matrix]:
        from scipy.sparse import block_diag

        scale = np.sqrt(weight / (2 * len(ends)))
        slope = (scale * block_diag(self._across.reshape(-1, 3, 3))).tocsr()
        return slope @ (ends - self.start).ravel(), slope

    def _gaps(self, ends: Array, w: Weights) -> list[tuple[Array, csr_matrix]]:
        gap, side = strip.gaps(ends, self.up)
        short = gap - w.least * self.width
        scale = np.sqrt(w.gap / len(ends))
        out = []
        for end in (0, 1):
            k = np.flatnonzero(short[:, end] < 0)
            slope = np.zeros((k.size, 4, 3))
            slope[:, end], slope[:, 2 + end] = -side[k], side[k]
            out.append((scale * short[k, end], strip.rows(k, scale * slope, len(ends))))
        return out


class _Damping:
    """Levenberg damping, adapted by the ratio of actual to predicted decrease (Nielsen 1999)."""

    def __init__(self) -> None:
        self.value, self._growth = _DAMPING, 2.0

    def update(self, ratio: float) -> None:
        if ratio > 0:
            self.value = max(self.value * max(1.0 / 3.0, 1.0 - (2.0 * ratio - 1.0) ** 3), 1e-9)
            self._growth = 2.0
        else:
            self.value = min(self.value * self._growth, _MOST)
            self._growth *= 2.0


def solve(domain: Domain, count: int = 49, samples: Array | None = None) -> tuple[Array, Energy]:
    """Fit a strip of planar quads to a design with a diagonal of one.

    Parameters
    ----------
    domain : Domain
        The design.
    count : int
        Number of rulings.
    samples : ndarray of int, optional
        As for :class:`Energy`.

    Returns
    -------
    ends : ndarray, (count, 2, 3)
        Ends of the rulings, beyond the outline of the design.
    energy : Energy
    """
    energy = Energy(domain, *chords(domain, count), samples)
    ends = energy.start
    for moved, planar, iterations in _PHASES:
        if not planar:
            ends = strip.planarised(ends)
        weights = replace(Weights(), moved=moved, planar=planar)
        ends = _descend(energy, ends, weights, iterations)
    return _even(energy, ends, weights), energy


def _even(energy: Energy, ends: Array, w: Weights) -> Array:
    """Lower the largest distance of the samples; return the best strip that was found."""
    far = energy.distances(ends)
    best, least = ends, far.max()
    for power in _POWERS:
        share = (far / far.max()) ** (power - 2)
        share = (1.0 - _COMMON) * share / share.sum() + _COMMON / len(share)
        ends = _descend(energy.weighted(share), ends, w, _EACH)
        far = energy.distances(ends)
        if far.max() < least:
            best, least = ends, far.max()
    return best


def _descend(energy: Energy, ends: Array, w: Weights, iterations: int) -> Array:
    """Minimise by Levenberg's method; without a weight on planarity, among planar strips."""
    damping = _Damping()
    r, j = energy.residuals(ends, w)
    for _ in range(iterations):
        gradient, normal = j.T @ r, (j.T @ j).toarray()
        step = _step(energy, ends, w, gradient, normal, damping)
        trial = ends + step.reshape(ends.shape)
        if not w.planar:
            trial = strip.planarised(trial)
        found = energy.residuals(trial, w)
        fall = float(r @ r - found[0] @ found[0])
        predicted = -float(2.0 * gradient @ step + step @ normal @ step)
        damping.update(fall / max(predicted, 1e-300))
        if fall <= 0 and damping.value >= _MOST:
            break
        if fall > 0:
            small = fall < _TOLERANCE * float(r @ r)
            ends, (r, j) = trial, found
            if small:
                break
    return ends


def _step(
    energy: Energy, ends: Array, w: Weights, gradient: Array, normal: Array, damping: _Damping
) -> Array:
    """Return a damped Gauss-Newton step; damping grows until the step is short enough."""
    diagonal = np.diag_indices_from(normal)
    scale = normal[diagonal].mean()
    if not w.planar:
        value, slope = strip.planarity(ends)
        right = np.column_stack([gradient, slope.T.toarray()])
    while True:
        matrix = normal.copy()
        matrix[diagonal] += damping.value * scale
        if w.planar:
            step = -np.linalg.solve(matrix, gradient)
        else:
            inverse = np.linalg.solve(matrix, right)
            left = value - slope @ inverse[:, 0]
            multipliers = np.linalg.lstsq(slope @ inverse[:, 1:], left, rcond=1e-12)[0]
            step = -inverse[:, 0] - inverse[:, 1:] @ multipliers
        if np.abs(step).max() <= _REACH * energy.width or damping.value >= _MOST:
            return step
        damping.value = min(3.0 * damping.value, _MOST)

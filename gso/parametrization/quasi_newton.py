"""Plane images of little strain, by quasi-Newton steps with one constant scalar matrix."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gso import geometry
from gso.linalg import Pattern, choose
from gso.parametrization.arap import Relaxed
from gso.typing import Array, Flags, Ints, Solve

#: Loss of mean squared strains, and its slope.
StrainLoss = Callable[[Array], tuple[Array, Array]]

#: Triangles per block: their numbers stay in the processor's cache.
_BLOCK = 16384
#: Corners at the ends of each side of a triangle.
_SIDES = ((0, 1), (0, 2), (1, 2))
#: Number of steps that the next one is computed from.
_MEMORY = 6
#: Share of the expected decrease that a step must reach, and the shortest step.
_DECREASE, _SHORTEST = 1e-4, 1e-3
_GROW = 1.3


def squared(squares: Array) -> tuple[Array, Array]:
    """Return squared strains themselves as the loss: the as-rigid-as-possible energy."""
    return squares, np.ones_like(squares)


class _Strain:
    """Strain of the maps of triangles (t, 3) of a surface (n, 3) to plane images (2, n)."""

    def __init__(self, vertices: Array, triangles: Ints):
        from scipy.sparse import csc_matrix

        t = len(triangles)
        self.corners = np.ascontiguousarray(triangles.T)
        self.rest = geometry.rest_frame(*geometry.corners(vertices, triangles))
        #: Adds forces (2 t) along the sides to the vertices (n).
        p, q, r = self.corners
        ends = np.concatenate([np.stack([q, p], axis=1), np.stack([r, p], axis=1)])
        self.sides = csc_matrix(
            (np.tile([1.0, -1.0], 2 * t), ends.ravel(), np.arange(0, 4 * t + 1, 2)),
            shape=(len(vertices), 2 * t),
        )

    def energy(
        self, flat: Array, loss: StrainLoss, good: Flags | None = None
    ) -> tuple[float, Array, Flags]:
        """Compute half the mean loss, its gradient (2, n), and what is not inverted.

        Infinity as soon as one of the `good` triangles is inverted.
        """
        t = self.corners.shape[1]
        force, kept = np.empty((2, 2 * t)), np.empty(t, bool)
        total = 0.0
        for start in range(0, t, _BLOCK):
            at = slice(start, min(start + _BLOCK, t))
            p, q, r = (tuple(flat.take(k, axis=1)) for k in self.corners[:, at])
            m11, m12, m22 = (m[at] for m in self.rest)
            turn, c, d = geometry.turn_and_shear(p, q, r, (m11, m12, m22))
            scale, shear2 = geometry.norm(turn), c * c + d * d
            kept[at] = scale * scale > shear2
            if good is not None and not kept[at][good[at]].all():
                return np.inf, force, kept
            strain = scale - 1.0
            value, slope = loss(strain * strain + shear2)
            total += float(value.sum())
            pull = slope * strain / scale
            a, b = pull * turn[0], pull * turn[1]
            c, d = slope * c, slope * d
            # Half the derivatives by the entries of the map, F11, F21, F12, F22.
            for row, along, across in ((0, a + c, d - b), (1, b + d, a - c)):
                force[row, at] = m11 * along + m12 * across
                force[row, start + t : start + t + len(m11)] = m22 * across
        gradient = np.stack([self.sides @ force[0], self.sides @ force[1]])
        return 0.5 * total / t, gradient * (0.5 / t), kept

    def laplacian(self) -> tuple[Array, Array, Ints, Ints]:
        """Return the Laplacian: its diagonal (n,), and values, rows and columns below it."""
        m11, m12, m22 = self.rest
        # Gradients of the three corners' hat functions.
        hats = ((-m11, -m12 - m22), (m11, m12), (0.0 * m22, m22))
        ends = [(self.corners[i], self.corners[j]) for i, j in _SIDES]
        one, two = (np.concatenate(side) for side in zip(*ends, strict=True))
        values = np.concatenate([geometry.dot(hats[i], hats[j]) for i, j in _SIDES])
        values *= 0.5 / self.corners.shape[1]
        # Constants are in its null space.
        n = self.sides.shape[0]
        diagonal = -sum(np.bincount(end, values, n) for end in (one, two))
        return np.asarray(diagonal, np.float64), values, np.maximum(one, two), np.minimum(one, two)

    def solver(self) -> Solve:
        """Factor the Laplacian; return what divides gradients by it."""
        from scipy.sparse import coo_matrix

        diagonal, values, rows, columns = self.laplacian()
        n, every = len(diagonal), np.arange(len(diagonal))
        # Translations of each component are a null space; a little damping makes it regular.
        diagonal += 1e-9 * diagonal.max()
        at = (np.r_[every, rows], np.r_[every, columns])
        lower = coo_matrix((np.r_[diagonal, values], at), shape=(n, n)).tocsc()
        lower.sort_indices()
        pattern = Pattern(n, lower.indptr.astype(np.int64), lower.indices.astype(np.int64))
        solver = choose(pattern)
        solver.factor(lower.data)
        return lambda gradient: solver.solve(gradient.T).T

    def divider(self) -> Solve:
        """Return what divides gradients by the Laplacian's diagonal."""
        diagonal = self.laplacian()[0]
        inverse = np.divide(1.0, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0)
        return lambda gradient: inverse * gradient


class QuasiNewton:
    """Lowers the mean loss of the strain of plane images of a surface.

    All triangles have equal weight. Steps are those of L-BFGS, with the Laplacian of the surface
    as the initial matrix (Liu, Bouaziz and Kavan 2017): one factorisation, and fewer steps than
    the local and global steps of :func:`gso.parametrization.relax` would need. No step inverts a
    triangle.

    Parameters
    ----------
    vertices, triangles : ndarray, (n, 3)
        The surface; its triangles must have an area. Vertices of no triangle do not move.
    oriented : ndarray of int, (u, 3)
        Triangles that must not be inverted.
    near : bool
        Whether images are wrong in details only, as those from a coarser grid. Then the matrix is
        the Laplacian's diagonal, which needs no factorisation.
    """

    def __init__(self, vertices: Array, triangles: Ints, oriented: Ints, *, near: bool = False):
        self._strain = _Strain(vertices, triangles)
        self._others = None if np.array_equal(oriented, triangles) else oriented
        self._divide = self._strain.divider() if near else self._strain.solver()

    def lower(
        self, flat: Array, *, loss: StrainLoss = squared, iterations: int, tolerance: float
    ) -> Relaxed:
        """Lower the loss of an image; return the new one and the root of its mean loss.

        Parameters
        ----------
        flat : ndarray, (n, 2)
        loss : callable
            Loss of the mean squared strains of triangles, and its slope, such as
            :meth:`gso.energy.stretch.TwoPowerLoss.of_squares`; by default the squares themselves.
        iterations, tolerance : int, float
            Largest number of iterations, and relative decrease of the energy at which to stop;
            after a shortened step it takes two such decreases.
        """
        x = np.ascontiguousarray(flat.T, np.float64)
        energy, gradient, good = self._strain.energy(x, loss)
        others = self._others
        sound = np.ones(0, bool) if others is None else geometry.signed_areas(flat, others) > 0
        memory: list[tuple[Array, Array, float]] = []
        step, ready = 1.0, True
        for _ in range(iterations):
            direction = _direction(gradient, memory, self._divide)
            expected = _dot(gradient, direction)
            step = min(_GROW * step, 1.0)
            while True:
                moved = x + step * direction
                value, slope, _ = self._strain.energy(moved, loss, good)
                if others is not None and value <= energy:
                    turned = geometry.signed_areas(moved.T, others) <= 0
                    value = np.inf if (turned & sound).any() else value
                if value <= energy + _DECREASE * step * expected:
                    break
                step *= 0.5 if value == np.inf else _shorter(value - energy, step * expected)
                if step < _SHORTEST:
                    return _relaxed(x, energy)
            shift, change = moved - x, slope - gradient
            curvature = _dot(shift, change)
            if curvature > 0:
                memory = [*memory[1 - _MEMORY :], (shift, change, curvature)]
            before, energy = energy, value
            x, gradient = moved, slope
            small = before - energy <= tolerance * before
            if small and ready:
                break
            # Where a step was shortened, one small decrease may be one by chance.
            ready = small or step >= 1.0
        return _relaxed(x, energy)


def _direction(gradient: Array, memory: list[tuple[Array, Array, float]], solve: Solve) -> Array:
    """Compute the direction of L-BFGS (Nocedal and Wright 2006, algorithm 7.4)."""
    out, shares = gradient, []
    for shift, change, curvature in reversed(memory):
        share = _dot(shift, out) / curvature
        shares.append(share)
        out = out - share * change
    out = solve(out)
    for (shift, change, curvature), share in zip(memory, reversed(shares), strict=True):
        out = out + (share - _dot(change, out) / curvature) * shift
    return -out


def _shorter(rise: float, expected: float) -> float:
    """Return the factor on a step whose energy rises although its slope is that `expected`."""
    return min(max(-0.5 * expected / (rise - expected), 0.1), 0.5)


def _relaxed(x: Array, energy: float) -> Relaxed:
    return Relaxed(np.ascontiguousarray(x.T), float(np.sqrt(2.0 * energy)))


def _dot(a: Array, b: Array) -> float:
    return float(np.vdot(a, b))

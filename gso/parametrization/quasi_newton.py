"""Plane images of little strain, by quasi-Newton steps with one constant scalar matrix."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gso import geometry
from gso.linalg import Pattern, choose
from gso.parametrization.arap import Relaxed
from gso.typing import Array, Flags, Ints

#: Loss of mean squared strains, and its slope.
StrainLoss = Callable[[Array], tuple[Array, Array]]

#: Triangles per block: their numbers stay in the processor's cache.
_BLOCK = 16384
#: Smallest and largest weight of a triangle in the matrix.
_LIGHT, _HEAVY = 0.3, 5.0
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
        from scipy.sparse import csr_matrix

        t = len(triangles)
        self.corners = np.ascontiguousarray(triangles.T)
        self.rest = geometry.rest_frame(*geometry.corners(vertices, triangles))
        #: Adds forces (2 t) along the sides to the vertices (n).
        own, (p, q, r) = np.arange(t), self.corners
        self.sides = csr_matrix(
            (
                np.repeat([1.0, -1.0], 2 * t),
                (np.r_[q, r, p, p], np.r_[own, own + t, own, own + t]),
            ),
            shape=(len(vertices), 2 * t),
        )

    def energy(
        self, flat: Array, loss: StrainLoss, good: Flags | None = None
    ) -> tuple[float, Array, Array, Flags]:
        """Compute half the mean loss, its gradient (2, n), its slopes, and what is not inverted.

        Infinity as soon as one of the `good` triangles is inverted.
        """
        t = self.corners.shape[1]
        force, slope, kept = np.empty((2, 2 * t)), np.empty(t), np.empty(t, bool)
        total = 0.0
        for start in range(0, t, _BLOCK):
            at = slice(start, min(start + _BLOCK, t))
            p, q, r = (tuple(flat.take(k, axis=1)) for k in self.corners[:, at])
            m11, m12, m22 = (m[at] for m in self.rest)
            turn, c, d = geometry.turn_and_shear(p, q, r, (m11, m12, m22))
            scale, shear2 = geometry.norm(turn), c * c + d * d
            kept[at] = scale * scale > shear2
            if good is not None and not kept[at][good[at]].all():
                return np.inf, force, slope, kept
            strain = scale - 1.0
            value, slope[at] = loss(strain * strain + shear2)
            total += float(value.sum())
            pull = slope[at] * strain / scale
            a, b = pull * turn[0], pull * turn[1]
            c, d = slope[at] * c, slope[at] * d
            # Half the derivatives by the entries of the map, F11, F21, F12, F22.
            for row, along, across in ((0, a + c, d - b), (1, b + d, a - c)):
                force[row, at] = m11 * along + m12 * across
                force[row, start + t : start + t + len(m11)] = m22 * across
        gradient = np.stack([self.sides @ force[0], self.sides @ force[1]])
        return 0.5 * total / t, gradient * (0.5 / t), slope, kept

    def solver(self, weights: Array) -> Callable[[Array], Array]:
        """Factor the Laplacian of weighted triangles; return what divides gradients by it."""
        from scipy.sparse import coo_matrix

        n, t = self.sides.shape[0], self.corners.shape[1]
        m11, m12, m22 = self.rest
        # Gradients of the three corners' hat functions.
        hats = ((-m11, -m12 - m22), (m11, m12), (0.0 * m22, m22))
        values, rows, columns = [], [], []
        for i in range(3):
            for j in range(i + 1):
                values.append(weights * geometry.dot(hats[i], hats[j]))
                rows.append(np.maximum(self.corners[i], self.corners[j]))
                columns.append(np.minimum(self.corners[i], self.corners[j]))
        every = np.arange(n)
        at = (np.concatenate([*rows, every]), np.concatenate([*columns, every]))
        lower = coo_matrix((np.concatenate([*values, np.zeros(n)]), at), shape=(n, n)).tocsc()
        lower.sort_indices()
        pattern = Pattern(n, lower.indptr.astype(np.int64), lower.indices.astype(np.int64))
        matrix = lower.data * (0.5 / t)
        # Translations of each component are a null space; a little damping makes it regular.
        matrix[pattern.indptr[:-1]] += 1e-9 * matrix.max()
        solver = choose(pattern)
        solver.factor(matrix)
        return lambda gradient: solver.solve(gradient.T).T

    def diagonal(self, weights: Array) -> Callable[[Array], Array]:
        """Return what divides gradients by the diagonal of that Laplacian."""
        n, t = self.sides.shape[0], self.corners.shape[1]
        m11, m12, m22 = self.rest
        squares = (m11**2 + (m12 + m22) ** 2, m11**2 + m12**2, m22**2)
        values = np.concatenate([weights * s for s in squares])
        total = np.bincount(self.corners.ravel(), values, n) * (0.5 / t)
        inverse = np.divide(1.0, total, out=np.zeros(n), where=total > 0)
        return lambda gradient: inverse * gradient


def quasi_newton(
    vertices: Array,
    triangles: Ints,
    flat: Array,
    *,
    loss: StrainLoss = squared,
    oriented: Ints | None = None,
    iterations: int = 100,
    tolerance: float = 1e-3,
    near: bool = False,
) -> Relaxed:
    """Lower the mean loss of the strain of a plane image, without a `loss` the squared strain.

    All triangles have equal weight. Steps are those of L-BFGS, with the Laplacian of the surface,
    in which triangles have the slopes of their losses as weights, as the initial matrix
    (Liu, Bouaziz and Kavan 2017): one factorisation, and fewer steps than the local and global
    steps of :func:`gso.parametrization.relax` would need. No step inverts a triangle.

    Parameters
    ----------
    vertices, triangles : ndarray, (n, 3)
        The surface; its triangles must have an area. Vertices of no triangle do not move.
    flat : ndarray, (n, 2)
        The initial image.
    loss : callable
        Loss of the mean squared strains of triangles, and its slope, such as
        :meth:`gso.energy.stretch.TwoPowerLoss.of_squares`.
    oriented : ndarray of int, (u, 3), optional
        Triangles that must not be inverted, if different from `triangles`.
    iterations, tolerance : int, float
        Largest number of iterations, and relative decrease of the energy at which to stop.
    near : bool
        Whether the image is wrong in details only, as one from a coarser grid. Then the matrix is
        the Laplacian's diagonal, which needs no factorisation.
    """
    strain = _Strain(vertices, triangles)
    others = None if oriented is None or np.array_equal(oriented, triangles) else oriented
    x = np.ascontiguousarray(flat.T, np.float64)
    energy, gradient, slope, good = strain.energy(x, loss)
    sound = np.ones(0, bool) if others is None else geometry.signed_areas(flat, others) > 0
    weights = np.clip(slope, _LIGHT, _HEAVY)
    solve = strain.diagonal(weights) if near else strain.solver(weights)
    memory: list[tuple[Array, Array, float]] = []
    step = 1.0
    for _ in range(iterations):
        direction = _direction(gradient, memory, solve)
        expected = _dot(gradient, direction)
        step = min(_GROW * step, 1.0)
        while True:
            moved = x + step * direction
            found = strain.energy(moved, loss, good)
            value = found[0]
            if others is not None and value <= energy:
                turned = geometry.signed_areas(moved.T, others) <= 0
                value = np.inf if (turned & sound).any() else value
            if value <= energy + _DECREASE * step * expected:
                break
            step *= 0.5 if value == np.inf else _shorter(value - energy, step * expected)
            if step < _SHORTEST:
                return _relaxed(x, energy)
        shift, change = moved - x, found[1] - gradient
        curvature = _dot(shift, change)
        if curvature > 0:
            memory = [*memory[1 - _MEMORY :], (shift, change, curvature)]
        before, energy = energy, value
        x, gradient = moved, found[1]
        if before - energy <= tolerance * before:
            break
    return _relaxed(x, energy)


def _direction(
    gradient: Array, memory: list[tuple[Array, Array, float]], solve: Callable[[Array], Array]
) -> Array:
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

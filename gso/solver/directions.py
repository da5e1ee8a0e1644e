"""Search directions: Gauss-Newton and Levenberg-Marquardt."""

from __future__ import annotations

import numpy as np

from gso.geometry import ops
from gso.linalg.base import SingularError, Solver
from gso.typing import Array, Ints, N

#: Relative damping above which an indefinite matrix is given up for the gradient direction.
HOPELESS = 1e3


def raise_damping(damping: N) -> N:
    """Return the damping after a failed factorisation; of a number or a tensor."""
    return ops.maximum(10.0 * damping, 1e-12)


def adapt_damping(damping: N, step: N) -> N:
    """Return Levenberg-Marquardt's damping after a step: less after full ones, more after short."""
    less = ops.maximum(damping / 5.0, 1e-12)
    more = ops.minimum(8.0 * ops.maximum(damping, 1e-9), 1.0)
    return ops.where(step >= 1.0, less, ops.where(step < 0.3, more, damping))


class GaussNewton:
    """Gauss-Newton steps with minimal damping, raised only while the factorisation fails."""

    def __init__(self, damping: float = 1e-9):
        self.damping = damping

    def step(self, solver: Solver, values: Array, diagonal: Ints, gradient: Array) -> Array:
        """Solve ``(H + damping mean(diag H) I) d = -gradient``.

        The mean of the diagonal is proportional to the trace, which is invariant to rotations
        of the surface. The steps therefore rotate with it.

        Parameters
        ----------
        solver : Solver
            Linear backend, analysed for the pattern of `values`.
        values, diagonal : ndarray
            Matrix values (changed in place) and the positions of the diagonal in them.
        gradient : ndarray
            Gradient of the objective.
        """
        damping = self.damping
        # Vertices without a face have zero diagonal entries: leave them out of the mean.
        own = values[diagonal]
        own = own[own > 0]
        typical = max(float(own.mean()), 1e-300) if own.size else 1e-300
        added = 0.0
        while True:
            values[diagonal] += (damping - added) * typical
            added = damping
            try:
                solver.factor(values)
                direction = -solver.solve(gradient)
                if np.isfinite(direction).all() and direction @ gradient <= 0:
                    return direction
            except SingularError:
                pass
            damping = float(raise_damping(damping))
            if damping > HOPELESS:
                return -gradient / float(values[diagonal].max())

    def accepted(self, step: float) -> None:
        """Receive the accepted step length, which is not used here."""


class LevenbergMarquardt(GaussNewton):
    """Levenberg-Marquardt steps: damping falls after full steps and rises after short ones."""

    def __init__(self, damping: float = 1e-6):
        super().__init__(damping)

    def accepted(self, step: float) -> None:
        """Adapt the damping to the accepted step length."""
        self.damping = float(adapt_damping(self.damping, step))


#: Directions by the name of the method.
METHODS = {"gauss-newton": GaussNewton, "levenberg-marquardt": LevenbergMarquardt}

"""Search directions: Gauss-Newton and Levenberg-Marquardt."""

from __future__ import annotations

from typing import Any

import numpy as np

from gso.linalg import SingularError
from gso.typing import Array, Ints

#: Relative damping above which an indefinite matrix is given up for the gradient direction.
_HOPELESS = 1e3


class GaussNewton:
    """Gauss-Newton steps with minimal damping, raised only while the factorisation fails."""

    def __init__(self, damping: float = 1e-9):
        self.damping = damping

    def step(self, solver: Any, values: Array, diagonal: Ints, gradient: Array) -> Array:
        """Solve ``(H + damping mean(diag H) I) d = -gradient``.

        The mean of the diagonal is proportional to the trace, which is invariant to rotations
        of the surface. The steps therefore rotate with it.

        Parameters
        ----------
        solver : backend solver
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
            damping = max(10.0 * damping, 1e-12)
            if damping > _HOPELESS:
                return -gradient / float(values[diagonal].max())

    def accepted(self, step: float) -> None:
        """Receive the accepted step length, which is not used here."""


class LevenbergMarquardt(GaussNewton):
    """Levenberg-Marquardt steps: damping falls after full steps and rises after short ones."""

    def __init__(self, damping: float = 1e-6):
        super().__init__(damping)

    def accepted(self, step: float) -> None:
        """Adapt the damping to the accepted step length."""
        if step >= 1.0:
            self.damping = max(self.damping / 5.0, 1e-12)
        elif step < 0.3:
            self.damping = min(max(self.damping, 1e-9) * 8.0, 1.0)

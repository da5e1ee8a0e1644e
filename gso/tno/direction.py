"""Where to go: Gauss-Newton and Levenberg-Marquardt directions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gso.tno.linear import SingularError

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Relative damping at which a matrix that is still indefinite is given up.
_HOPELESS = 1e3


class GaussNewton:
    """Plain steps; a trace of damping, raised only while the matrix is singular."""

    def __init__(self, damping: float = 1e-9):
        self.damping = damping

    def step(self, solver: Any, values: Array, diagonal: Ints, gradient: Array) -> Array:
        """Solve ``(H + damping mean(diag H) I) d = -gradient``.

        The mean of the diagonal is the trace, which does not change when the surface is
        turned: neither do the steps.

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
        # Unknowns of vertices that belong to no face count in nothing.
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
        """Take note of how much of the step was used."""


class LevenbergMarquardt(GaussNewton):
    """Damping that falls after full steps and rises after short ones."""

    def __init__(self, damping: float = 1e-6):
        super().__init__(damping)

    def accepted(self, step: float) -> None:
        """Adapt the damping to how much of the step was used."""
        if step >= 1.0:
            self.damping = max(self.damping / 5.0, 1e-12)
        elif step < 0.3:
            self.damping = min(max(self.damping, 1e-9) * 8.0, 1.0)


DIRECTIONS = {"gauss-newton": GaussNewton, "levenberg-marquardt": LevenbergMarquardt}

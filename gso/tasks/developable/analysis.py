"""What the plans of the developable task need to know about a design."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from gso import metrics as measure
from gso.energy import fairness
from gso.mesh import Mesh
from gso.smoothing import estimate_sigma, smooth_grid
from gso.tasks import base
from gso.typing import Array, N

#: Gaussian curvature at which the fairness term preserves half of the design's own bending.
FLAT_CURVATURE = 0.02
#: Share of that curvature below which the curvature of the noise does not count.
_CLEAN = 0.05


class Shape:
    """A surface in the unit ball: its curvature, its bending, and its shape without noise."""

    def __init__(self, mesh: Mesh):
        self.mesh = mesh

    @cached_property
    def curvature(self) -> float:
        """Mean |K|, averaged over both triangulations of the quads."""
        inside = self._absolute[~np.isnan(self._absolute)]
        return float(inside.mean()) if inside.size else 0.0

    @cached_property
    def own_bending(self) -> Array:
        """Share (n,) of its own bending that each vertex should keep, see :func:`own_bending`."""
        return own_bending(self.smooth, self._absolute if self.smooth is self.mesh else None)

    @cached_property
    def _absolute(self) -> Array:
        return absolute_curvature(self.mesh)

    @cached_property
    def bending(self) -> float:
        """Mean squared second derivative along the polylines."""
        stencil, coefficients = fairness.differences(self.mesh)
        if len(stencil) == 0:
            return 0.0
        second = np.einsum("ke,ekd->ed", coefficients, self.mesh.vertices[stencil])
        return float((second**2).sum(axis=1).mean() * 2.0)

    @property
    def smooth(self) -> Mesh:
        """The surface without its noise; on grids only, other meshes are returned unchanged."""
        return self._smoothed[0]

    @property
    def noise(self) -> float:
        """Standard deviation of the noise; 0 on meshes that are not grids."""
        return self._smoothed[1]

    @cached_property
    def _smoothed(self) -> tuple[Mesh, float]:
        mesh = self.mesh
        if mesh.grid is None:
            return mesh, 0.0
        sigma = estimate_sigma(mesh.grid)
        # The curvature of noise grows with the square of the resolution.
        if sigma * max(mesh.grid.shape) ** 2 < _CLEAN * FLAT_CURVATURE:
            return mesh, sigma
        smoothed = smooth_grid(mesh.grid, order=4)
        return mesh.replaced(smoothed.points.reshape(-1, 3)), smoothed.sigma


class Analysis(base.Analysis):
    """A design and its constraints, analysed for the developable task."""

    @cached_property
    def shape(self) -> Shape:
        """The shape of the design."""
        return Shape(self.mesh)


def absolute_curvature(mesh: Mesh) -> Array:
    """Return |K| (n,), averaged over both triangulations of the quads; NaN on the boundary."""
    return 0.5 * (np.abs(measure.curvature(mesh)) + np.abs(measure.curvature(mesh, 1)))


def own_bending(mesh: Mesh, absolute: Array | None = None) -> Array:
    """Compute the share (n,) of its own bending that each vertex of a smooth design should keep.

    The share is near one where the design is developable already, so that fairness does not
    shrink its border, and near zero where the design has Gaussian curvature. `absolute` is the
    :func:`absolute_curvature`, if it is known.
    """
    k = absolute_curvature(mesh) if absolute is None else absolute.copy()
    grid = mesh.grid_index
    if grid is not None:
        inner = grid[1:-1, 1:-1]
        k[grid] = np.pad(k[inner], 1, mode="edge")
    k = np.where(np.isnan(k), np.inf, k)
    return kept_bending(k)


def kept_bending(curvature: N) -> N:
    """Compute the share of its own bending that a vertex of a Gaussian curvature should keep."""
    return 1.0 / (1.0 + (curvature / FLAT_CURVATURE) ** 2)

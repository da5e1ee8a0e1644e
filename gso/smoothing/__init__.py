"""Noise removal from surfaces, with an amount of smoothing estimated from the data alone.

:func:`smooth_grid` smooths grids in closed form, in some milliseconds at 64 x 64;
:func:`smooth_mesh` smooths any mesh. Both preserve creases on request.
:func:`estimate_sigma` only estimates the standard deviation of a grid's noise, and is faster.
"""

from gso.smoothing.base import Smoothed
from gso.smoothing.grid_smoothing import estimate_sigma, smooth_grid
from gso.smoothing.mesh_smoothing import smooth_mesh

__all__ = ["Smoothed", "estimate_sigma", "smooth_grid", "smooth_mesh"]

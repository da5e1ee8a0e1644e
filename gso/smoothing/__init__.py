"""Remove noise from surfaces, the amount of smoothing read off the noisy data alone.

:func:`smooth_grid` for grids, in closed form, some milliseconds at 64 x 64;
:func:`smooth_mesh` for any mesh of triangles and quads. Both keep creases on request.
:func:`estimate_sigma` tells only how strong a grid's noise is, and quickly.
"""

from gso.smoothing.base import Smoothed
from gso.smoothing.grid import smooth_grid
from gso.smoothing.mesh import smooth_mesh
from gso.smoothing.noise import estimate_sigma

__all__ = ["Smoothed", "estimate_sigma", "smooth_grid", "smooth_mesh"]

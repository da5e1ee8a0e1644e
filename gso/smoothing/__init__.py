"""Remove noise from surfaces, the amount of smoothing read off the noisy data alone.

:func:`smooth_grid` for grids, in closed form, some milliseconds at 64 x 64;
:func:`smooth_mesh` for any mesh of triangles and quads. Both keep creases on request.
"""

from gso.smoothing.base import Smoothed
from gso.smoothing.grid import smooth_grid
from gso.smoothing.mesh import smooth_mesh

__all__ = ["Smoothed", "smooth_grid", "smooth_mesh"]

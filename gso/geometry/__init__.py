"""The package's only definitions of geometric quantities.

Every function takes *component tuples* ``(x, y, z)`` or ``(x, y)`` and uses only
``+ - * /`` and the few functions of :mod:`gso.geometry.ops`. The same code runs on
NumPy arrays (metrics), torch tensors (losses) and CasADi symbols (derivatives), so a
solver residual, a training loss and a metric cannot drift apart.
"""

from gso.geometry.cells import corner_area2, diagonals, face_products, isometry_defect
from gso.geometry.curvature import gaussian_curvature, star_area, star_defect
from gso.geometry.differences import second_difference
from gso.geometry.strain import rest_frame, singular_values, stretch, turn_and_shear
from gso.geometry.vector import angle, cross, dot, norm, norm2, sub

__all__ = [
    "angle",
    "corner_area2",
    "cross",
    "diagonals",
    "dot",
    "face_products",
    "gaussian_curvature",
    "isometry_defect",
    "norm",
    "norm2",
    "rest_frame",
    "second_difference",
    "singular_values",
    "star_area",
    "star_defect",
    "stretch",
    "sub",
    "turn_and_shear",
]

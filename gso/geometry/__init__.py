"""The package's only definitions of geometric quantities.

The functions take *component tuples* ``(x, y, z)`` or ``(x, y)`` and use only
``+ - * /`` and the few functions of :mod:`gso.geometry.ops`. The same code runs on
NumPy arrays (metrics), torch tensors (losses) and CasADi symbols (derivatives), so
solver residuals, training losses and metrics always agree. Only :mod:`gso.geometry.size`,
:mod:`gso.geometry.triangle`, :mod:`gso.geometry.rigid`, :mod:`gso.geometry.polygon` and
:mod:`gso.geometry.closing` take NumPy arrays.
"""

from gso.geometry.angle_defect import (
    GRID_RINGS,
    fan_angle,
    gaussian_curvature,
    grid_curvature,
    grid_star,
    star_area,
)
from gso.geometry.cells import (
    corner_area2,
    diagonal_distance,
    diagonals,
    face_products,
    isometry_defect,
)
from gso.geometry.chain_turns import chain_turns
from gso.geometry.closing import Closing, closing
from gso.geometry.depth_buffer import in_front, nearest_triangles, roomiest_pixels
from gso.geometry.differences import second_difference
from gso.geometry.gauss_image import image_curvature, solid_angle
from gso.geometry.grid_frame import (
    GridFrame,
    at_vertices,
    cell_corners,
    grid_slope,
    split_normals,
    unit,
)
from gso.geometry.parametric import smooth_gaussian_curvature
from gso.geometry.rigid import closest_motion
from gso.geometry.shape_operator import (
    Matrix,
    determinant,
    eigen,
    half_trace,
    shape_matrix,
    tangent_frame,
)
from gso.geometry.size import ball, box_diagonal, side_lengths, unit_rectangle
from gso.geometry.strain import rest_frame, singular_values, turn_and_shear
from gso.geometry.stretches import first_form, principal_stretches
from gso.geometry.triangle import (
    area_vectors,
    corner_angles,
    corners,
    doubled_areas,
    quad_area_vectors,
    quad_corner_vectors,
    signed_areas,
)
from gso.geometry.vector import angle, cross, dot, norm, norm2, sub

__all__ = [
    "GRID_RINGS",
    "Closing",
    "GridFrame",
    "Matrix",
    "angle",
    "area_vectors",
    "at_vertices",
    "ball",
    "box_diagonal",
    "cell_corners",
    "chain_turns",
    "closest_motion",
    "closing",
    "corner_angles",
    "corner_area2",
    "corners",
    "cross",
    "determinant",
    "diagonal_distance",
    "diagonals",
    "dot",
    "doubled_areas",
    "eigen",
    "face_products",
    "fan_angle",
    "first_form",
    "gaussian_curvature",
    "grid_curvature",
    "grid_slope",
    "grid_star",
    "half_trace",
    "image_curvature",
    "in_front",
    "isometry_defect",
    "nearest_triangles",
    "norm",
    "norm2",
    "principal_stretches",
    "quad_area_vectors",
    "quad_corner_vectors",
    "rest_frame",
    "roomiest_pixels",
    "second_difference",
    "shape_matrix",
    "side_lengths",
    "signed_areas",
    "singular_values",
    "smooth_gaussian_curvature",
    "solid_angle",
    "split_normals",
    "star_area",
    "sub",
    "tangent_frame",
    "turn_and_shear",
    "unit",
    "unit_rectangle",
]

"""Published metrics, exactly as their figures were computed, and corrected ones.

Surfaces are given as a :class:`gso.Mesh` or a grid array (H, W, 3), flat images as (H, W, 2)
or (n, 2). Functions that compare lengths also accept another surface, a :class:`gso.Mesh`,
as the image. Quantities that depend on the unit of length (``loss_gc``, ``loss_iso_cell``,
``fairness``) are measured on the surface normalised to the unit ball; pass `scale`, the
length that counts as one, to normalise differently: ``scale=1`` takes the coordinates as
they are. :data:`INFO` lists the meaning, unit and direction of every metric.
"""

from __future__ import annotations

from gso.metrics.areas import (
    area,
    area_error,
    corner_areas,
    face_areas,
    flipped_cells,
    flipped_faces,
    flips,
)
from gso.metrics.distance import (
    Distances,
    boundary_distance,
    d_H,
    displacement,
    largest_distance,
    point_to_surface,
    surface_distance,
)
from gso.metrics.farthest_point import farthest
from gso.metrics.gaussian_curvature import (
    K_A_r,
    K_A_r_worst,
    curvature,
    curvature_features,
    curvature_grid,
    loss_gc,
    loss_gc_half,
    loss_gc_image,
    loss_gc_mean,
    loss_gc_worst,
    mean_abs_K,
    worst_curvature,
)
from gso.metrics.hole_defects import (
    hole_defects,
    hole_gaps,
    holes,
    inner_outlines,
    turning,
)
from gso.metrics.info import INFO, Info
from gso.metrics.lengths import edge_length_error, isometry_defect, isometry_energy, loss_iso_cell
from gso.metrics.normal_angles import dihedral_angles, face_normals, normal_angle
from gso.metrics.principal_strain import (
    Strains,
    corner_strains,
    face_strains,
    parallelogram_strain,
    principal_strains,
    quasi_conformal,
    strains,
    stretches,
)
from gso.metrics.roughness import edge_ratios, fairness, fairness_ratio, loop_ratios, nonplanarity
from gso.metrics.surfaces import SurfaceLike, components, unit

__all__ = [
    "INFO",
    "Distances",
    "Info",
    "K_A_r",
    "K_A_r_worst",
    "Strains",
    "SurfaceLike",
    "area",
    "area_error",
    "boundary_distance",
    "components",
    "corner_areas",
    "corner_strains",
    "curvature",
    "curvature_features",
    "curvature_grid",
    "d_H",
    "dihedral_angles",
    "displacement",
    "edge_length_error",
    "edge_ratios",
    "face_areas",
    "face_normals",
    "face_strains",
    "fairness",
    "fairness_ratio",
    "farthest",
    "flipped_cells",
    "flipped_faces",
    "flips",
    "hole_defects",
    "hole_gaps",
    "holes",
    "inner_outlines",
    "isometry_defect",
    "isometry_energy",
    "largest_distance",
    "loop_ratios",
    "loss_gc",
    "loss_gc_half",
    "loss_gc_image",
    "loss_gc_mean",
    "loss_gc_worst",
    "loss_iso_cell",
    "mean_abs_K",
    "nonplanarity",
    "normal_angle",
    "parallelogram_strain",
    "point_to_surface",
    "principal_strains",
    "quasi_conformal",
    "strains",
    "stretches",
    "surface_distance",
    "turning",
    "unit",
    "worst_curvature",
]

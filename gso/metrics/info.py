"""Meaning, unit and direction of every metric."""

from __future__ import annotations

from typing import NamedTuple


class Info(NamedTuple):
    """Description of a metric: unit, whether lower is better (None: neither), a line of text.

    `aggregation` says how the values of several components are combined: "mean" (weighted by
    area), "max", "min" or "sum".
    """

    unit: str
    lower_is_better: bool | None
    text: str
    aggregation: str = "mean"


INFO: dict[str, Info] = {
    "loss_gc": Info("1/size^2", True, "mean |K| over interior vertices (published)"),
    "loss_gc_before": Info("1/size^2", True, "loss_gc of the input"),
    "loss_gc_worst": Info("1/size^2", True, "loss_gc in the worse of both triangulations of quads"),
    "loss_gc_worst_before": Info("1/size^2", True, "loss_gc_worst of the input"),
    "loss_gc_image": Info("1/size^2", True, "loss_gc by the normals of the quads"),
    "loss_gc_half": Info("1/size^2", True, "loss_gc of every second vertex, both triangulations"),
    "mean_abs_K": Info("1/size^2", True, "mean |K|, Meyer's area, worse triangulation"),
    "mean_abs_K_before": Info("1/size^2", True, "mean_abs_K of the input"),
    "K_A_r": Info("", False, "share of loss_gc removed (published)"),
    "K_A_r_worst": Info("", False, "share of loss_gc_worst removed"),
    "nonplanarity_mean": Info("", True, "mean gap of the quads' diagonals / mean edge"),
    "nonplanarity_max": Info("", True, "largest gap of a quad's diagonals / mean edge", "max"),
    "nonplanarity_max_before": Info("", True, "nonplanarity_max of the input", "max"),
    "d_H": Info("%", True, "mean distance to the nearest input vertex / diagonal (published)"),
    "distance_mean": Info("%", True, "mean true distance, both ways (strips: larger) / diagonal"),
    "distance_max": Info("%", True, "largest true distance, both ways / diagonal", "max"),
    "displacement_rms": Info("%", True, "root mean square vertex displacement / diagonal"),
    "displacement_max": Info("%", True, "largest vertex displacement / diagonal", "max"),
    "loop_ratio_min": Info("", None, "smallest length of a boundary loop, out / in", "min"),
    "loop_ratio_max": Info("", None, "largest length of a boundary loop, out / in", "max"),
    "edge_ratio_min": Info("", False, "smallest length of an edge, out / in", "min"),
    "fold_max": Info("deg", True, "largest angle between the normals of neighbouring faces", "max"),
    "fold_max_before": Info("deg", True, "fold_max of the input", "max"),
    "fairness_ratio": Info("", True, "sum of squared second differences, out / in"),
    "loss_iso_cell": Info("size", True, "isometry defect of the cells (published)"),
    "isometry_energy": Info("", True, "mean E_iso of the faces, relative (Jiang et al. 2020)"),
    "parallelogram_strain": Info("", True, "mean strain of the faces' midpoint parallelograms"),
    "edge_length_error": Info("", True, "mean |l'/l - 1| over edges"),
    "strain_mean": Info("", True, "mean of the larger principal strain"),
    "strain_p99": Info("", True, "99th percentile of the larger principal strain"),
    "strain_max": Info("", True, "largest principal strain", "max"),
    "hole_defect_max": Info("deg", True, "largest angle that a hole lacks to lie flat", "max"),
    "hole_gap_max": Info("%", True, "largest gap of an unrolled hole / its length", "max"),
    "area_error": Info("", True, "mean |A'/A - 1| over corner triangles"),
    "flipped_cells": Info("", True, "inverted cells (of grids: with an inverted corner)", "sum"),
    "strips": Info("", None, "strips side by side, parts of the pattern", "sum"),
    "flats": Info("", None, "faces of flat regions where strips meet", "sum"),
    "rulings": Info("", None, "lines to bend along", "sum"),
    "rulings_crossed": Info("", True, "pairs of successive rulings that cross", "sum"),
    "pleat_max": Info("deg", True, "largest pleat of a strip, see the reason PLEATED", "max"),
    "bend_radius_min": Info("size", False, "smallest radius at a ruling, mesh's unit", "min"),
    "crease_angle_max": Info("deg", True, "largest angle at a crease between strips", "max"),
    "crease_angle_p90": Info("deg", True, "angle at creases that 90 % of them are below", "max"),
    "crease_turn_max": Info("deg", True, "largest turn of a crease at one of its vertices", "max"),
    "crease_turn_mean": Info("deg", True, "turn of creases / % of the diagonal along them"),
    "part_area_min": Info("%", False, "area of the smallest part / that of all", "min"),
    "part_circle_min": Info("size", False, "least diameter of the largest circle in a part", "min"),
    "needles": Info("", True, "faces narrower than 0.1 % of the diagonal, all over", "sum"),
    "angle_distortion_mean": Info("", True, "mean over faces of s1/s2 - 1, principal stretches"),
    "angle_distortion_p99": Info("", True, "99th percentile of s1/s2 - 1"),
    "scale_min": Info("", False, "smallest ratio of lengths, flat over surface", "min"),
    "scale_max": Info("", True, "largest ratio of lengths, flat over surface", "max"),
    "theta": Info("deg", True, "mean angle of the cell normals to the clean surface's (published)"),
    "normal_change": Info("deg", None, "mean angle of the cell normals to the input's; no error"),
    "roughness_ratio": Info("", True, "sum of squared second differences, out / in"),
}

"""Bicubic B-spline surfaces."""

from gso.spline.surface import BSplineSurface, Gap, basis, basis_matrix, clamped_knots

__all__ = ["BSplineSurface", "Gap", "basis", "basis_matrix", "clamped_knots"]

"""Bicubic B-spline surfaces."""

from gso.spline.surface import BSplineSurface, Gap, basis, clamped_knots

__all__ = ["BSplineSurface", "Gap", "basis", "clamped_knots"]

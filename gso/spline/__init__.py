"""B-spline surfaces, whole and trimmed."""

from gso.spline.bspline import BSplineSurface, Gap, basis, basis_matrix, clamped_knots
from gso.spline.trimmed import TrimmedSpline

__all__ = ["BSplineSurface", "Gap", "TrimmedSpline", "basis", "basis_matrix", "clamped_knots"]

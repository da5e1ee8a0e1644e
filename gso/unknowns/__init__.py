"""Kinds of unknowns: one module each."""

from gso.unknowns.base import DIMENSIONS, Layout, Variables
from gso.unknowns.framed import ALONG, ball_bounds, framed_displacements
from gso.unknowns.free import free
from gso.unknowns.normal import normal_offsets
from gso.unknowns.spline import control_points, spline_offsets, spline_surface, tensor_matrix
from gso.unknowns.tangents import tangents

__all__ = [
    "ALONG",
    "DIMENSIONS",
    "Layout",
    "Variables",
    "ball_bounds",
    "control_points",
    "framed_displacements",
    "free",
    "normal_offsets",
    "spline_offsets",
    "spline_surface",
    "tangents",
    "tensor_matrix",
]

"""Kinds of unknowns: one module each."""

from gso.variables.base import Layout, Variables
from gso.variables.framed import ALONG, ball_bounds, framed_displacements
from gso.variables.free import free
from gso.variables.normal import normal_offsets, vertex_normals
from gso.variables.spline import spline_offsets, spline_surface

__all__ = [
    "ALONG",
    "Layout",
    "Variables",
    "ball_bounds",
    "framed_displacements",
    "free",
    "normal_offsets",
    "spline_offsets",
    "spline_surface",
    "vertex_normals",
]

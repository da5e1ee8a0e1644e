"""Constraints on a result: one class per kind, all of them checked against each other."""

from gso.constraints.base import Constraint
from gso.constraints.compiled import TIGHT, Compiled, compile_constraints, listed
from gso.constraints.conflicts import check
from gso.constraints.equations import (
    Lengths,
    OnLines,
    OnPlane,
    Part,
    Pins,
    Planar,
    Relations,
    Straight,
)
from gso.constraints.face_shape import FixedLengths, PlanarFaces
from gso.constraints.glue import Glue
from gso.constraints.linear import Reduction, reduce
from gso.constraints.on_curve import OnCurve, SlidingBoundary
from gso.constraints.positions import Fixed, FixedBoundary, Handle
from gso.constraints.read import add, from_records, kinds, read_constraints, record_of
from gso.constraints.ruling import Ruling
from gso.constraints.smooth import SmoothCurves
from gso.constraints.symmetry import SymmetryPlane

__all__ = [
    "TIGHT",
    "Compiled",
    "Constraint",
    "Fixed",
    "FixedBoundary",
    "FixedLengths",
    "Glue",
    "Handle",
    "Lengths",
    "OnCurve",
    "OnLines",
    "OnPlane",
    "Part",
    "Pins",
    "Planar",
    "PlanarFaces",
    "Reduction",
    "Relations",
    "Ruling",
    "SlidingBoundary",
    "SmoothCurves",
    "Straight",
    "SymmetryPlane",
    "add",
    "check",
    "compile_constraints",
    "from_records",
    "kinds",
    "listed",
    "read_constraints",
    "record_of",
    "reduce",
]

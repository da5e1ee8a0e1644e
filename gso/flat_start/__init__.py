"""Plane images of a surface to start from, and where the finished image is put."""

from gso.flat_start.align import align, settle
from gso.flat_start.begin import begin, flips, given, refine, strain, upward
from gso.flat_start.embed import embed, flattens, parts, spanned
from gso.flat_start.grid import rectangle
from gso.flat_start.place import beside, closest_motion, place, upright
from gso.flat_start.relax import Relaxed, relax, strain_level

__all__ = [
    "Relaxed",
    "align",
    "begin",
    "beside",
    "closest_motion",
    "embed",
    "flattens",
    "flips",
    "given",
    "parts",
    "place",
    "rectangle",
    "refine",
    "relax",
    "settle",
    "spanned",
    "strain",
    "strain_level",
    "upright",
    "upward",
]

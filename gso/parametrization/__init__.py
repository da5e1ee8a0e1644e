"""Plane images of a surface: initial ones, their placement, and grids over a rectangle."""

from gso.parametrization.alignment import align, settle
from gso.parametrization.arap import Relaxed, relax, strain_level
from gso.parametrization.around import Around, around, inside
from gso.parametrization.embedding import embeddings, flattens, parts, spanned
from gso.parametrization.initial import begin, flips, given, oriented_triangles, refine, strain
from gso.parametrization.low_strain import low_strain
from gso.parametrization.opening import Opened, by_rows, opened
from gso.parametrization.orientation import SAFETY, orientation
from gso.parametrization.packing import beside, closest_motion, place, upright
from gso.parametrization.patch import Patch, as_patch
from gso.parametrization.rectangle import rectangle

__all__ = [
    "SAFETY",
    "Around",
    "Opened",
    "Patch",
    "Relaxed",
    "align",
    "around",
    "as_patch",
    "begin",
    "beside",
    "by_rows",
    "closest_motion",
    "embeddings",
    "flattens",
    "flips",
    "given",
    "inside",
    "low_strain",
    "opened",
    "orientation",
    "oriented_triangles",
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
]

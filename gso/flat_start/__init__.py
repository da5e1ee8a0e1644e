"""Initial plane images of a surface, and the placement of the final image."""

from gso.flat_start.align import align, settle
from gso.flat_start.begin import begin, flips, given, refine, strain, upward
from gso.flat_start.embed import embed, embeddings, flattens, parts, spanned
from gso.flat_start.grid import rectangle
from gso.flat_start.opened import Opened, by_rows, opened, turning
from gso.flat_start.place import beside, closest_motion, place, upright
from gso.flat_start.relax import Relaxed, relax, strain_level

__all__ = [
    "Opened",
    "Relaxed",
    "align",
    "begin",
    "beside",
    "by_rows",
    "closest_motion",
    "embed",
    "embeddings",
    "flattens",
    "flips",
    "given",
    "opened",
    "parts",
    "place",
    "rectangle",
    "refine",
    "relax",
    "settle",
    "spanned",
    "strain",
    "strain_level",
    "turning",
    "upright",
    "upward",
]

"""Detection of folds, self-intersections, overlaps of flat patterns, and collapsed edges.

Each function returns faces or edges in the numbering of the mesh; an empty array means none.
"""

from gso.faults.crossings import crossings, crossings_at_vertices
from gso.faults.folds import PLEATED, SHORT, collapsed, folded
from gso.faults.overlaps import overlapping, overlaps

__all__ = [
    "PLEATED",
    "SHORT",
    "collapsed",
    "crossings",
    "crossings_at_vertices",
    "folded",
    "overlapping",
    "overlaps",
]

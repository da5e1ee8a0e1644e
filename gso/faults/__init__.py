"""Places in which a surface or a flat pattern is of no use: folds, crossings, overlaps, collapse.

Each function returns faces or edges in the numbering of the mesh, none where all is well.
"""

from gso.faults.crossings import crossings
from gso.faults.folds import SHORT, collapsed, folded
from gso.faults.overlaps import overlaps

__all__ = ["SHORT", "collapsed", "crossings", "folded", "overlaps"]

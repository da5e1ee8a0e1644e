"""Coarser copies of surfaces, and displacements carried from them to finer ones.

Grids are resampled (:mod:`gso.hierarchy.grids`); other meshes are thinned
(:mod:`gso.hierarchy.thinning`).
"""

from gso.hierarchy.grids import coarser, prolong_displacement, resample, resample_like
from gso.hierarchy.prolongation import Prolongation
from gso.hierarchy.thinning import Thinned, thinned
from gso.hierarchy.transfer import Transfer, nearest_on_grid

__all__ = [
    "Prolongation",
    "Thinned",
    "Transfer",
    "coarser",
    "nearest_on_grid",
    "prolong_displacement",
    "resample",
    "resample_like",
    "thinned",
]

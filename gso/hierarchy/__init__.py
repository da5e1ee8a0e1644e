"""Coarser copies of surfaces, and displacements carried from them to finer ones.

Grids are resampled (:mod:`gso.hierarchy.grids`); other meshes are thinned
(:mod:`gso.hierarchy.thinning`).
"""

from gso.hierarchy.grids import coarser, prolong_displacement, resample, resample_like

__all__ = ["coarser", "prolong_displacement", "resample", "resample_like"]

"""Plane images whose mean and largest strain are small, for flat patterns."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gso.energy.stretch import TwoPowerLoss, lowered
from gso.hierarchy import coarser
from gso.mesh import Mesh
from gso.parametrization.initial import DOUBTFUL, begin, oriented_triangles, refine
from gso.parametrization.initial import strained_triangles
from gso.parametrization.relaxation import Relaxed, relax

#: Largest side of the coarsest grid.
_COARSE = 40
#: Multiple of the typical strain above which strains cost more and more.
_KNEE = 2.6
#: Largest numbers of iterations: on the first mesh, on finer grids, and on those of so many
#: vertices that the image from a coarser grid is wrong in details only.
_FIRST, _FINER, _NEAR = 30, 10, 6
_DETAILS = 20_000
#: Relative decrease of the energy at which to stop, on the first mesh and on finer grids.
_TOLERANCE, _CLOSE = 1e-2, 1e-3
#: Smaller typical strains are rounding errors.
_SMALLEST = 1e-7


def low_strain(mesh: Mesh, *, doubtful: float = DOUBTFUL) -> Relaxed:
    """Compute an image of small mean and largest strain, without inverted triangles.

    It starts from :func:`begin`, and grids are solved coarse to fine.

    Parameters
    ----------
    mesh : Mesh
        One component with a boundary and without handles; a grid is numbered row by row.
    doubtful : float
        As for :func:`begin`.

    Returns
    -------
    Relaxed
        The image, and the strain of the least squares image that it started from.
    """
    levels = [*(coarser(mesh, _COARSE) if mesh.grid_index is not None else []), mesh]
    start = begin(levels[0], doubtful=doubtful)
    level = max(start.level, _SMALLEST)
    loss = TwoPowerLoss(level, knee=lowered(_KNEE, np.float64(level))).of_squares
    flat = start.flat
    for below, at in pairwise([None, *levels]):
        near = below is not None and len(at.vertices) > _DETAILS
        if below is not None:
            flat = refine(below, at, flat)
        flat = relax(
            at.vertices,
            strained_triangles(at),
            flat,
            loss=loss,
            oriented=oriented_triangles(at),
            iterations=_FIRST if below is None else _NEAR if near else _FINER,
            tolerance=_TOLERANCE if below is None else _CLOSE,
            near=near,
        ).flat
    return Relaxed(flat, start.level)

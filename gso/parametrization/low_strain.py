"""Plane images whose mean and largest strain are small, for flat patterns."""

from __future__ import annotations

from functools import partial

import numpy as np

from gso import components
from gso.energy.stretch import TwoPowerLoss, lowered
from gso.hierarchy import coarser
from gso.mesh import Mesh
from gso.parametrization.arap import Relaxed
from gso.parametrization.initial import (
    COARSE,
    DOUBTFUL,
    begin,
    oriented_triangles,
    refine,
    strained_triangles,
)
from gso.parametrization.opening import by_rows
from gso.parametrization.quasi_newton import quasi_newton

#: Multiple of the typical strain above which strains cost more and more.
_KNEE = 2.2
#: Largest numbers of iterations: on the coarsest mesh, and on finer grids.
_FIRST, _FINER = 30, 20
#: Number of vertices from which on an image from a coarser grid is wrong in details only, and the
#: number of iterations there.
_DETAILED, _DETAILS = 20_000, 6
#: Relative decrease of the energy at which to stop, on coarse meshes and on the finest.
_ROUGH, _CLOSE = 1e-2, 3e-4
#: Smaller typical strains are rounding errors.
_SMALLEST = 1e-7


def low_strain(mesh: Mesh, *, doubtful: float = DOUBTFUL) -> Relaxed:
    """Compute an image of small mean and largest strain, without inverted triangles.

    It starts from :func:`begin`; grids are solved coarse to fine. Where strains are small the loss
    is their absolute value, and a steep power where they are large.

    Parameters
    ----------
    mesh : Mesh
        Components with a boundary and without handles, each of which is mapped on its own; a grid
        is numbered row by row.
    doubtful : float
        As for :func:`begin`.

    Returns
    -------
    Relaxed
        The image, components on top of each other, and the largest root-mean-square strain of the
        images that they started from.

    Raises
    ------
    MeshError
        A component is closed or has handles, or no face has an area.
    """
    if not components.several(mesh):
        return _of_component(mesh, doubtful)
    flat, level = np.zeros((len(mesh.vertices), 2)), 0.0
    for part in components.split(mesh):
        ready, order = by_rows(part.mesh)
        image = _of_component(ready, doubtful)
        flat[part.vertices[order]] = image.flat
        level = max(level, image.level)
    return Relaxed(flat, level)


def _of_component(mesh: Mesh, doubtful: float) -> Relaxed:
    levels = [*(coarser(mesh, COARSE) if mesh.grid_index is not None else []), mesh]
    start = begin(levels[0], doubtful=doubtful, relaxation=partial(quasi_newton, tolerance=_ROUGH))
    level = max(start.level, _SMALLEST)
    loss = TwoPowerLoss(level, knee=lowered(_KNEE, np.float64(level))).of_squares
    flat = start.flat
    for number, at in enumerate(levels):
        below = levels[number - 1] if number else None
        near = below is not None and len(at.vertices) > _DETAILED
        if below is not None:
            flat = refine(below, at, flat)
        flat = quasi_newton(
            at.vertices,
            strained_triangles(at),
            flat,
            loss=loss,
            oriented=oriented_triangles(at),
            iterations=_FIRST if below is None else _DETAILS if near else _FINER,
            tolerance=_ROUGH if below is None and at is not mesh else _CLOSE,
            near=near,
        ).flat
    return Relaxed(flat, start.level)

"""Plane images whose mean and largest strain are small, for flat patterns."""

from __future__ import annotations

from functools import partial
from itertools import pairwise

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
from gso.parametrization.quasi_newton import QuasiNewton

#: Multiple of the typical strain above which strains cost more and more.
_KNEE = 2.15
#: Largest numbers of iterations: of the first image, of the coarsest mesh, and of finer grids.
_START, _FIRST, _FINER = 100, 30, 12
#: Number of vertices from which on an image from a coarser grid is wrong in details only, and the
#: number of iterations there.
_DETAILED, _DETAILS = 10_000, 9
#: Relative decrease of the energy at which to stop, on coarse meshes and on the finest.
_ROUGH, _CLOSE = 1e-2, 5e-4
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
    steps = _steps(levels[0])
    start = begin(
        levels[0],
        doubtful=doubtful,
        relaxation=partial(steps.lower, iterations=_START, tolerance=_ROUGH),
    )
    level = max(start.level, _SMALLEST)
    loss = TwoPowerLoss(level, knee=lowered(_KNEE, np.float64(level))).of_squares
    flat = steps.lower(
        start.flat,
        loss=loss,
        iterations=_FIRST,
        tolerance=_ROUGH if len(levels) > 1 else _CLOSE,
    ).flat
    for below, at in pairwise(levels):
        near = len(at.vertices) > _DETAILED
        steps = _steps(at, near=near)
        flat = refine(below, at, flat)
        if not near:
            # Interpolation may have left strains that are far above the knee.
            flat = steps.lower(flat, iterations=1, tolerance=_CLOSE).flat
        flat = steps.lower(
            flat, loss=loss, iterations=_DETAILS if near else _FINER, tolerance=_CLOSE
        ).flat
    return Relaxed(flat, start.level)


def _steps(mesh: Mesh, *, near: bool = False) -> QuasiNewton:
    strained, oriented = strained_triangles(mesh), oriented_triangles(mesh)
    return QuasiNewton(mesh.vertices, strained, oriented, near=near)

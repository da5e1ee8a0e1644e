"""Bicubic B-splines on grids: a coarse field of normal offsets, or the surface itself."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from gso.spline import basis_matrix, clamped_knots
from gso.typing import Array
from gso.unknowns.base import Layout, Variables
from gso.unknowns.normal import normal_offsets

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


@lru_cache(maxsize=32)
def spline_matrix(samples: int, controls: int) -> csr_matrix:
    """Return the uniform clamped cubic B-spline basis at uniform samples, (samples, controls).

    The degree falls below three when there are fewer than four control points.
    """
    return basis_matrix(clamped_knots(controls), controls, np.linspace(0.0, 1.0, samples))


@lru_cache(maxsize=16)
def tensor_matrix(shape: tuple[int, int], controls: tuple[int, int]) -> csr_matrix:
    """Return the bicubic basis (H W, n m) of a grid, both numbered row by row."""
    from scipy.sparse import kron

    return kron(
        spline_matrix(shape[0], controls[0]), spline_matrix(shape[1], controls[1]), format="csr"
    )


def spline_offsets(
    layout: Layout,
    points: Array,
    normals: Array,
    shape: tuple[int, int],
    controls: tuple[int, int],
) -> Variables:
    """Make vertices = points + (coarse bicubic field) * normals, one unknown per control point.

    The vertices of the block "surface" must be numbered row by row.
    """
    along = normal_offsets(layout, points, normals)
    basis = (along.basis @ tensor_matrix(shape, controls)).tocsr()
    return Variables(layout, basis, along.offset)


def spline_surface(layout: Layout, shape: tuple[int, int], controls: tuple[int, int]) -> Variables:
    """Make the block "surface" a bicubic B-spline; all other blocks are free.

    There are three unknowns per control point, numbered row by row, in the place of the block.
    With the blocks ("surface", "flat") the unknowns are the control net and then the plane
    coordinates; this gives a spline that is isometric to a plane (the second algorithm of
    Jiang et al. 2020). :meth:`Variables.project` fits a given surface; the caller has to
    report the misfit.

    Parameters
    ----------
    layout : Layout
        Its block "surface" has the points of the grid, row by row.
    shape, controls : (int, int)
        Numbers of grid points and of control points along both sides.

    Examples
    --------
    >>> variables = spline_surface(Layout.of(63, "surface", "flat"), (7, 9), (4, 5))
    >>> variables.size == 3 * 4 * 5 + 2 * 7 * 9
    True
    """
    from scipy.sparse import block_diag, identity, kron

    bases = [
        kron(tensor_matrix(shape, controls), identity(3), format="csr")
        if name == "surface"
        else identity(count * dim, format="csr")
        for name, count, dim in layout.blocks
    ]
    return Variables(layout, block_diag(bases, format="csr"), np.zeros(layout.size))


def control_points(layout: Layout, controls: tuple[int, int], x: Array) -> Array:
    """Return the control points (p, q, 3) among unknowns of :func:`spline_surface`."""
    start, _, _ = layout.where("surface")
    count = 3 * controls[0] * controls[1]
    return x[start : start + count].reshape(*controls, 3)

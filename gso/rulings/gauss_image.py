"""Vertex normals: the discrete Gauss image.

The normal at a vertex is that of a cubic height field fitted to the vertices around it (an
osculating jet, Cazals and Pouget 2005). Inside smooth grids the mean of the four faces' normals
is as accurate, and satisfies the relation of Jiang et al. 2020. On boundaries and in irregular
meshes, however, its error is of first order in the edge length, so that curvatures do not
converge. The error of the jets' normals is of third order everywhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import comb
from typing import TYPE_CHECKING

import numpy as np

from gso import geometry
from gso.io import as_mesh
from gso.mesh import Mesh, topology
from gso.metrics import components
from gso.typing import Array, Flags, Ints, MeshLike

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

#: Rings of vertices in a fit, inside and on the boundary, where they lie on one side only.
RINGS, RIM_RINGS = 2, 3

#: Powers (i, j) of the monomials x^i y^j, by degree.
_POWERS = [(i - j, j) for i in range(4) for j in range(i + 1)]

#: Ridge penalty on a squared coefficient of each degree, per vertex of the fit. It is negligible
#: unless there are too few vertices for all coefficients; then low degrees are preferred. The
#: binomial coefficients make it invariant to rotations of the coordinates.
_RIDGE = np.array([(1e-15, 1e-15, 1e-12, 1e-9)[i + j] / comb(i + j, i) for i, j in _POWERS])

#: Number of (vertex, neighbour) pairs per block.
_BLOCK = 1 << 17


def gauss_image(mesh: MeshLike) -> Array:
    """Compute unit normals at the vertices: the vertices of the discrete Gauss image.

    The image has the faces of the mesh. It is a curve on the unit sphere if the surface is
    developable. A face's `normal` and the normals n_j at its corners satisfy
    ``<n_j + n_(j+1), normal> = 2`` (Jiang et al. 2020) up to second order in the face's size.
    Dividing each n_j by the mean cosine of its angles with the normals of the faces around it
    gives third order inside, and changes the shape operator only to that order.

    Parameters
    ----------
    mesh : Mesh, or anything that :func:`gso.as_mesh` takes
        The surface.

    Returns
    -------
    ndarray, (n, 3)
        They point to the side from which faces are anticlockwise; zero at vertices of no face.

    Notes
    -----
    Fits use two rings of vertices, on the boundary three, as they lie on one side there. A
    vertex is weighted by the cosine of the angle between its normal and that at the centre, so
    that vertices beyond a fold count less.

    Examples
    --------
    >>> y, x = np.mgrid[-4:5, -4:5] / 20
    >>> cap = np.stack([y, x, np.sqrt(1 - x**2 - y**2)], axis=-1)
    >>> bool(np.abs(gauss_image(cap) - cap.reshape(-1, 3)).max() < 1e-3)
    True
    """
    surface = as_mesh(mesh)
    used = surface.used
    points = np.where(used[:, None], surface.frame.to_unit(surface.vertices), 0.0)
    corners = _corners(surface)
    first = _mean_normals(surface, corners)
    link = (corners @ corners.T).tocsr()
    normals = np.zeros_like(points)
    rim = surface.half_edges.boundary_vertex
    for which, rings in ((used & ~rim, RINGS), (used & rim, RIM_RINGS)):
        around = link[which]
        for _ in range(rings - 1):
            around = around @ link
        for centre, near, there in _blocks(np.flatnonzero(which), around):
            normals[centre] = _jet_normals(points, first, centre, near, there)
    return normals


def _corners(mesh: Mesh) -> csr_matrix:
    """Build the sparse (n, m) incidence matrix of vertices and faces."""
    from scipy.sparse import csr_matrix

    he = mesh.half_edges
    shape = (len(mesh.vertices), len(mesh.faces))
    return csr_matrix((np.ones(he.origin.size), (he.origin, he.face)), shape=shape)


def _mean_normals(mesh: Mesh, corners: csr_matrix) -> Array:
    """Compute unit normals (n, 3): area-weighted means over the faces, z where they cancel."""
    p = mesh.frame.to_unit(mesh.vertices)
    sides = geometry.diagonals(*(components(p[c]) for c in topology.four_corners(mesh.faces).T))
    total = corners @ np.stack(geometry.cross(*sides), axis=1)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    up = np.broadcast_to([0.0, 0.0, 1.0], total.shape)
    return np.asarray(np.divide(total, length, out=up.copy(), where=length > 0))


def _blocks(centre: Ints, around: csr_matrix) -> Iterator[tuple[Ints, Ints, Flags]]:
    """Yield blocks of vertices, their neighbours (b, k), and a mask that is false for padding."""
    count = np.diff(around.indptr)
    order = np.argsort(count, kind="stable")
    start = 0
    while start < order.size:
        # Rows are sorted by length, so that there is little padding.
        width = np.maximum(count[order[start:]], 1)
        fit = np.flatnonzero(width * np.arange(1, width.size + 1) > _BLOCK)
        stop = start + max(int(fit[0]) if fit.size else width.size, 1)
        rows = order[start:stop]
        column = np.arange(count[rows].max())
        there = column < count[rows, None]
        at = around.indptr[rows][:, None] + np.where(there, column, 0)
        yield centre[rows], around.indices[at], there
        start = stop


def _jet_normals(points: Array, normals: Array, centre: Ints, near: Ints, there: Flags) -> Array:
    """Compute normals of cubic height fields over the planes normal to `normals` at `centre`."""
    up = normals[centre]
    # The coordinate axis farthest from the normal completes a frame.
    side = np.cross(up, np.eye(3)[np.abs(up).argmin(axis=1)])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    frame = np.stack([side, np.cross(up, side), up], axis=2)
    offset = (points[near] - points[centre][:, None]) @ frame
    reach = np.sqrt(np.where(there, (offset**2).sum(axis=2), 0.0).max(axis=1))
    x, y, z = np.moveaxis(offset / reach[:, None, None], 2, 0)
    facing = np.maximum((normals[near] * up[:, None]).sum(axis=2), 0.0)
    weight = np.where(there, facing, 0.0)
    basis = np.stack([x**i * y**j for i, j in _POWERS], axis=2)
    weighted = np.swapaxes(basis * weight[..., None], 1, 2)
    gram = weighted @ basis + weight.sum(axis=1)[:, None, None] * np.diag(_RIDGE)
    slope = np.linalg.solve(gram, weighted @ z[..., None])[:, 1:3, 0]
    out = up - (frame[..., :2] @ slope[..., None])[..., 0]
    return np.asarray(out / np.linalg.norm(out, axis=1, keepdims=True))

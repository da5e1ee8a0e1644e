"""Residuals of local polynomial fits to a mesh, as a smoothness penalty.

A *patch* is a vertex and its neighbours. Over the plane of the patch, least squares fits
each coordinate by a polynomial of degree below `order` and leaves a residual. The sum of
squared residuals plays the role of squared differences on a grid: it is zero for polynomials,
and as patches at the boundary are one-sided, it has free ends, so that boundaries and holes
do not shrink (the local fits of Savitzky and Golay 1964, turned into a penalty like that of
Whittaker 1923).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gso.mesh import Mesh
from gso.mesh.topology import edge_graph
from gso.typing import Array, Flags, Ints

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix, csr_matrix

# Largest number of vertices in a fit; more, as around a pole with hundreds of faces, are sampled.
LARGEST = 64


def neighbours(mesh: Mesh) -> csr_matrix:
    """Build the sparse (n, n) pattern of ones of vertices that share a face, with diagonal."""
    from scipy.sparse import csr_matrix

    he = mesh.half_edges
    shape = (len(mesh.vertices), len(mesh.faces))
    incidence = csr_matrix((np.ones(he.origin.size), (he.origin, he.face)), shape=shape)
    return _pattern(incidence @ incidence.T)


def umbrella(mesh: Mesh, near: csr_matrix) -> csr_matrix:
    """Build the sparse (n, n) umbrella operator: each vertex minus the mean of its neighbours.

    Boundary vertices use their neighbours along the boundary only, so that the operator does
    not pull the boundary inwards (Taubin 1995).

    >>> mesh = Mesh(np.eye(4, 3), [[0, 1, 2, 3]])
    >>> umbrella(mesh, neighbours(mesh)).toarray()[0]
    array([ 1. , -0.5,  0. , -0.5])
    """
    from scipy.sparse import diags

    i, j = mesh.edges[mesh.boundary_edges].T
    along = edge_graph(near.shape[0], np.r_[i, j], np.r_[j, i])
    inner = ~mesh.half_edges.boundary_vertex
    links = diags(inner * 1.0) @ (near - diags(near.diagonal())) + along
    valence = np.asarray(links.sum(axis=1)).ravel()
    return diags((valence > 0) * 1.0) - diags(1 / np.maximum(valence, 1)) @ links


@dataclass(frozen=True)
class Rings:
    """Padded vertex lists: `index` (p, k) of vertices, `real` (p, k) false for padding."""

    index: Ints
    real: Flags


def rings(near: csr_matrix, size: int) -> Rings:
    """Collect the vertices within `size` faces of each vertex; a regular sample if too many."""
    reach = near
    for _ in range(size - 1):
        reach = _pattern(reach @ near)
    reach.sort_indices()
    length = np.diff(reach.indptr)
    row = np.repeat(np.arange(len(length)), length)
    column = np.arange(row.size) - reach.indptr[row]
    share = np.minimum(1.0, LARGEST / length)[row]
    taken = np.floor((column + 1) * share) > np.floor(column * share)
    row, column = row[taken], np.floor(column * share)[taken].astype(np.int64)
    index = np.zeros((len(length), min(LARGEST, length.max())), np.int64)
    real = np.zeros(index.shape, bool)
    index[row, column], real[row, column] = reach.indices[taken], True
    return Rings(index, real)


@dataclass(frozen=True)
class Residuals:
    """Local fits of a mesh.

    Attributes
    ----------
    rings : Rings
        The patches.
    basis : ndarray, (p, k, d)
        Orthonormal values of the fitted polynomials at the vertices of each patch.
    normal : ndarray, (p, 3)
        Normal of the plane of each patch.
    freedom : ndarray, (p,)
        Degrees of freedom: vertices of a patch minus coefficients of its fit.
    scale : ndarray, (p,)
        Factor that turns squared residuals into squared derivatives times area, whose sum over
        patches does not depend on the resolution.
    rows : sparse matrix, (p d, n)
        The basis, one polynomial per row.
    """

    rings: Rings
    basis: Array
    normal: Array
    freedom: Array
    scale: Array
    rows: csr_matrix

    def penalty(self, trust: Array | None = None) -> csc_matrix:
        """Build the sparse (n, n) matrix of the sum of squared residuals, weighted by `trust`."""
        from scipy.sparse import diags

        factor = self.scale if trust is None else self.scale * trust
        index, real = self.rings.index, self.rings.real
        each = np.broadcast_to(factor[:, None], real.shape)[real]
        total = np.bincount(index[real], each, minlength=self.rows.shape[1])
        fitted = self.rows.T @ (diags(np.repeat(factor, self.basis.shape[2])) @ self.rows)
        return (diags(total) - fitted).tocsc()

    def heights(self, points: Array) -> Array:
        """Compute the RMS residual of each patch along its normal, (p,); zero for exact fits."""
        away = np.einsum("pkc,pc->pk", points[self.rings.index], self.normal) * self.rings.real
        fit = np.einsum("pkd,pk->pd", self.basis, away)
        away = away - np.einsum("pkd,pd->pk", self.basis, fit)
        return np.asarray(np.sqrt((away**2).sum(axis=1) / np.maximum(self.freedom, 1)))


def residuals(points: Array, patches: Rings, order: int) -> Residuals:
    """Fit polynomials of degree below `order` over the planes of all patches.

    Parameters
    ----------
    points : ndarray, (n, 3)
        Vertices that define the planes; their noise should be small compared with the edges.
    patches : Rings
    order : int
        2: planes, 3: quadrics, 4: cubics.
    """
    from scipy.sparse import csr_matrix

    index, real = patches.index, patches.real
    size = real.sum(axis=1)
    local = points[index] * real[..., None]
    local = (local - local.sum(axis=1, keepdims=True) / size[:, None, None]) * real[..., None]
    axes = np.linalg.eigh(np.swapaxes(local, 1, 2) @ local)[1]
    flat = local @ axes[:, :, 1:]
    radius = np.sqrt((flat**2).sum(axis=(1, 2)) / size)
    radius = np.maximum(radius, max(1e-3 * float(np.median(radius)), 1e-300))
    u, v = np.moveaxis(flat / radius[:, None, None], 2, 0)
    powers = [(a, total - a) for total in range(order) for a in range(total, -1, -1)]
    monomials = np.stack([u**a * v**b for a, b in powers], axis=-1) * real[..., None]
    square, mix = np.linalg.eigh(np.swapaxes(monomials, 1, 2) @ monomials)
    known = square > 1e-9 * square[:, -1:]
    mix = mix * np.where(known, 1 / np.sqrt(np.maximum(square, 1e-300)), 0.0)[:, None, :]
    basis = monomials @ mix
    width = basis.shape[2]
    entries = np.broadcast_to(real[:, None, :], (len(real), width, real.shape[1]))
    starts = np.concatenate([[0], np.cumsum(np.repeat(size, width))])
    columns = np.broadcast_to(index[:, None, :], entries.shape)[entries]
    values = np.swapaxes(basis, 1, 2)[entries]
    rows = csr_matrix((values, columns, starts), shape=(len(real) * width, len(points)))
    scale = radius ** (2 - 2 * order) * (len(points) / (radius**2).sum())
    # Sliver faces must not dominate the sum.
    scale = np.minimum(scale, 100 * np.median(scale))
    freedom = np.maximum(size - known.sum(axis=1), 0).astype(float)
    return Residuals(patches, basis, axes[:, :, 0], freedom, scale, rows)


def _pattern(matrix: csr_matrix) -> csr_matrix:
    matrix = matrix.tocsr()
    matrix.data[:] = 1.0
    return matrix

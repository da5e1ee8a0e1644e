"""What a mesh is not, locally: the part of each patch that no low polynomial fits.

A *patch* is a vertex and its neighbours. Over the plane of the patch, least squares fits
each coordinate by a polynomial of degree below `order`; what is left is the residual. The
sum of squared residuals plays the role that squared differences play on a grid: it does
not see polynomials, and as patches at the rim are simply one-sided, it leaves free ends,
so that boundaries and holes do not shrink (the local fits of Savitzky and Golay 1964,
turned into a penalty as by Whittaker 1923).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gso.status import MeshError

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# Around a pole with hundreds of faces so many vertices are enough for a fit.
LARGEST = 64


def checked_faces(faces: Any, count: int) -> Ints:
    """Faces as integers (m, 3) or (m, 4), a missing fourth corner as -1.

    Raises
    ------
    MeshError
        Another shape, numbers that are not whole, or a vertex that does not exist.
    """
    array = np.asarray(faces)
    if array.ndim != 2 or array.shape[1] not in (3, 4) or not len(array):
        raise MeshError(f"faces have shape {array.shape}; give (m, 3) or (m, 4) with m > 0")
    table = array.astype(np.int64)
    if (table != array).any():
        raise MeshError("faces hold numbers that are not whole; give vertex indices")
    bad = (table >= count) | (table < 0)
    if table.shape[1] == 4:
        bad[:, 3] &= table[:, 3] != -1
    if bad.any():
        face = int(np.flatnonzero(bad.any(axis=1))[0])
        raise MeshError(f"face {face} refers to a vertex outside 0 to {count - 1}")
    return table


def used_only(faces: Ints) -> tuple[Ints, Ints]:
    """Vertices that faces refer to, ascending, and the faces in terms of them.

    >>> used, table = used_only(np.array([[7, 3, 5, -1], [3, 7, 9, 4]]))
    >>> used, table.tolist()
    (array([3, 4, 5, 7, 9]), [[3, 0, 2, -1], [0, 3, 4, 1]])
    """
    real = faces >= 0
    used, index = np.unique(faces[real], return_inverse=True)
    table = np.full_like(faces, -1)
    table[real] = index.ravel()
    return used, table


def neighbours(faces: Ints, count: int) -> Any:
    """Sparse (n, n) pattern of ones: vertices that share a face, each with itself."""
    from scipy.sparse import csr_matrix, identity

    real = faces >= 0
    face = np.broadcast_to(np.arange(len(faces))[:, None], faces.shape)[real]
    shape = (count, len(faces))
    incidence = csr_matrix((np.ones(face.size), (faces[real], face)), shape=shape)
    return _pattern(incidence @ incidence.T + identity(count))


def boundary_edges(faces: Ints, count: int) -> Ints:
    """Edges (b, 2) with one face."""
    if faces.shape[1] == 4:
        last = np.where(faces[:, 3:] < 0, faces[:, :1], faces[:, 3:])
        faces = np.hstack([faces[:, :3], last])
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    edges = edges[edges[:, 0] != edges[:, 1]]
    keys, uses = np.unique(edges[:, 0] * np.int64(count) + edges[:, 1], return_counts=True)
    return np.stack(np.divmod(keys[uses == 1], count), axis=1)


def umbrella(near: Any, boundary: Ints) -> Any:
    """Sparse (n, n) operator: each vertex less the mean of its neighbours.

    Vertices of the boundary have their neighbours along the boundary only, so that the
    operator does not pull the boundary inwards (Taubin 1995).

    >>> faces = np.array([[0, 1, 2, 3]])
    >>> umbrella(neighbours(faces, 4), boundary_edges(faces, 4)).toarray()[0]
    array([ 1. , -0.5,  0. , -0.5])
    """
    from scipy.sparse import csr_matrix, diags

    count = near.shape[0]
    inner = np.ones(count)
    inner[boundary] = 0.0
    i, j = boundary.T
    ones = np.ones(2 * len(boundary))
    along = csr_matrix((ones, (np.r_[i, j], np.r_[j, i])), shape=near.shape)
    links = diags(inner) @ (near - diags(near.diagonal())) + along
    valence = np.asarray(links.sum(axis=1)).ravel()
    return diags((valence > 0).astype(float)) - diags(1 / np.maximum(valence, 1)) @ links


@dataclass(frozen=True)
class Rings:
    """Padded vertex lists: `index` (p, k) of vertices, `real` (p, k) which entries count."""

    index: Ints
    real: NDArray[np.bool_]


def rings(near: Any, size: int) -> Rings:
    """Vertices within `size` faces of each vertex; of very many, a regular sample."""
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
        Vertices of a patch less coefficients of its fit.
    scale : ndarray, (p,)
        Factor that turns squared residuals into derivatives squared times area; their
        sum over patches does not change with the resolution.
    rows : sparse matrix, (p d, n)
        The basis, one polynomial per row.
    """

    rings: Rings
    basis: Array
    normal: Array
    freedom: Array
    scale: Array
    rows: Any

    def penalty(self, trust: Array | None = None) -> Any:
        """Sparse (n, n) matrix of the sum of squared residuals, by patch times `trust`."""
        from scipy.sparse import diags

        factor = self.scale if trust is None else self.scale * trust
        index, real = self.rings.index, self.rings.real
        each = np.broadcast_to(factor[:, None], real.shape)[real]
        total = np.bincount(index[real], each, minlength=self.rows.shape[1])
        fitted = self.rows.T @ (diags(np.repeat(factor, self.basis.shape[2])) @ self.rows)
        return (diags(total) - fitted).tocsc()

    def heights(self, points: Array) -> Array:
        """Root-mean-square residual of each patch along its normal, (p,); zero if fitted."""
        away = np.einsum("pkc,pc->pk", points[self.rings.index], self.normal) * self.rings.real
        fit = np.einsum("pkd,pk->pd", self.basis, away)
        away = away - np.einsum("pkd,pd->pk", self.basis, fit)
        return np.sqrt((away**2).sum(axis=1) / np.maximum(self.freedom, 1))


def residuals(points: Array, patches: Rings, order: int) -> Residuals:
    """Fit polynomials of degree below `order` over the planes of all patches.

    Parameters
    ----------
    points : ndarray, (n, 3)
        Where the patches lie; noise in them should be small beside the edges.
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
    # Slivers must not outweigh everything else.
    scale = np.minimum(scale, 100 * np.median(scale))
    freedom = np.maximum(size - known.sum(axis=1), 0).astype(float)
    return Residuals(patches, basis, axes[:, :, 0], freedom, scale, rows)


def _pattern(matrix: Any) -> Any:
    matrix = matrix.tocsr()
    matrix.data[:] = 1.0
    return matrix

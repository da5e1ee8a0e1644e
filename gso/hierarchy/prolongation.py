"""Smooth interpolation of a displacement that is given at some vertices of a mesh."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gso.energy import fairness
from gso.linalg import Pattern, choose
from gso.linalg.base import Solver
from gso.mesh import Mesh
from gso.typing import Array, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

#: Length over which the field is smoothed, relative to the spacing of the given vertices.
_REACH = 2.0
#: Weight of a held vertex, relative to that of a given one.
_HELD = 1e6
#: Share of the spread in every direction that the affine map needs, to be determined there.
_RIDGE = 1e-9


class Prolongation:
    """Interpolation of displacements from some vertices of a mesh to all of them.

    The field is an affine map of the vertices plus the u that minimises ::

        mean over the given vertices of |u - given|^2 + reach^4 mean |second differences of u|^2

    so that rigid motions and affine maps are reproduced. It has no kinks along the coarse edges,
    which barycentric interpolation would have, and no length above the largest one given and that
    of the affine map.

    Parameters
    ----------
    mesh : Mesh
        The finer mesh.
    ids : ndarray of int, (m,)
        The vertices with given displacements, each once; three or more.
    held : ndarray of int, (h,), optional
        Vertices at which the field takes a value, up to a thousandth of the difference; it then
        has no kinks around vertices that constraints fix.

    Examples
    --------
    >>> x, y = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9), indexing="ij")
    >>> mesh = Mesh.from_grid(np.dstack([x, y, x * y]))
    >>> ids = np.arange(0, 81, 2)
    >>> field = Prolongation(mesh, ids)(0.1 * mesh.vertices[ids])
    >>> bool(np.allclose(field, 0.1 * mesh.vertices, atol=1e-6))
    True
    """

    def __init__(self, mesh: Mesh, ids: Ints, held: Ints | None = None):
        self.mesh, self.ids = mesh, ids
        self.held = np.zeros(0, np.int64) if held is None else held

    @cached_property
    def _solver(self) -> Solver:
        from scipy.sparse import diags, tril

        mesh, ids = self.mesh, self.ids
        n = len(mesh.vertices)
        bend = _bending(mesh)
        ends = mesh.vertices[mesh.edges]
        edge2 = float(((ends[:, 1] - ends[:, 0]) ** 2).sum(axis=1).mean())
        # The squared spacing of the m given vertices among n: edge^2 n / m.
        reach4 = (_REACH**2 * edge2 * n / len(ids)) ** 2
        given = np.zeros(n)
        given[ids] = 1.0
        given[~mesh.used] = 1.0
        given[self.held] += _HELD
        matrix = diags(given) + reach4 * len(ids) / max(bend.shape[0], 1) * (bend.T @ bend)
        lower = tril(matrix.tocsc(), format="csc")
        lower.sort_indices()
        pattern = Pattern(n, lower.indptr.astype(np.int64), lower.indices.astype(np.int64))
        solver = choose(pattern)
        solver.factor(lower.data)
        return solver

    def __call__(self, displacement: Array, held: Array | None = None) -> Array:
        """Interpolate displacements (m, 3) of the given vertices and (h, 3) of the held, (n, 3)."""
        points = self.mesh.vertices
        affine = _affine(points[self.ids], displacement)
        rest = np.zeros_like(points)
        rest[self.ids] = displacement - affine(points[self.ids])
        if held is not None:
            rest[self.held] += _HELD * (held - affine(points[self.held]))
        base = affine(points)
        field = self._solver.solve(rest) + base
        field[~self.mesh.used] = 0.0
        length = np.linalg.norm(field, axis=1, keepdims=True)
        largest = displacement if held is None else np.concatenate([displacement, held])
        most = np.maximum(
            np.linalg.norm(largest, axis=1).max(initial=0.0),
            np.linalg.norm(base, axis=1, keepdims=True),
        )
        return np.asarray(field * np.minimum(1.0, most / np.maximum(length, 1e-300)))


def _bending(mesh: Mesh) -> csr_matrix:
    """Return the matrix (m, n) of second differences that reach every vertex of a face.

    Where no polyline goes through a vertex, they are those across the edges around it.
    """
    from scipy.sparse import csr_matrix, vstack

    n = len(mesh.vertices)
    parts = [fairness.differences(mesh)]
    missed = mesh.used.copy()
    missed[parts[0][0]] = False
    if missed.any():
        stencil, coefficients = fairness.hinge_differences(mesh)
        around = missed[stencil].any(axis=1)
        parts.append((stencil[around], coefficients[:, around]))
    return vstack(
        [
            csr_matrix(
                (c.T.ravel(), ids.ravel(), ids.shape[1] * np.arange(len(ids) + 1)),
                shape=(len(ids), n),
            )
            for ids, c in parts
        ],
        format="csr",
    )


def _affine(points: Array, values: Array) -> Callable[[Array], Array]:
    """Fit an affine map to values (m, 3) at points (m, 3)."""
    centre, mean = points.mean(axis=0), values.mean(axis=0)
    x = points - centre
    gram = x.T @ x
    gram += _RIDGE * max(float(np.trace(gram)), 1e-300) * np.eye(3)
    matrix = np.linalg.solve(gram, x.T @ (values - mean))
    return lambda at: (at - centre) @ matrix + mean

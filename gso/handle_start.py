"""A surface that follows its handles: where solves with moved handles start from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gso.components import Component, several, split
from gso.mesh import Mesh
from gso.terms import fairness
from gso.variables import vertex_normals

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Weight of a field's slope, relative to its bending, and of its size, which counts only where
#: no handle is.
_SLOPE, _SIZE = 1e-6, 1e-12
#: Height of a bulge, relative to that of an arc as long as the surface was.
_BULGE = 0.5
#: Mean shortening of the edges from which on a surface bulges.
_SHORTER = 1e-9
#: Share by which a bulge to the other side has to be better.
_EVEN = 1e-3
#: Singular value, relative to the largest, that is no direction.
_THIN = 1e-9


class Spread:
    """Displacement of some vertices, spread over a surface with the least bending.

    The field with the smallest squared second differences (a thin plate with free ends):
    affine where the handles allow it.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    ids : ndarray of int, (k,)
        Vertices whose displacement is given, each once.

    Examples
    --------
    >>> y, x = np.mgrid[:5.0, :5.0]
    >>> mesh = Mesh.from_grid(np.stack([x, y, 0 * x], axis=-1))
    >>> ends = np.r_[0:5, 20:25]
    >>> field = Spread(mesh, ends)(mesh.vertices[ends])
    >>> bool(np.allclose(field, mesh.vertices, atol=1e-4))
    True
    """

    def __init__(self, mesh: Mesh, ids: Ints):
        from scipy.sparse import csr_matrix, identity
        from scipy.sparse.linalg import splu

        n = len(mesh.vertices)
        self.mesh, self.ids = mesh, ids
        #: Components, which of the handles they have, and their own fields.
        self.parts: list[tuple[Component, NDArray[np.bool_], Spread]] = []
        if several(mesh):
            for part in split(mesh):
                own = np.searchsorted(part.vertices, ids).clip(max=len(part.vertices) - 1)
                here = part.vertices[own] == ids
                self.parts.append((part, here, Spread(part.mesh, own[here])))
            return
        self.free = np.setdiff1d(np.arange(n), ids)
        stencil, coefficients = fairness.differences(mesh)
        count, width = stencil.shape
        bend = csr_matrix(
            (coefficients.T.ravel(), stencil.ravel(), width * np.arange(count + 1)),
            shape=(count, n),
        )
        a, b = mesh.edges.T
        signs = np.tile([1.0, -1.0], len(a))
        slope = csr_matrix(
            (signs, np.stack([a, b], axis=1).ravel(), 2 * np.arange(len(a) + 1)),
            shape=(len(a), n),
        )
        energy = bend.T @ bend
        typical = float(energy.diagonal().mean()) or 1.0
        energy = energy + _SLOPE * typical * (slope.T @ slope) + _SIZE * typical * identity(n)
        rows = energy.tocsr()[self.free]
        self._coupling = rows[:, ids]
        self._factor = None
        if len(self.free):
            self._factor = splu(
                rows[:, self.free].tocsc(),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )

    def __call__(self, displacement: Array) -> Array:
        """Field (n, 3) from the displacement (k, 3) of the handles."""
        field = np.zeros((len(self.mesh.vertices), displacement.shape[1]))
        field[self.ids] = displacement
        if self.parts:
            for part, here, own in self.parts:
                field[part.vertices] = own(displacement[here])
            return field
        if self._factor is not None:
            field[self.free] = self._factor.solve(-(self._coupling @ displacement))
        return field

    def deflection(self) -> Array:
        """Shape (n,) under an even load, largest value one; zero at the handles."""
        out = np.zeros(len(self.mesh.vertices))
        if self.parts:
            for part, _, own in self.parts:
                out[part.vertices] = own.deflection()
            return out
        if self._factor is not None:
            load = np.where(self.mesh.used[self.free], 1.0, 0.0)
            out[self.free] = self._factor.solve(load)
        return out / max(float(np.abs(out).max()), 1e-300)


def follow(mesh: Mesh, spread: Spread, targets: Array) -> Array:
    """Vertices (n, 3) of a surface whose handles are at their targets.

    The surface moves rigidly with its handles as far as it can, part by part; what is left of
    their motion is spread. Where that makes the surface shorter it bulges along its normals:
    a sheet that is pressed together in its plane would not know which way to go.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    spread : Spread
        Of its handles.
    targets : ndarray, (k, 3)
        Where they go.
    """
    points = mesh.vertices.copy()
    if spread.parts:
        for piece, here, own in spread.parts:
            points[piece.vertices] = follow(piece.mesh, own, targets[here])
        return points
    for part in np.unique(mesh.components[spread.ids]):
        which = mesh.components[spread.ids] == part
        inside = mesh.components == part
        turn, shift = _motion(mesh.vertices[spread.ids[which]], targets[which])
        points[inside] = mesh.vertices[inside] @ turn.T + shift
    points += spread(targets - points[spread.ids])
    shorter = _lost(mesh, points)
    if shorter > _SHORTER:
        height = _BULGE * mesh.frame.scale * np.sqrt(shorter)
        bulge = height * spread.deflection()[:, None] * vertex_normals(mesh.replaced(points))
        inwards = _lost(mesh, points - bulge) < (1.0 - _EVEN) * _lost(mesh, points + bulge)
        points = points - bulge if inwards else points + bulge
    return points


def _lost(mesh: Mesh, points: Array) -> float:
    """Share of its edges' length that a surface loses; what edges gain does not count."""
    a, b = mesh.edges.T
    before, after = (np.linalg.norm(p[a] - p[b], axis=1) for p in (mesh.vertices, points))
    return float(np.maximum(before - after, 0.0).sum() / before.sum())


def _motion(points: Array, targets: Array) -> tuple[Array, Array]:
    """Rotation (3, 3) and shift (3,) that bring points (k, 3) closest to targets.

    Where the points do not say how to turn, as little as possible.
    """
    from scipy.spatial.transform import Rotation

    here, there = points.mean(axis=0), targets.mean(axis=0)
    p, q = points - here, targets - there
    u, s, vt = np.linalg.svd(q.T @ p)
    if s[0] <= _THIN**2 * max(float((p * p).sum()), 1e-300):
        turn = np.eye(3)
    elif s[1] <= _THIN * s[0]:
        turn = Rotation.align_vectors(u[:, 0], vt[0])[0].as_matrix()
    else:
        turn = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    return turn, there - turn @ here

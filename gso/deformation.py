"""Deformation of a surface that follows its handles: the start of solves with moved handles."""

from __future__ import annotations

import numpy as np

from gso.components import Component, several, split
from gso.energy import fairness
from gso.geometry import closest_motion
from gso.linalg import spd
from gso.mesh import Mesh, vertex_normals
from gso.typing import Array, Flags, Ints, Solve

#: Weights of a field's slope and of its size, relative to its bending. They only select a
#: solution where the handles leave the thin plate free.
_SLOPE, _SIZE = 1e-6, 1e-12
#: Height of the bulge, as a factor on size * sqrt(relative shortening).
_BULGE = 0.5
#: Relative shortening of the edges above which the surface is made to bulge.
_SHORTER = 1e-9
#: Relative improvement that is required to bulge against the normals instead of along them.
_EVEN = 1e-3


class ThinPlateField:
    """Interpolation of handle displacements over a surface with the least bending.

    The field minimises the squared second differences (a thin plate with free ends), so it is
    affine where the handles allow it. The matrix is factorised once.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    ids : ndarray of int, (k,)
        The handles: vertices with given displacements, each once.

    Examples
    --------
    >>> y, x = np.mgrid[:5.0, :5.0]
    >>> mesh = Mesh.from_grid(np.stack([x, y, 0 * x], axis=-1))
    >>> ends = np.r_[0:5, 20:25]
    >>> field = ThinPlateField(mesh, ends)(mesh.vertices[ends])
    >>> bool(np.allclose(field, mesh.vertices, atol=1e-4))
    True
    """

    def __init__(self, mesh: Mesh, ids: Ints):
        from scipy.sparse import csr_matrix, identity

        n = len(mesh.vertices)
        self.mesh, self.ids = mesh, ids
        #: Per component: the component, a mask of its handles, and its own field.
        self.parts: list[tuple[Component, Flags, ThinPlateField]] = []
        if several(mesh):
            for part in split(mesh):
                own = np.searchsorted(part.vertices, ids).clip(max=len(part.vertices) - 1)
                here = part.vertices[own] == ids
                self.parts.append((part, here, ThinPlateField(part.mesh, own[here])))
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
        self._solve: Solve | None = None
        if len(self.free):
            self._solve = spd(rows[:, self.free])

    def __call__(self, displacement: Array) -> Array:
        """Interpolate the displacements (k, 3) of the handles, (n, 3)."""
        field = np.zeros((len(self.mesh.vertices), displacement.shape[1]))
        field[self.ids] = displacement
        if self.parts:
            for part, here, own in self.parts:
                field[part.vertices] = own(displacement[here])
            return field
        if self._solve is not None:
            field[self.free] = self._solve(-(self._coupling @ displacement))
        return field

    def deflection(self) -> Array:
        """Return the deflection (n,) under a uniform load: zero at the handles, largest value 1."""
        out = np.zeros(len(self.mesh.vertices))
        if self.parts:
            for part, _, own in self.parts:
                out[part.vertices] = own.deflection()
            return out
        if self._solve is not None:
            load = np.where(self.mesh.used[self.free], 1.0, 0.0)
            out[self.free] = self._solve(load)
        return out / max(float(np.abs(out).max()), 1e-300)


def follow(mesh: Mesh, spread: ThinPlateField, targets: Array) -> Array:
    """Deform a surface so that its handles reach their targets, (n, 3).

    Each component follows the best rigid motion of its handles. The remaining displacement of
    the handles is interpolated. If that shortens the surface, a bulge along the normals is
    added: without it, a sheet compressed in its plane has no preferred side to buckle to.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    spread : ThinPlateField
        Interpolation from its handles.
    targets : ndarray, (k, 3)
        Positions that the handles move to.
    """
    points: Array = mesh.vertices.copy()
    if spread.parts:
        for piece, here, own in spread.parts:
            points[piece.vertices] = follow(piece.mesh, own, targets[here])
        return points
    for part in np.unique(mesh.components[spread.ids]):
        which = mesh.components[spread.ids] == part
        inside = mesh.components == part
        turn, shift = closest_motion(mesh.vertices[spread.ids[which]], targets[which])
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
    """Return the relative shortening of the edges in total; edges that grow are ignored."""
    a, b = mesh.edges.T
    before, after = (np.linalg.norm(p[a] - p[b], axis=1) for p in (mesh.vertices, points))
    return float(np.maximum(before - after, 0.0).sum() / before.sum())

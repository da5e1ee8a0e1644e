"""Proximity to reference points, with a smaller weight on tangential displacement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gso.energy.base import Term
from gso.geometry import dot, sub
from gso.mesh import Mesh, Nearest
from gso.typing import Array, S, Vec

#: The reference does not move with the surface.
INVARIANT = ()


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return ``t u + (1 - t) (u.n) n`` of the displacement u from the reference point.

    Constants: reference point (3), unit normal n (3), factor t on the tangential part.
    """
    u = sub(points[0], tuple(constants[0:3]))
    n = tuple(constants[3:6])
    t = constants[6]
    along = (1.0 - t) * dot(u, n)
    return tuple(t * a + along * b for a, b in zip(u, n, strict=True))


def build(mesh: Mesh, normals: Array, *, tangential: float | Array = 1.0) -> Term:
    """Build the proximity of every vertex to its position in `mesh`.

    Parameters
    ----------
    mesh : Mesh
        Reference surface.
    normals : ndarray, (n, 3)
        Unit normals at its vertices.
    tangential : float or ndarray, (n,)
        Factor on the tangential part of the displacement.
    """
    n = len(mesh.vertices)
    factor = np.broadcast_to(np.asarray(tangential, float), n)[None]
    constants = np.concatenate([mesh.vertices.T, normals.T, factor])
    return Term(
        "proximity",
        residual,
        (("surface", np.arange(n)[:, None]),),
        weights=mesh.used / mesh.used.sum(),
        constants=constants,
        linear=True,
    )


def closest(mesh: Mesh, normals: Array, *, tangential: float = 0.0) -> Term:
    """Build the proximity of the block "surface" to the surface `mesh`, with free sliding.

    Before every linearisation each vertex gets the closest point of the surface and the
    tangent plane there as its target (iterated closest points; Jiang et al. 2020).

    Parameters
    ----------
    mesh, normals
        As for :func:`build`.
    tangential : float
        Factor on the tangential distance to the closest point; 0 leaves only the distance to
        the tangent plane.
    """
    near = Nearest(mesh, normals)
    own = build(mesh, normals, tangential=tangential)

    def refresh(blocks: Mapping[str, Array]) -> Array:
        feet = near.feet(blocks["surface"])
        return np.concatenate([feet.points.T, feet.normals.T, own.constants[6:]])

    return replace(own, name="closest", refresh=refresh)

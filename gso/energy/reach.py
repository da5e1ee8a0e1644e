"""Displacement from reference points over how far each may move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gso.energy import proximity
from gso.energy.base import Term
from gso.mesh import Mesh
from gso.typing import Array, S, Vec

#: The reference does not move with the surface.
INVARIANT = ()


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return the displacement of :mod:`gso.energy.proximity` over the last constant."""
    moved = proximity.residual(points, constants[:7])
    return tuple(x / constants[7] for x in moved)


def build(mesh: Mesh, normals: Array, limits: Array, *, tangential: float | Array = 0.0) -> Term:
    """Build the displacement of every vertex over its limit.

    Weights are those of the squared displacement.

    Parameters
    ----------
    mesh : Mesh
        Reference surface.
    normals : ndarray, (n, 3)
        Unit normals at its vertices.
    limits : ndarray, (n,)
        How far each may move, above 0.
    tangential : float or ndarray, (n,)
        Factor on the tangential part of a displacement.
    """
    near = proximity.build(mesh, normals, tangential=tangential)
    return replace(
        near,
        name="reach",
        residual=residual,
        weights=near.weights * limits**2,
        constants=np.concatenate([near.constants, limits[None]]),
    )

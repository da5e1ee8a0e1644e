"""Shear of the flat image: the part of the strain that is linear in the unknowns."""

from __future__ import annotations

from collections.abc import Sequence

from gso import geometry
from gso.energy.base import Term
from gso.energy.stretch import corners_of, per_corner, rest_constants
from gso.mesh import Mesh
from gso.typing import S, Vec

#: Rigid motions of the flat image do not change the norm of the shear.
INVARIANT = ("translation", "rotation")


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return (c, d) of each corner triangle of a face, see :mod:`gso.geometry.strain`.

    Constants: the three numbers of :func:`gso.geometry.rest_frame` per corner triangle.
    """
    out: list[S] = []
    for n, corner in enumerate(corners_of(len(points))):
        p, q, r = (points[k] for k in corner)
        m11, m12, m22 = constants[3 * n : 3 * n + 3]
        out += geometry.turn_and_shear(p, q, r, (m11, m12, m22))[1:]
    return tuple(out)


def build(mesh: Mesh) -> list[Term]:
    """Build the shear of all corner triangles; weights average over triangles.

    It is a cheap regulariser: its Hessian is constant, and couples only vertices of one face.
    """
    return per_corner(mesh, "shear", residual, rest_constants, linear=True)

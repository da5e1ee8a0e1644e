"""Quantities of a smooth surface from the derivatives of its parametrisation."""

from __future__ import annotations

from gso.geometry.vector import cross, dot, norm
from gso.typing import S, Vec


def smooth_gaussian_curvature(su: Vec[S], sv: Vec[S], suu: Vec[S], suv: Vec[S], svv: Vec[S]) -> S:
    """Return the Gaussian curvature of a parametrised surface, 1 / length^2.

    The determinant of the second fundamental form over that of the first,
    ``((suu.n)(svv.n) - (suv.n)^2) / |su x sv|^2`` with the unit normal n. Zero where the
    parametrisation degenerates.

    Parameters
    ----------
    su, sv, suu, suv, svv : tuple of 3 numbers
        First and second derivatives of the surface with respect to its parameters.

    Examples
    --------
    The paraboloid ``(u, v, (u^2 + v^2) / 2)`` at its apex:

    >>> su, sv, zero, up = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    >>> float(smooth_gaussian_curvature(su, sv, up, zero, up))
    1.0
    """
    normal = cross(su, sv)
    length = norm(normal)
    n = tuple(c / length for c in normal)
    bending = dot(suu, n) * dot(svv, n) - dot(suv, n) * dot(suv, n)
    return bending / (length * length)

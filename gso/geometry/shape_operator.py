"""The shape operator of a face, from two tangents and the changes of the normal along them."""

from __future__ import annotations

from gso.geometry import ops
from gso.geometry.strain import inverse_frame
from gso.geometry.vector import cross, dot, norm
from gso.typing import S, Vec

#: Rows of a 2 x 2 matrix.
Matrix = tuple[tuple[S, S], tuple[S, S]]


def tangent_frame(a: Vec[S], b: Vec[S]) -> tuple[Vec[S], Vec[S], Vec[S]]:
    """Return orthonormal ``(e, f, n)``: `e` along `a`, `f` towards `b`, `n` along ``a x b``.

    `a` and `b` must span an area.
    """
    normal = cross(a, b)
    length, area = norm(a), norm(normal)
    e = tuple(x / length for x in a)
    n = tuple(x / area for x in normal)
    return e, cross(n, e), n


def shape_matrix(a: Vec[S], b: Vec[S], da: Vec[S], db: Vec[S]) -> Matrix[S]:
    """Return the shape operator of a face in the tangent frame of `a` and `b`, 1 / length.

    The linear map that takes the tangents `a` and `b` to the changes `da` and `db` of the
    normal along them, projected to their plane. For a quad these are the diagonals of the
    face and of its Gauss image (Jiang et al. 2020); for a triangle two sides, and the map
    is the derivative of the normal interpolated from the corners.

    It is the derivative of the normal itself, not its negative: positive where the surface
    bends away from its normal. The determinant is Jiang's discrete Gaussian curvature
    ``det(da, db, n) / det(a, b, n)``, half the trace the mean curvature. The matrix is
    symmetric up to the error of discretisation.

    Examples
    --------
    On a sphere of radius 2 the normal is half the position:

    >>> s = shape_matrix((1., 0., 0.), (1., 1., 0.), (.5, 0., 0.), (.5, .5, 0.))
    >>> float(determinant(s)), float(half_trace(s))
    (0.25, 0.5)
    """
    e, f, _ = tangent_frame(a, b)
    m11, m12, m22 = inverse_frame(a, b)
    first = tuple(p * m11 for p in da)
    second = tuple(p * m12 + q * m22 for p, q in zip(da, db, strict=True))
    return (dot(first, e), dot(second, e)), (dot(first, f), dot(second, f))


def determinant(s: Matrix[S]) -> S:
    """Return the Gaussian curvature of a shape operator, 1 / length^2."""
    return s[0][0] * s[1][1] - s[0][1] * s[1][0]


def half_trace(s: Matrix[S]) -> S:
    """Return the mean curvature of a shape operator, 1 / length."""
    return 0.5 * (s[0][0] + s[1][1])


def eigen(p: S, q: S, r: S) -> tuple[S, S, S]:
    """Return the eigenvalues of ``((p, q), (q, r))``, and the angle of the first eigenvector.

    Returns ``(high, low, angle)``: `high` >= `low`, and the eigenvector of `high` is
    (cos, sin) of `angle`, radians. For equal eigenvalues the angle is 0.

    >>> [float(x) for x in eigen(0.0, 1.0, 0.0)]
    [1.0, -1.0, 0.785]
    """
    middle, half = 0.5 * (p + r), 0.5 * (p - r)
    spread = ops.sqrt(half * half + q * q)
    return middle + spread, middle - spread, 0.5 * ops.atan2(q, half)

"""Membrane strain of one triangle mapped from space to the plane.

The map of a triangle is a 2 x 2 matrix F from the plane of the triangle in space to the flat
image. Let ``Q = |((F11 + F22)/2, (F21 - F12)/2)|`` (its conformal part: rotation and scale)
and ``R = |((F11 - F22)/2, (F21 + F12)/2)|`` (its shear). The singular values are ``Q + R``
and ``Q - R``, the second one negative when the triangle is inverted.
"""

from __future__ import annotations

from gso.geometry import ops
from gso.geometry.vector import cross, dot, norm, norm2, sub
from gso.typing import S, Vec


def rest_frame(p: Vec[S], q: Vec[S], r: Vec[S]) -> tuple[S, S, S]:
    """Return the inverse rest matrix of a triangle in space, upper triangle ``(m11, m12, m22)``.

    In the frame of the triangle's plane the edges ``q - p`` and ``r - p`` are the columns of
    ``[[l, u], [0, h]]``; this is the inverse of that matrix. It grows without bound as
    the triangle's area vanishes, so leave such triangles out.
    """
    return inverse_frame(sub(q, p), sub(r, p))


def inverse_frame(e: Vec[S], f: Vec[S]) -> tuple[S, S, S]:
    """Return :func:`rest_frame` of a triangle from its edges at the first corner."""
    length = norm(e)
    height = norm(cross(e, f)) / length
    return 1.0 / length, -dot(e, f) / (length * length * height), 1.0 / height


def singular_values(p: Vec[S], q: Vec[S], r: Vec[S], rest: tuple[S, S, S]) -> tuple[S, S]:
    """Return the principal stretches ``(s1, s2)`` of a triangle; ``s2 < 0`` when it is inverted."""
    q_part, c, d = turn_and_shear(p, q, r, rest)
    big, small = norm(q_part), ops.sqrt(norm2((c, d)))
    return big + small, big - small


def turn_and_shear(p: Vec[S], q: Vec[S], r: Vec[S], rest: tuple[S, S, S]) -> tuple[Vec[S], S, S]:
    """Return the parts ``((q1, q2), c, d)`` of a triangle's map, all linear in the unknowns.

    ``Q = |(q1, q2)|`` is the conformal part (rotation and scale), ``R = |(c, d)|`` the shear.
    """
    m11, m12, m22 = rest
    e, f = sub(q, p), sub(r, p)
    f11, f21 = e[0] * m11, e[1] * m11
    f12, f22 = e[0] * m12 + f[0] * m22, e[1] * m12 + f[1] * m22
    return (
        (0.5 * (f11 + f22), 0.5 * (f21 - f12)),
        0.5 * (f11 - f22),
        0.5 * (f21 + f12),
    )

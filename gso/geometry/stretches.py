"""Principal stretches of a face between two surfaces, from its first fundamental forms."""

from __future__ import annotations

from gso.geometry import ops
from gso.geometry.cells import diagonals
from gso.geometry.vector import dot, norm2, sub
from gso.typing import S, Vec


def first_form(*corners: Vec[S]) -> tuple[S, S, S]:
    """Return ``(E, F, G)`` of a face: inner products of two vectors that span it.

    These are the diagonals of a quad, which span its parallelogram of edge midpoints (Jiang et
    al. 2020), and the sides at the first corner of a triangle.
    """
    if len(corners) == 4:
        a, b = diagonals(*corners)
    else:
        a, b = sub(corners[1], corners[0]), sub(corners[2], corners[0])
    return norm2(a), dot(a, b), norm2(b)


def principal_stretches(rest: tuple[S, S, S], image: tuple[S, S, S]) -> tuple[S, S]:
    """Return the largest and smallest ratio ``(s1, s2)`` of lengths, image over rest.

    Takes the :func:`first_form` of the face on both surfaces, which may lie in space; `rest`
    must have an area. The product of the stretches is the ratio of areas; their quotient is
    one for a conformal map.

    >>> [round(float(s), 12) for s in principal_stretches((1.0, 0.0, 1.0), (4.0, 0.0, 9.0))]
    [3.0, 2.0]
    """
    e, f, g = rest
    area2 = e * g - f * f
    m11 = image[0] / e
    m12 = (image[1] - f * m11) / ops.sqrt(area2)
    m22 = (image[2] * e - 2.0 * f * image[1] + f * f * m11) / area2
    middle, half = 0.5 * (m11 + m22), ops.sqrt(0.25 * (m11 - m22) * (m11 - m22) + m12 * m12)
    return ops.sqrt(middle + half), ops.sqrt(middle - half)

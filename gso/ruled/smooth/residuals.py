"""Residuals of smooth strips, each of one span or ruling, in the form of :mod:`gso.energy`."""

from __future__ import annotations

from collections.abc import Sequence

from gso import geometry
from gso.geometry import ops
from gso.typing import S, Vec

#: Least speed across the rulings, relative to that of the strips, and least length of the
#: rulings; the rounding of both bounds.
_SPEED, _LENGTH, _ROUND = 0.2, 0.4, 1e-2

Points = Sequence[Vec[S]]
Numbers = Sequence[S]


def _sum(weights: Sequence[S | float], points: Points[S]) -> Vec[S]:
    return tuple(
        sum(w * x for w, x in zip(weights, parts, strict=True))
        for parts in zip(*points, strict=True)
    )


def _mixed(v: S, p: Vec[S], q: Vec[S]) -> Vec[S]:
    return tuple((1 - v) * x + v * y for x, y in zip(p, q, strict=True))


def _below(x: S) -> S:
    """Return the negative part of a number, rounded off at zero."""
    return 0.5 * (x - ops.sqrt(x * x + _ROUND**2))


def turn_residual(points: Points[S], constants: Numbers[S]) -> Vec[S]:
    """Return the difference of the unit normals at two places of a ruling.

    It is zero for a torsal ruling, along which the tangent plane is constant.

    Points: end, derivative, next end, derivative of one curve, and of the other. Constants:
    weights of the four for the value, then for the derivative; the places from 0 to 1; the
    square of a small length that bounds the length of the normals from below.
    """
    value, slope, (v0, v1, least) = constants[:4], constants[4:8], constants[8:]
    one, two = points[:4], points[4:]
    way = geometry.sub(_sum(value, two), _sum(value, one))
    speeds = _sum(slope, one), _sum(slope, two)
    normals = [geometry.cross(_mixed(v, *speeds), way) for v in (v0, v1)]
    sizes = [ops.sqrt(geometry.dot(n, n) + least) for n in normals]
    return tuple(a / sizes[0] - b / sizes[1] for a, b in zip(*normals, strict=True))


def speed_residual(points: Points[S], constants: Numbers[S]) -> Vec[S]:
    """Return by how much speeds across the rulings are too low, at two places of a ruling.

    Constants: weights of the four points of a curve; the places; the direction (3) across the
    rulings; the width of the span at both places.
    """
    weights, places, side = constants[:4], constants[4:6], tuple(constants[6:9])
    widths = constants[9:]
    speeds = _sum(weights, points[:4]), _sum(weights, points[4:])
    return tuple(
        _below(geometry.dot(_mixed(v, *speeds), side) / w - _SPEED)
        for v, w in zip(places, widths, strict=True)
    )


def length_residual(points: Points[S], constants: Numbers[S]) -> Vec[S]:
    """Return by how much a ruling is too short.

    Constants: weights of the four points of a curve; the direction (3) of the rulings; the
    length.
    """
    weights, along, length = constants[:4], tuple(constants[4:7]), constants[7]
    way = geometry.sub(_sum(weights, points[4:]), _sum(weights, points[:4]))
    return (_below(geometry.dot(way, along) / length - _LENGTH),)


def distance_residual(points: Points[S], constants: Numbers[S]) -> Vec[S]:
    """Return the distance of a point from a plane.

    Constants: weights of the four points of a curve; the place on the ruling; the plane's
    normal (3), and its offset.
    """
    weights, v, offset = constants[:4], constants[4], constants[8]
    normal = tuple(constants[5:8])
    at = _mixed(v, _sum(weights, points[:4]), _sum(weights, points[4:]))
    return (geometry.dot(at, normal) - offset,)


def bend_residual(points: Points[S], constants: Numbers[S]) -> Vec[S]:
    """Return the second derivatives of a curve at both ends of a span, times its squared width.

    Constants: the width.
    """
    p, a, q, b = points
    h = constants[0]
    first = _sum((-6, -4 * h, 6, -2 * h), (p, a, q, b))
    return (*first, *_sum((6, 2 * h, -6, 4 * h), (p, a, q, b)))


def jump_residual(points: Points[S], constants: Numbers[S]) -> Vec[S]:
    """Return the jump of the second derivative of a curve at a ruling, times a squared width.

    Points: end, derivative, the end in the middle, its derivative, next end, derivative.
    Constants: the factors of the six.
    """
    return _sum(constants, points)


def break_residual(points: Points[S], constants: Numbers[S]) -> Vec[S]:
    """Return the difference of the unit normals before and after a ruling, at a place of it.

    Points: both ends; the derivatives of both curves before, and those after. Constants: the
    place; the square of a small length; 1, or -1 where derivatives after it are backwards.
    """
    p, q, *slopes = points
    v, least, sign = constants
    way = geometry.sub(q, p)
    normals = [geometry.cross(_mixed(v, *x), way) for x in (slopes[:2], slopes[2:])]
    one, two = (ops.sqrt(geometry.dot(n, n) + least) for n in normals)
    return tuple(a / one - sign * b / two for a, b in zip(*normals, strict=True))


def joined_residual(points: Points[S], constants: Numbers[S]) -> Vec[S]:
    """Return the differences of a flat triangle's unit normal from two at a ruling beside it.

    Points and constants as for :func:`turn_residual`, then the triangle's third corner, and the
    sign of its normal.
    """
    one, two, third = points[:4], points[4:8], points[8]
    value, slope, (v0, v1, least, sign) = constants[:4], constants[4:8], constants[8:]
    p, q = _sum(value, one), _sum(value, two)
    way = geometry.sub(q, p)
    flat = geometry.cross(geometry.sub(third, p), way)
    size = ops.sqrt(geometry.dot(flat, flat) + least)
    speeds = _sum(slope, one), _sum(slope, two)
    out: list[S] = []
    for v in (v0, v1):
        normal = geometry.cross(_mixed(v, *speeds), way)
        own = ops.sqrt(geometry.dot(normal, normal) + least)
        out += [a / own - sign * b / size for a, b in zip(normal, flat, strict=True)]
    return tuple(out)

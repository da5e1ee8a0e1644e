"""Vectors as component tuples of length 2 or 3."""

from __future__ import annotations

from gso.geometry import ops
from gso.typing import S, Vec


def sub(a: Vec[S], b: Vec[S]) -> Vec[S]:
    """Return the difference ``a - b``."""
    return tuple(p - q for p, q in zip(a, b, strict=True))


def dot(a: Vec[S], b: Vec[S]) -> S:
    """Return the inner product."""
    total = a[0] * b[0]
    for p, q in zip(a[1:], b[1:], strict=True):
        total = total + p * q
    return total


def cross(a: Vec[S], b: Vec[S]) -> Vec[S]:
    """Return the cross product of two vectors in space."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def norm2(a: Vec[S]) -> S:
    """Return the squared length."""
    return dot(a, a)


def norm(a: Vec[S]) -> S:
    """Return the length; zero vectors have a finite derivative."""
    return ops.sqrt(norm2(a))


def angle(a: Vec[S], b: Vec[S]) -> S:
    """Return the angle between vectors, from 0 to pi, by atan2 (acos loses digits)."""
    product = cross(a, b) if len(a) == 3 else (a[0] * b[1] - a[1] * b[0],)
    return ops.atan2(norm(product), dot(a, b))

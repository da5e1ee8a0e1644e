"""Quantities of one quad cell with corners v0 v1 v2 v3 in cyclic order."""

from __future__ import annotations

from typing import Any

from gso.geometry.vector import Vec, dot, norm, sub


def diagonals(v0: Vec, v1: Vec, v2: Vec, v3: Vec) -> tuple[Vec, Vec]:
    """Diagonals ``a = v0 - v2`` and ``b = v1 - v3`` (Jiang et al. 2020)."""
    return sub(v0, v2), sub(v1, v3)


def isometry_defect(a: Vec, b: Vec, a2: Vec, b2: Vec) -> tuple[Any, Any, Any]:
    """What two cells with diagonals (a, b) and (a2, b2) lack to be isometric.

    The differences of the diagonals' *lengths* and of their dot product, as in the
    metric ``loss_iso-cell`` of Wang et al. 2024. All zero: the parallelograms of edge
    midpoints are congruent.
    """
    return norm(a) - norm(a2), norm(b) - norm(b2), dot(a, b) - dot(a2, b2)


def corner_area2(p: Vec, q: Vec, r: Vec) -> Any:
    """Doubled signed area of the plane triangle p q r; positive when anticlockwise."""
    a, b = sub(q, p), sub(r, p)
    return a[0] * b[1] - a[1] * b[0]

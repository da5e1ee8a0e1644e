"""Linear equations between coordinates as soft constraints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gso.constraints import OnPlane, Relations
from gso.energy.base import Array, Ints, Term
from gso.geometry import dot
from gso.mesh import Mesh

#: The equations do not move with the surface.
INVARIANT = ()


def residual(points: Sequence[tuple[Any, ...]], constants: Sequence[Any]) -> tuple[Any, ...]:
    """Return ``sum of a_k . p_k - b``. Constants: the components of every a_k, then b."""
    dim = len(points[0])
    total = -constants[-1]
    for k, point in enumerate(points):
        total = total + dot(tuple(constants[dim * k : dim * (k + 1)]), point)
    return (total,)


def build(part: OnPlane | Relations, *, block: str = "surface") -> Term:
    """Build the soft constraint of vertices to a plane, or to affine images of other vertices."""
    if isinstance(part, OnPlane):
        count = len(part.ids)
        rows = np.tile(np.r_[part.normal, part.normal @ part.anchor], (count, 1))
        return _term(part.ids[:, None], rows, block)
    dim, count = len(part.matrix), len(part.first)
    shift = part.anchor - part.matrix @ part.anchor
    each = np.concatenate([-part.matrix, np.eye(dim), shift[:, None]], axis=1)
    index = np.repeat(np.stack([part.first, part.second], axis=1), dim, axis=0)
    return _term(index, np.tile(each, (count, 1)), block)


def _term(index: Ints, rows: Array, block: str) -> Term:
    return Term(
        "equation",
        residual,
        ((block, index),),
        weights=np.ones(len(index)),
        constants=rows.T.copy(),
        linear=True,
    )


def examples(mesh: Mesh) -> list[Term]:
    """Build terms for the conformance tests."""
    ids, out = np.arange(4), []
    for block, dim in (("surface", 3), ("flat", 2)):
        normal, anchor = np.full(dim, dim**-0.5), np.full(dim, 0.1)
        mirror = np.eye(dim) - 2.0 * np.outer(normal, normal)
        out.append(build(OnPlane(0, ids, normal, anchor), block=block))
        out.append(build(Relations(0, ids, ids + 5, mirror, anchor), block=block))
    return out

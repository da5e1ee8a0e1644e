"""Resistance of the surface's edges to becoming much shorter or longer than in the design."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gso import geometry
from gso.geometry import ops
from gso.mesh import Mesh
from gso.terms.base import Term

#: Turning or moving the surface changes no length.
INVARIANT = ("translation", "rotation")

#: The residual has no bound where an edge shrinks to nothing.
UNBOUNDED = True

#: Ratios of lengths between which an edge is free, inside and on the boundary.
INSIDE = (0.5, 1.8)
BOUNDARY = (0.92, 1.08)


def residual(points: Sequence[tuple[Any, ...]], constants: Sequence[Any]) -> tuple[Any, ...]:
    """``max(0, low / s - 1) + max(0, s / high - 1)`` of the ratio s of lengths, result over design.

    Zero between both ratios, so that usual changes cost nothing, and unbounded where the edge
    collapses. Constants: 1 / length in the design, low, high.
    """
    inverse, low, high = constants
    ratio = geometry.norm(geometry.sub(points[1], points[0])) * inverse
    return (-ops.minimum(1.0 - low / ratio, 0.0) - ops.minimum(1.0 - ratio / high, 0.0),)


def build(mesh: Mesh) -> Term:
    """Resistance of every edge of the block "surface", averaged over the edges.

    Those of the boundary keep closer to their lengths, and with them every boundary loop.
    """
    a, b = mesh.edges.T
    length = np.linalg.norm(mesh.vertices[a] - mesh.vertices[b], axis=1)
    count = len(length)
    measured = length > 1e-9 * length.mean()
    low, high = np.where(mesh.rim, np.transpose([BOUNDARY]), np.transpose([INSIDE]))
    constants = np.stack([1.0 / np.maximum(length, 1e-300), low, high])
    return Term(
        "elongation",
        residual,
        (("surface", mesh.edges[measured]),),
        weights=np.full(int(measured.sum()), 1.0 / count),
        constants=constants[:, measured],
    )


def examples(mesh: Mesh) -> list[Term]:
    """Terms for the conformance tests."""
    return [build(mesh)]

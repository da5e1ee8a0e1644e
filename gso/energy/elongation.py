"""Barrier that keeps the surface's edges within a range of lengths relative to the design."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso import geometry
from gso.energy.base import Term
from gso.geometry import ops
from gso.mesh import Mesh
from gso.typing import S, Vec

#: Rigid motions change no length.
INVARIANT = ("translation", "rotation")

#: The residual is unbounded as an edge collapses.
UNBOUNDED = True

#: Ratios of lengths between which the residual is zero, for interior and for boundary edges.
INSIDE = (0.5, 1.8)
BOUNDARY = (0.92, 1.08)


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return ``max(0, low / s - 1) + max(0, s / high - 1)`` of the length ratio s, result / design.

    It is zero between both ratios, so that moderate changes cost nothing, and unbounded as the
    edge collapses. Constants: 1 / length in the design, low, high.
    """
    inverse, low, high = constants
    ratio = geometry.norm(geometry.sub(points[1], points[0])) * inverse
    return (-ops.minimum(1.0 - low / ratio, 0.0) - ops.minimum(1.0 - ratio / high, 0.0),)


def build(mesh: Mesh) -> Term:
    """Build the barrier of every edge of the block "surface", averaged over the edges.

    Boundary edges have a narrower range, which also preserves the lengths of boundary loops.
    """
    length = mesh.edge_lengths
    count = len(length)
    measured = length > 1e-9 * length.mean()
    low, high = np.where(mesh.boundary_edges, np.transpose([BOUNDARY]), np.transpose([INSIDE]))
    constants = np.stack([1.0 / np.maximum(length, 1e-300), low, high])
    return Term(
        "elongation",
        residual,
        (("surface", mesh.edges[measured]),),
        weights=np.full(int(measured.sum()), 1.0 / count),
        constants=constants[:, measured],
    )

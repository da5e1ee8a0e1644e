"""Relative change of the edges' lengths in the flat image."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso import geometry
from gso.energy.base import Term, mean_weights
from gso.mesh import Mesh
from gso.typing import S, Vec

#: Rigid motions of the flat image change no length.
INVARIANT = ("translation", "rotation")


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return ``l' / l - 1``. Constants: 1 / l."""
    return (geometry.norm(vectors(points, constants)[0]) - 1.0,)


def vectors(points: Sequence[Vec[S]], constants: Sequence[S]) -> tuple[Vec[S], ...]:
    """Return the edge vector divided by its length in space."""
    return (tuple(x * constants[0] for x in geometry.sub(points[1], points[0])),)


def build(mesh: Mesh) -> Term:
    """Build the relative change of all edges of non-zero length, averaged over them."""
    length = np.linalg.norm(np.diff(mesh.vertices[mesh.edges], axis=1)[:, 0], axis=1)
    measured = length > 1e-9 * length.mean()
    length = length[measured]
    return Term(
        "edges",
        residual,
        (("flat", mesh.edges[measured]),),
        weights=mean_weights(len(length)),
        constants=1.0 / length[None],
        vectors=vectors,
    )

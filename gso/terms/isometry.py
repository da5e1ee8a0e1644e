"""Isometry of quad cells by their diagonals: the published flattening residuals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gso import geometry
from gso.mesh import Mesh
from gso.terms.base import Term, mean_weights

#: Turning or moving the flat image changes no length.
INVARIANT = ("translation", "rotation")


def residual(points: Sequence[tuple[Any, ...]], constants: Sequence[Any]) -> tuple[Any, ...]:
    """Differences of the diagonals' lengths and of their dot product (Wang et al. 2024).

    Constants: |a|, |b| and a.b of the cell in space.
    """
    a, b = geometry.diagonals(*points)
    return (
        geometry.norm(a) - constants[0],
        geometry.norm(b) - constants[1],
        geometry.dot(a, b) - constants[2],
    )


def build(mesh: Mesh) -> Term:
    """Isometry defect of every quad cell of a mesh, averaged over cells."""
    cells = mesh.faces[mesh.faces[:, 3] >= 0]
    a, b = geometry.diagonals(*(tuple(mesh.vertices[cells[:, k]].T) for k in range(4)))
    constants = np.stack([geometry.norm(a), geometry.norm(b), geometry.dot(a, b)])
    return Term(
        "isometry",
        residual,
        (("flat", cells),),
        weights=mean_weights(len(cells)),
        constants=constants,
    )


def examples(mesh: Mesh) -> list[Term]:
    """Terms for the conformance tests."""
    return [] if mesh.is_triangles else [build(mesh)]

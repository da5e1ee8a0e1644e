"""Isometry of cells by lengths: the published flattening residuals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gso import geometry
from gso.mesh import Mesh
from gso.terms.base import Array, Term

#: Turning or moving the flat image changes no length.
INVARIANT = ("translation", "rotation")


def residual(points: Sequence[tuple[Any, ...]], constants: Sequence[Any]) -> tuple[Any, ...]:
    """Differences of the diagonals' lengths and of their dot product (Wang et al. 2024).

    A triangle, which has no diagonals, gives the differences of its sides' lengths.
    Constants: |a|, |b| and a.b of the cell in space, or the three lengths.
    """
    lengths = [geometry.norm(v) for v in _vectors(points)]
    if len(points) == 4:
        a, b = geometry.diagonals(*points)
        lengths.append(geometry.dot(a, b))
    return tuple(x - c for x, c in zip(lengths, constants, strict=True))


def vectors(points: Sequence[tuple[Any, ...]], constants: Sequence[Any]) -> tuple[Any, ...]:
    """The vectors whose lengths the first residuals compare."""
    return tuple(_vectors(points))


def _vectors(points: Sequence[tuple[Any, ...]]) -> list[Any]:
    if len(points) == 4:
        return list(geometry.diagonals(*points))
    return [geometry.sub(points[k - 1], points[k]) for k in range(3)]


def build(mesh: Mesh) -> list[Term]:
    """Isometry defect of every cell of a mesh.

    Weights are one over the number of cells and their mean squared diagonal (twice the
    mean squared side of triangles), so that the energy of a given strain is the same at
    every resolution.
    """
    faces = mesh.faces
    quad = faces[:, 3] >= 0 if faces.shape[1] == 4 else np.zeros(len(faces), bool)
    groups = [f for f in (faces[quad], faces[~quad, :3]) if len(f)]
    constants = [_rest(mesh.vertices[f]) for f in groups]
    square = sum(float((c[:2] ** 2).mean(axis=0).sum()) * _PER[len(c)] for c in constants)
    return [
        Term(
            "isometry",
            residual,
            (("flat", f),),
            weights=np.full(len(f), 1.0 / square),
            constants=c,
            vectors=vectors,
        )
        for f, c in zip(groups, constants, strict=True)
    ]

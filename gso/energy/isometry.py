"""Isometry defect of cells by lengths: the published flattening residuals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso import geometry
from gso.energy.base import Term
from gso.mesh import Mesh, topology
from gso.typing import Array, Ints, S, Vec

#: Rigid motions of the flat image change no length.
INVARIANT = ("translation", "rotation")


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return differences of the diagonals' lengths and of their dot product (Wang et al. 2024).

    For a triangle they are the differences of its sides' lengths. Constants: |a|, |b| and
    a.b of the cell in space, or the three lengths.
    """
    lengths = [geometry.norm(v) for v in vectors(points, constants)]
    if len(points) == 4:
        a, b = geometry.diagonals(*points)
        lengths.append(geometry.dot(a, b))
    return tuple(x - c for x, c in zip(lengths, constants, strict=True))


def vectors(points: Sequence[Vec[S]], constants: Sequence[S]) -> tuple[Vec[S], ...]:
    """Return the vectors whose lengths the first residuals compare."""
    if len(points) == 4:
        return geometry.diagonals(*points)
    return tuple(geometry.sub(points[k - 1], points[k]) for k in range(3))


def typical_length(mesh: Mesh) -> float:
    """Return the root mean square of the compared lengths: diagonals, and sides of triangles."""
    quads, triangles = topology.by_size(mesh.faces)
    ends = [quads[:, c] for c in ((0, 2), (1, 3))]
    ends += [triangles[:, c] for c in ((0, 1), (1, 2), (2, 0))]
    a, b = (mesh.vertices[k] for k in np.concatenate(ends).T)
    return float(np.sqrt(((a - b) ** 2).sum(axis=1).mean()))


def build(mesh: Mesh) -> list[Term]:
    """Build the isometry defect of every cell of a mesh.

    Weights are 1 / (number of cells * :func:`typical_length` squared), so that the energy of a
    given strain is the same at every resolution.
    """
    weight = 1.0 / (len(mesh.faces) * typical_length(mesh) ** 2)
    return [
        Term(
            "isometry",
            residual,
            (("flat", f),),
            weights=np.full(len(f), weight),
            constants=_rest(mesh.vertices, f),
            vectors=vectors,
        )
        for f in topology.by_size(mesh.faces)
        if len(f)
    ]


def _rest(vertices: Array, faces: Ints) -> Array:
    points = [tuple(vertices[faces[:, k]].T) for k in range(faces.shape[1])]
    rows = [geometry.norm(v) for v in vectors(points, ())]
    if len(points) == 4:
        rows.append(geometry.dot(*geometry.diagonals(*points)))
    return np.stack(rows)

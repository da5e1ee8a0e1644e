"""Discrete Gaussian curvature at the interior vertices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gso.geometry import gaussian_curvature
from gso.mesh import Mesh
from gso.terms.base import Array, Ints, Term

#: The residual is 1/length^2 and does not change under rigid motions.
INVARIANT = ("translation", "rotation")


def residual(points: Sequence[tuple[Any, ...]], constants: Sequence[Any]) -> tuple[Any, ...]:
    """Curvature of the first point, the others its ring."""
    return (gaussian_curvature(points[0], points[1:]),)


def build(mesh: Mesh) -> list[Term]:
    """One term per ring length; weights sum to one over all interior vertices.

    Each vertex counts half in either triangulation of the quads around it, as residuals of
    their own: their sum would let them cancel, and one alone is blind to what happens along
    the other diagonals.

    Grid vertices weigh alike, as in the published metric; those of other meshes weigh by
    the area of their star, so that the sum does not depend on how densely a part of the
    surface is meshed.
    """
    terms: dict[int, list[tuple[Ints, Array]]] = {}
    for stars in mesh.splits:
        areas = [_weights(mesh, centre, ring) for centre, ring in stars]
        total = len(mesh.splits) * sum(float(a.sum()) for a in areas)
        for (centre, ring), area in zip(stars, areas, strict=True):
            element = np.concatenate([centre[:, None], ring], axis=1)
            terms.setdefault(ring.shape[1], []).append((element, area / total))
    return [
        Term(
            "curvature",
            residual,
            (("surface", np.concatenate([element for element, _ in some])),),
            weights=np.concatenate([weight for _, weight in some]),
        )
        for _, some in sorted(terms.items())
    ]


def _weights(mesh: Mesh, centre: Ints, ring: Ints) -> Array:
    if mesh.grid_index is not None:
        return np.ones(len(centre))
    return star_areas(mesh.vertices, centre, ring)


def star_areas(vertices: Array, centre: Ints, ring: Ints) -> Array:
    """Areas (n,) of vertex stars."""
    from gso.geometry import star_area

    return star_area(
        tuple(vertices[centre].T), [tuple(vertices[ring[:, k]].T) for k in range(ring.shape[1])]
    )


def examples(mesh: Mesh) -> list[Term]:
    """Terms for the conformance tests."""
    return build(mesh)

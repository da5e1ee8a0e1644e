"""Discrete Gaussian curvature at the interior vertices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.energy.base import Term
from gso.geometry import gaussian_curvature, star_area
from gso.mesh import Mesh
from gso.typing import Array, Ints, S, Vec

#: The residual is 1/length^2 and does not change under rigid motions.
INVARIANT = ("translation", "rotation")


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return the Gaussian curvature at the first point; the others are its ring."""
    return (gaussian_curvature(points[0], points[1:]),)


def build(mesh: Mesh) -> list[Term]:
    """Build one term per ring length; weights sum to one over all interior vertices.

    On meshes with quads each vertex has a residual in each of the two triangulations, with half
    of its weight. In the sum of the two they could cancel; one alone does not see curvature
    along the other diagonals.

    Grid vertices have equal weights, as in the published metric. Vertices of other meshes are
    weighted by the area of their star, so that the energy does not depend on the local mesh
    density.
    """
    terms: dict[int, list[tuple[Ints, Array]]] = {}
    for stars in mesh.stars_by_triangulation:
        areas = [_weights(mesh, centre, ring) for centre, ring in stars]
        total = len(mesh.stars_by_triangulation) * sum(float(a.sum()) for a in areas)
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
    """Return the areas (n,) of vertex stars."""
    return star_area(
        tuple(vertices[centre].T), [tuple(vertices[ring[:, k]].T) for k in range(ring.shape[1])]
    )

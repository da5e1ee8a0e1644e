"""Discrete Gaussian curvature at the interior vertices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gso.geometry import gaussian_curvature
from gso.mesh import Mesh
from gso.terms.base import Array, Term

#: The residual is 1/length^2 and does not change under rigid motions.
INVARIANT = ("translation", "rotation")


def residual(points: Sequence[tuple[Any, ...]], constants: Sequence[Any]) -> tuple[Any, ...]:
    """Curvature of the first point, the others its ring."""
    return (gaussian_curvature(points[0], points[1:]),)


def build(mesh: Mesh) -> list[Term]:
    """One term per ring length; weights sum to one over all interior vertices.

    Grid vertices weigh alike, as in the published metric; those of other meshes weigh by
    the area of their star, so that the sum does not depend on how densely a part of the
    surface is meshed.
    """
    groups = mesh.stars
    if mesh.grid_index is not None:
        area = [np.ones(len(centre)) for centre, _ in groups]
    else:
        area = [star_areas(mesh.vertices, centre, ring) for centre, ring in groups]
    total = sum(float(a.sum()) for a in area)
    return [
        Term(
            "curvature",
            residual,
            (("surface", np.concatenate([centre[:, None], ring], axis=1)),),
            weights=a / total,
        )
        for (centre, ring), a in zip(groups, area, strict=True)
    ]


def star_areas(vertices: Array, centre: Any, ring: Any) -> Array:
    """Areas (n,) of vertex stars."""
    from gso.geometry import star_area

    return star_area(
        tuple(vertices[centre].T), [tuple(vertices[ring[:, k]].T) for k in range(ring.shape[1])]
    )


def examples(mesh: Mesh) -> list[Term]:
    """Terms for the conformance tests."""
    return build(mesh)

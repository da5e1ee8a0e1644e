"""Resistance of the flat image's corner triangles to being squeezed to nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gso import geometry
from gso.geometry import ops
from gso.mesh import Mesh
from gso.terms.base import Array, Ints, Term
from gso.terms.stretch import corners_of, per_corner

#: Turning or moving the flat image changes no area.
INVARIANT = ("translation", "rotation")

#: The residual has no bound: a step limit keeps the areas positive.
UNBOUNDED = True

#: Share of its area in space below which a triangle resists.
SQUEEZED = 0.2


def residual(points: Sequence[tuple[Any, ...]], constants: Sequence[Any]) -> tuple[Any, ...]:
    """``max(0, a / A - 1)`` of each corner triangle with doubled area A.

    Unbounded where the area goes to zero, nothing where it is larger than `a`: with a bound
    on the step that keeps A positive, an energy that would gain from folding does not come
    to a halt at the first triangle that collapses. Constants: a of each corner triangle.
    """
    areas = [
        geometry.corner_area2(*(points[k] for k in corner)) for corner in corners_of(len(points))
    ]
    return tuple(
        -ops.minimum(1.0 - a / area, 0.0) for a, area in zip(constants, areas, strict=True)
    )


def build(mesh: Mesh) -> list[Term]:
    """Resistance of all corner triangles; weights average over triangles."""
    return per_corner(mesh, "collapse", residual, _squeezed_areas)


def _squeezed_areas(vertices: Array, faces: Ints) -> Array:
    """Doubled areas below which the corner triangles of faces resist (4 or 1, e)."""
    out = []
    for corner in corners_of(faces.shape[1]):
        p, q, r = (tuple(vertices[faces[:, k]].T) for k in corner)
        out.append(geometry.norm(geometry.cross(geometry.sub(q, p), geometry.sub(r, p))))
    return SQUEEZED * np.stack(out)


def examples(mesh: Mesh) -> list[Term]:
    """Terms for the conformance tests."""
    return build(mesh)

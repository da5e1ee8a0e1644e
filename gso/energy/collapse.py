"""Barrier against the collapse of the flat image's corner triangles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso import geometry
from gso.energy.base import Term
from gso.energy.stretch import corners_of, per_corner
from gso.geometry import ops
from gso.mesh import Mesh
from gso.typing import Array, Ints, S, Vec

#: Rigid motions of the flat image change no area.
INVARIANT = ("translation", "rotation")

#: The residual is unbounded; a step limit keeps the areas positive.
UNBOUNDED = True

#: Ratio of the flat area to the area in space below which the barrier of a triangle is active.
SQUEEZED = 0.2


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return ``max(0, a / A - 1)`` of each corner triangle with doubled area A.

    The residual is zero where A is larger than `a`, and unbounded as A goes to zero. A step
    limit alone keeps A positive, but then an energy that decreases by folding stalls at the
    first triangle that collapses; the barrier prevents this. Constants: a of each corner
    triangle.
    """
    areas = [
        geometry.corner_area2(*(points[k] for k in corner)) for corner in corners_of(len(points))
    ]
    return tuple(
        -ops.minimum(1.0 - a / area, 0.0) for a, area in zip(constants, areas, strict=True)
    )


def build(mesh: Mesh) -> list[Term]:
    """Build the barrier of all corner triangles; weights average over triangles."""
    return per_corner(mesh, "collapse", residual, _squeezed_areas)


def _squeezed_areas(vertices: Array, faces: Ints) -> Array:
    """Return the doubled areas (4 or 1, e) below which corner barriers are active."""
    out = []
    for corner in corners_of(faces.shape[1]):
        p, q, r = (tuple(vertices[faces[:, k]].T) for k in corner)
        out.append(geometry.norm(geometry.cross(geometry.sub(q, p), geometry.sub(r, p))))
    return SQUEEZED * np.stack(out)

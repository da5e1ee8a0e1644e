"""Membrane strain of the flat image: the part that scales, and the part that shears."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gso import geometry, topology
from gso.mesh import Mesh
from gso.terms.base import Array, Ints, Term

#: Turning or moving the flat image changes no strain.
INVARIANT = ("translation", "rotation")

_CORNERS = ((0, 1, 3), (1, 2, 0), (2, 3, 1), (3, 0, 2))


def _stretches(points: Sequence[tuple[Any, ...]], constants: Sequence[Any]) -> list[Any]:
    corners = _CORNERS if len(points) == 4 else ((0, 1, 2),)
    return [
        geometry.stretch(*(points[k] for k in corner), tuple(constants[3 * c : 3 * c + 3]))
        for c, corner in enumerate(corners)
    ]


def residual(points: Sequence[tuple[Any, ...]], constants: Sequence[Any]) -> tuple[Any, ...]:
    """``sqrt(2) (Q - 1)`` of each corner triangle of a face.

    Constants: the three numbers of :func:`gso.geometry.rest_frame` per corner triangle.
    """
    return tuple(2.0**0.5 * s[0] for s in _stretches(points, constants))


def shear(points: Sequence[tuple[Any, ...]], constants: Sequence[Any]) -> tuple[Any, ...]:
    """``sqrt(2) (c, d)`` of each corner triangle: linear in the unknowns."""
    return tuple(2.0**0.5 * x for s in _stretches(points, constants) for x in s[1:])


def face_groups(mesh: Mesh) -> list[Ints]:
    """The quads and the triangles of a mesh, whichever there are."""
    faces = mesh.faces
    if faces.shape[1] == 3:
        return [faces]
    quad = faces[:, 3] >= 0
    return [f for f in (faces[quad], faces[~quad, :3]) if len(f)]


def rest_constants(vertices: Array, faces: Ints) -> Array:
    """Rest frames of the corner triangles of faces, (12 or 3, e).

    A corner without area (three corners of a quad in a line) gets zeros: it exerts no
    force.
    """
    corners = _CORNERS if faces.shape[1] == 4 else ((0, 1, 2),)
    rows = []
    for corner in corners:
        p, q, r = (tuple(vertices[faces[:, k]].T) for k in corner)
        area = geometry.norm(geometry.cross(geometry.sub(q, p), geometry.sub(r, p)))
        edge = geometry.norm2(geometry.sub(q, p)) + geometry.norm2(geometry.sub(r, p))
        keep = area > 1e-6 * edge
        rows += [np.where(keep, x, 0.0) for x in geometry.rest_frame(p, q, r)]
    return np.stack(rows)


def build(mesh: Mesh) -> list[Term]:
    """Scaling and shearing strain of all corner triangles; weights average over triangles.

    Together half the weighted sum of squares is the mean of
    ``((s1 - 1)^2 + (s2 - 1)^2) / 2``, the as-rigid-as-possible energy of Liu et al. 2008
    with equal weights.
    """
    groups = face_groups(mesh)
    count = sum(len(f) * (4 if f.shape[1] == 4 else 1) for f in groups)
    terms = []
    for faces in groups:
        common = {
            "stencil": (("flat", faces),),
            "weights": np.full(len(faces), 1.0 / count),
            "constants": rest_constants(mesh.vertices, faces),
        }
        terms.append(Term("stretch", residual, **common))
        terms.append(Term("shear", shear, **common, linear=True))
    return terms


def examples(mesh: Mesh) -> list[Term]:
    """Terms for the conformance tests."""
    return build(mesh)

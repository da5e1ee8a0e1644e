"""Folds of a pattern: the edges between its faces."""

from __future__ import annotations

import numpy as np

from gso.exact.sliced_pattern import SlicedPattern
from gso.geometry import area_vectors
from gso.geometry.vectors import fold_angles, unit
from gso.pattern import Folded
from gso.recognition import Recognised
from gso.typing import Array, Flags, Ints
from gso.unfolding.dual_edges import dual_edges

#: Angles in radians from which on an edge between two faces is a fold: one that is drawn, any at
#: all, and one where a face is a round surface, which meets its neighbour in the tessellation's
#: accuracy.
FOLD, _LEVEL, _TANGENT = np.radians(0.05), 1e-10, np.radians(1.0)


def fold_edges(sliced: SlicedPattern, shape: Recognised) -> Folded:
    """Return the edges between two faces that are folded, with their angles and radii of 0."""
    edges = dual_edges(sliced.faces, np.pad(sliced.flat, ((0, 0), (0, 1))))
    one, other = (sliced.label[edges.triangles[:, side]] for side in (0, 1))
    border = one != other
    ends, pair = edges.ends[border], edges.triangles[border]
    middle = sliced.points[sliced.vertex[ends]].mean(axis=1)
    (first, round_one), (second, round_two) = (
        _normals(sliced, shape, pair[:, side], sliced.vertex[ends], middle) for side in (0, 1)
    )
    way = sliced.points[sliced.vertex[ends[:, 1]]] - sliced.points[sliced.vertex[ends[:, 0]]]
    angle = fold_angles(first, second, way)
    folded = np.abs(angle) > np.where(round_one | round_two, _TANGENT, _LEVEL)
    count = int(folded.sum())
    return Folded(ends[folded], angle[folded], np.zeros(count), np.full(count, -1))


def _normals(
    sliced: SlicedPattern, shape: Recognised, triangles: Ints, ends: Ints, points: Array
) -> tuple[Array, Flags]:
    """Return normals of triangles at edges, those of their surface where its equation is known.

    Edges have the vertices `ends` (k, 2) and the middles `points`.
    """
    normal = unit(area_vectors(sliced.points, sliced.vertex[sliced.faces[triangles]]))
    number, is_round = sliced.label[triangles], np.zeros(len(triangles), bool)
    for k in np.unique(number).tolist():
        face, which = shape.faces[k], np.flatnonzero(number == k)
        if face.surface is not None:
            exact = face.surface.normals(points[which])
        elif face.normals is not None:
            first, second = face.normals_at(ends[which]).transpose(1, 0, 2)
            exact = np.where(np.isnan(first), second, first)
            known = ~np.isnan(exact[:, 0])
            which, exact = which[known], exact[known]
        else:
            continue
        side = np.sign(np.einsum("kd,kd->k", exact, normal[which]))
        normal[which] = side[:, None] * exact
        is_round[which] = True
    return normal, is_round

"""Folds of a pattern: the edges between its faces."""

from __future__ import annotations

import numpy as np

from gso.exact.sliced_pattern import SlicedPattern
from gso.geometry import area_vectors
from gso.geometry.vectors import fold_angles, unit
from gso.mesh.topology import edge_keys, pair_keys
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
    ends = edges.ends[border]
    angle = _angles(sliced, shape, edges.triangles[border], sliced.vertex[ends])
    folded = np.abs(angle) > _LEVEL
    count = int(folded.sum())
    return Folded(ends[folded], angle[folded], np.zeros(count), np.full(count, -1))


def seam_angles(sliced: SlicedPattern, shape: Recognised) -> Array:
    """Return the angle (s,) between the faces at each seam edge, as those of folds; 0 if smooth."""
    n, sides = len(sliced.flat), sliced.seams
    origin, dest = sliced.faces.ravel(), np.roll(sliced.faces, -1, axis=1).ravel()
    keys = edge_keys(origin, dest, n)
    order = np.argsort(keys)
    half = order[np.searchsorted(keys[order], pair_keys(sides.reshape(-1, 2), n))].reshape(-1, 2)
    ends = sliced.vertex[np.stack([origin[half[:, 0]], dest[half[:, 0]]], axis=1)]
    return _angles(sliced, shape, half // 3, ends)


def _angles(sliced: SlicedPattern, shape: Recognised, pair: Ints, ends: Ints) -> Array:
    """Return the angles between pairs of triangles (k, 2) at edges between vertices `ends` (k, 2).

    They are 0 where a round surface meets its neighbour in a tangent plane.
    """
    a, b = sliced.points[ends].transpose(1, 0, 2)
    (first, round_one), (second, round_two) = (
        _normals(sliced, shape, pair[:, side], ends, 0.5 * (a + b)) for side in (0, 1)
    )
    angle = fold_angles(first, second, b - a)
    level = np.where(round_one | round_two, _TANGENT, 0.0)
    return np.where(np.abs(angle) > level, angle, 0.0)


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

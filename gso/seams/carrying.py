"""From the coarse copy of a design back to the design: regions and shapes."""

from __future__ import annotations

import numpy as np
from scipy.sparse import diags
from scipy.spatial import cKDTree

from gso.cut_pieces import Pieces
from gso.linalg import spd
from gso.mesh.normals import vertex_normals
from gso.seams.coarse_copy import CoarseCopy
from gso.seams.potential import Potential
from gso.seams.regions import Regions
from gso.seams.trial import Trial
from gso.typing import Array, Ints

#: Weights of the squared Laplacian of a displacement, and of the displacement itself, relative to
#: that of its known values.
_BENT, _NONE = 0.2, 1e-3


def base_fields(
    base: Regions, coarse: Regions, copy: CoarseCopy, label: Ints, width: float
) -> Array:
    """Diffuse regions of the copy, labels of its faces (m,), on the opened base: fields (p, k)."""
    at = _copies(base, coarse, copy)
    masses = np.zeros((len(base.opened.vertex), int(label.max()) + 1))
    np.add.at(masses, at, coarse.masses(label))
    # Obtuse triangles may make values far from all masses slightly negative.
    _, near = cKDTree(coarse.opened.mesh.vertices).query(base.opened.mesh.vertices)
    fields = np.maximum(base.diffused(masses, coarse.widths(label, width)[near]), 0.0)
    return np.asarray(fields / np.maximum(fields.sum(axis=1, keepdims=True), 1e-300))


def _copies(base: Regions, coarse: Regions, copy: CoarseCopy) -> Ints:
    """Return the vertex of the opened base for each of the opened copy.

    At creases it is the one with the nearest normal.
    """
    count = len(coarse.opened.vertex)
    vertex: Ints = copy.ids[coarse.opened.vertex]
    if not len(copy.creases):
        return vertex
    order = np.argsort(base.opened.vertex, kind="stable")
    first = np.asarray(np.searchsorted(base.opened.vertex[order], np.r_[vertex, vertex + 1]))
    number = first[count:] - first[:count]
    which = np.repeat(np.arange(count), number)
    place = np.arange(len(which)) - np.repeat(np.cumsum(number) - number, number)
    candidate = order[first[:count][which] + place]
    own = vertex_normals(coarse.opened.mesh)
    others = vertex_normals(base.opened.mesh)
    alike = np.einsum("kd,kd->k", own[which], others[candidate])
    rank = np.lexsort([alike, which])
    last = rank[np.r_[which[rank][1:] != which[rank][:-1], True]]
    return np.asarray(candidate[last])


def base_start(copy: CoarseCopy, trial: Trial, pieces: Pieces) -> Array:
    """Return the points of a design in pieces (n, 3) that follow the solved pieces of the copy.

    The displacement of the copy's vertices inside pieces is interpolated smoothly on each piece.
    """
    coarse, opened = trial.pieces.opened, pieces.opened
    solved = trial.shape.opened.mesh.vertices
    count = len(copy.ids)
    own = np.bincount(coarse.vertex, minlength=len(trial.pieces.design.vertices))
    single = np.bincount(opened.vertex, minlength=len(pieces.design.vertices)) == 1
    where = np.zeros(len(single), np.int64)
    where[opened.vertex] = np.arange(len(opened.vertex))
    k = np.flatnonzero((coarse.vertex < count) & (own[coarse.vertex] == 1))
    k = k[single[copy.ids[coarse.vertex[k]]]]
    target = where[copy.ids[coarse.vertex[k]]]
    return spread(pieces, target, solved[k] - copy.mesh.vertices[coarse.vertex[k]])


def spread(pieces: Pieces, known: Ints, moved: Array, bent: float = _BENT) -> Array:
    """Return the points of a design in pieces (n, 3), from the displacement of some vertices.

    It is interpolated smoothly on each piece; points on seams are the means of their copies.

    Parameters
    ----------
    pieces : Pieces
    known : ndarray of int, (k,)
        Vertices of the mesh that is cut open.
    moved : ndarray, (k, 3)
        Their displacements.
    bent : float
        Weight of the squared Laplacian of the displacement, relative to that of the known values.
    """
    opened = pieces.opened
    field = Potential(opened.mesh)
    area = np.maximum(field.area, 1e-6 * float(field.area.mean()))
    size = float(area.sum()) / max(len(known), 1)
    own = np.zeros(len(area))
    own[known] = size
    bending = field.stiffness @ diags(bent * size**2 / area) @ field.stiffness
    solve = spd(bending + diags(own + _NONE * area))
    right = np.zeros((len(area), 3))
    right[known] = size * moved
    away = np.stack([solve(column) for column in right.T], axis=1)
    base = pieces.design.vertices
    points = base[opened.vertex] + away
    number = np.bincount(opened.vertex, minlength=len(base))
    sums = [np.bincount(opened.vertex, column, len(base)) for column in points.T]
    return np.asarray(np.stack(sums, axis=1) / np.maximum(number, 1)[:, None])

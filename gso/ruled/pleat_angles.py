"""Pleats, and other bends of strips where the design does not bend as much."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.geometry.vectors import cross, fold_angles, lengths, unit
from gso.mesh import Mesh, Nearest
from gso.mesh.topology import four_corners, label_components, pair_keys
from gso.ruled.fold_lines import Folds
from gso.typing import Array, Ints

#: Angle of a bend in radians below which the faces on both of its sides count as one.
_SMALL = float(np.radians(2.0))


def pleats(mesh: Mesh, strip: Ints, rulings: Folds, creases: Folds, design: Mesh) -> Array:
    """Measure the pleats of strips.

    A pleat is a face between two bends in opposite directions. Its size is the smaller of both
    angles, each of them less the angle by which the design turns there: a design that is pleated
    itself, or has the bends in its own places, is followed. The design's angle is that between
    its faces at the nearest points to the middles of the faces beside the bend, seen along it.
    Faces count as one where they meet at less than two degrees.

    Parameters
    ----------
    mesh : Mesh
        The strips, of planar faces.
    strip : ndarray of int, (m,)
        Strip that each face belongs to.
    rulings, creases : Folds
        The bends of the strips, and the edges between them.
    design : Mesh
        What they are near, in the same frame.

    Returns
    -------
    ndarray, (s,)
        The largest pleat of each strip, in radians; zero where there is none.
    """
    out = np.zeros(int(strip.max()) + 1)
    if len(rulings.edges) < 2:
        return out
    bends = _Bends.of(mesh, strip, rulings, creases, design)
    # Faces that meet at a small angle are one.
    small = np.abs(bends.angle) < _SMALL
    face = label_components(int(bends.planar.max()) + 1, bends.left[small], bends.right[small])
    up, down = np.zeros((2, int(face.max()) + 1))
    for side in (bends.left, bends.right):
        np.maximum.at(up, face[side], np.where(bends.angle > 0.0, bends.excess, 0.0))
        np.maximum.at(down, face[side], np.where(bends.angle < 0.0, bends.excess, 0.0))
    np.maximum.at(out, strip, np.minimum(up, down)[face[bends.planar]])
    return out


def sharpest_fold(mesh: Mesh, strip: Ints, rulings: Folds, creases: Folds, design: Mesh) -> float:
    """Measure the largest angle by which a bend of strips turns more than the design there.

    The parameters, and the angle of the design, are those of :func:`pleats`.

    Returns
    -------
    float
        In radians; zero where there are no bends.
    """
    if not len(rulings.edges):
        return 0.0
    return float(_Bends.of(mesh, strip, rulings, creases, design).excess.max(initial=0.0))


@dataclass(frozen=True)
class _Bends:
    """The bends of strips, and how much more than the design they turn.

    Attributes
    ----------
    planar : ndarray of int, (m,)
        Group of coplanar faces that each face belongs to.
    left, right : ndarray of int, (b,)
        The groups on both sides of each bend.
    angle, excess : ndarray, (b,)
        Its angle, and the size of what the design does not turn there, in radians.
    """

    planar: Ints
    left: Ints
    right: Ints
    angle: Array
    excess: Array

    @classmethod
    def of(cls, mesh: Mesh, strip: Ints, rulings: Folds, creases: Folds, design: Mesh) -> _Bends:
        """Find the bends of strips and compare them with a design."""
        he, count = mesh.half_edges, len(mesh.vertices)
        k = np.flatnonzero(he.origin < he.dest)
        k = k[he.twin[k] >= 0]
        ends = np.stack([he.origin[k], he.dest[k]], axis=1)
        one, two = he.face[k], he.face[he.twin[k]]
        keys, bends = pair_keys(ends, count), pair_keys(rulings.edges, count)
        bent = np.isin(keys, bends)
        level = ~(bent | np.isin(keys, pair_keys(creases.edges, count)))
        level &= strip[one] == strip[two]
        order = np.argsort(bends)
        angle = rulings.angles[order[np.searchsorted(bends[order], keys[bent])]]
        planar = label_components(len(mesh.faces), one[level], two[level])
        normal, middle = _planes(mesh, planar)
        triangle, _ = Nearest(design).nearest(middle)
        a, b, c = design.vertices[design.triangles[triangle]].transpose(1, 0, 2)
        own = unit(cross(b - a, c - a))
        p, q = planar[one[bent]], planar[two[bent]]
        way = unit(mesh.vertices[ends[bent, 1]] - mesh.vertices[ends[bent, 0]])
        turn = fold_angles(normal[p], normal[q], way)
        excess = turn - fold_angles(_across(own[p], way), _across(own[q], way), way)
        size = np.where(turn * excess > 0.0, np.minimum(np.abs(turn), np.abs(excess)), 0.0)
        return cls(planar, p, q, angle, size)


def _planes(mesh: Mesh, planar: Ints) -> tuple[Array, Array]:
    """Return the unit normals of groups (m,) of coplanar faces, and points in their middles."""
    a, b, c, d = mesh.vertices[four_corners(mesh.faces)].transpose(1, 0, 2)
    double = cross(c - a, d - b)
    area = lengths(double)
    total = np.maximum(np.bincount(planar, area), np.finfo(float).tiny)
    centre = 0.25 * area[:, None] * (a + b + c + d)
    normal: Array = np.stack([np.bincount(planar, x) for x in double.T], axis=1)
    middle: Array = np.stack([np.bincount(planar, x) for x in centre.T], axis=1)
    return unit(normal), middle / total[:, None]


def _across(vectors: Array, way: Array) -> Array:
    """Return vectors (k, 3) without their part along unit vectors."""
    return np.asarray(vectors - np.einsum("kd,kd->k", vectors, way)[:, None] * way)

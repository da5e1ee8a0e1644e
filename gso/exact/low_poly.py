"""Designs that are meant as polyhedra: few triangles, and sharp edges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso.exact.fold_edges import FOLD
from gso.recognition import Recognised, ShapeFace
from gso.unfolding.dual_edges import dual_edges

#: Number of triangles up to which a design may be a polyhedron. The angle, in radians, from which
#: on an edge is sharp, and the share of the folds' length that is, where it is not developable.
_FEW, _SHARP, _SHARE = 1_000, np.radians(20.0), 0.25
#: Number of folds in a torsal face up to which they are folds.
_COARSE = 6


def is_low_poly(shape: Recognised) -> bool:
    """Tell whether a design is meant as a polyhedron: few triangles, and many sharp edges.

    Edges of developable faces do not count: a box may have a bulged side.
    """
    if len(shape.triangles) > _FEW:
        return False
    edges = dual_edges(shape.triangles, shape.vertices)
    a, b = shape.vertices[edges.ends].transpose(1, 0, 2)
    angle, length = np.abs(edges.angles), np.linalg.norm(b - a, axis=1)
    folded = (angle > FOLD) & ~shape.developable[edges.triangles].any(axis=1)
    return bool(length[folded & (angle > _SHARP)].sum() >= _SHARE * length[folded].sum() > 0)


def facets(shape: Recognised) -> Recognised:
    """Return the design with each triangle as a face of its own."""
    return replace(shape, faces=tuple(_planes(shape)))


def without_coarse_zones(shape: Recognised) -> Recognised:
    """Return the design with the triangles of coarse torsal faces as faces of their own.

    A few folds in a row are meant as folds: nobody rolls a sheet over them. Cylinders and cones
    stay, whose equations say how they are rolled.
    """
    torsal = np.array([face.kind == "torsal" for face in shape.faces])
    if not torsal.any():
        return shape
    edges = dual_edges(shape.triangles, shape.vertices)
    a, b = shape.face[edges.triangles].T
    inside = (a == b) & (np.abs(edges.angles) > FOLD)
    coarse = torsal & (np.bincount(a[inside], minlength=len(torsal)) <= _COARSE)
    if not coarse.any():
        return shape
    planes, faces = _planes(shape), []
    for face, divided in zip(shape.faces, coarse.tolist(), strict=True):
        faces += [planes[k] for k in face.triangles.tolist()] if divided else [face]
    return replace(shape, faces=tuple(faces))


def _planes(shape: Recognised) -> list[ShapeFace]:
    """Return each triangle as a face."""
    flat = replace(shape, faces=(ShapeFace("free", np.arange(len(shape.triangles))),)).flat()
    return [ShapeFace("plane", np.array([k]), flat[k, None]) for k in range(len(flat))]

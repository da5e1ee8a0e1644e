"""Isometry of faces by squared lengths: the residuals of Jiang et al. 2020."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso import geometry
from gso.energy.base import Term, mean_weights
from gso.energy.isometry import typical_length
from gso.mesh import Mesh, topology
from gso.typing import Array, Ints, S, Vec

#: Rigid motions change no length.
INVARIANT = ("translation", "rotation")


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return differences of |a|^2, |b|^2 and a.b of a face and its counterpart, times a constant.

    For quads a and b are the diagonals: all zero when the parallelograms of the edge
    midpoints are congruent (Jiang et al. 2020, Eq. 1 and 2). For triangles they are the
    squared lengths of the three sides.

    Points: the corners; then the corners of the counterpart, unless it is constant; then, for
    conformal maps, the factor on the counterpart's squares as a point of one component.
    Constants: one over the typical squared length; then the counterpart's three numbers, if
    it is constant.
    """
    points = list(points)
    scale = points.pop()[0] if len(points[-1]) == 1 else 1.0
    count = len(points) if len(constants) == 4 else len(points) // 2
    here = geometry.face_products(*points[:count])
    there = constants[1:] if len(constants) == 4 else geometry.face_products(*points[count:])
    return tuple((p - scale * q) * constants[0] for p, q in zip(here, there, strict=True))


def build(
    mesh: Mesh, block: str, *, counterpart: str | None = None, scale: str | None = None
) -> list[Term]:
    """Build the isometry defect of the faces of a block.

    Parameters
    ----------
    mesh : Mesh
        Faces; its vertices are the counterpart when no block is named.
    block : str
        Block of the faces.
    counterpart : str, optional
        Block of the faces to compare with.
    scale : str, optional
        Block with one number per face, in the order of ``mesh.faces``: the squared lengths
        of the counterpart are multiplied by it.

    Residuals are relative to the mean squared length compared, and weights sum to one, so
    that twice the energy is the mean over the faces of Jiang's E_iso.
    """
    size = typical_length(mesh) ** -2
    terms = []
    quad = topology.are_quads(mesh.faces)
    for which, faces in zip((quad, ~quad), topology.by_size(mesh.faces), strict=True):
        if not len(faces):
            continue
        stencil: list[tuple[str, Ints]] = [(block, faces)]
        constants = [np.full((1, len(faces)), size)]
        if counterpart is not None:
            stencil.append((counterpart, faces))
        else:
            constants.append(_products(mesh.vertices, faces))
        if scale is not None:
            stencil.append((scale, np.flatnonzero(which)[:, None]))
        terms.append(
            Term(
                "isometry",
                residual,
                tuple(stencil),
                weights=np.full(len(faces), 1.0 / len(mesh.faces)),
                constants=np.concatenate(constants),
            )
        )
    return terms


def edge_residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return the difference of an edge's squared length and its target, times a constant.

    Constants: one over the mean squared length of the edges; the target squared length.
    """
    a, b = points
    return ((geometry.norm2(geometry.sub(b, a)) - constants[1]) * constants[0],)


def edges(mesh: Mesh, block: str) -> Term:
    """Build the change of the edges' squared lengths, averaged over the edges of the faces.

    On quads it removes a null space of the diagonals: the two checkerboard sub-lattices can
    shift against each other without a change of any diagonal.
    """
    a, b = mesh.vertices[mesh.edges.T]
    squared = ((b - a) ** 2).sum(axis=1)
    constants = np.stack([np.full(len(squared), 1.0 / squared.mean()), squared])
    weights = mean_weights(len(squared))
    return Term("edges", edge_residual, ((block, mesh.edges),), weights, constants)


def _products(vertices: Array, faces: Ints) -> Array:
    corners = [tuple(vertices[faces[:, k]].T) for k in range(faces.shape[1])]
    return np.stack(geometry.face_products(*corners))

"""Constraints on shape: planar faces and fixed edge lengths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.constraints.base import Constraint, Subject, numbers
from gso.constraints.equations import Lengths, Part, Planar
from gso.short_repr import short_repr


@dataclass(frozen=True, eq=False)
class PlanarFaces(Constraint):
    """Faces that are planar, each in a plane of its own; not for flat images.

    A quad is planar when its diagonals meet. Triangles are always planar.

    Parameters
    ----------
    faces : array_like of int, optional
        Face indices, or a mask over all faces; all faces when not given.
    weight : float, optional
        Weight of a soft constraint, of the order of 1; the constraint is hard when not given.
    """

    faces: ArrayLike | None = None
    weight: float | None = None

    __repr__ = short_repr

    def parts(self, subject: Subject) -> list[Part]:
        if subject.flat:
            raise subject.refuse("means nothing for a flat image, whose faces all are; remove it")
        faces = subject.mesh.faces
        chosen = faces if self.faces is None else faces[subject.faces(self.faces)]
        if chosen.shape[1] == 3:
            return []
        quads = chosen[chosen[:, 3] >= 0]
        return [Planar(subject.number, quads, subject.weight(self.weight))]


@dataclass(frozen=True, eq=False)
class FixedLengths(Constraint):
    """Edges that keep their lengths in the design, or have given ones.

    Parameters
    ----------
    edges : array_like of int, (k, 2), optional
        Pairs of vertices; they need not share a face. All edges of the mesh when not given.
    lengths : array_like, (k,), optional
        Lengths in the unit of the mesh; those of the design when not given, for a flat image
        as well.
    weight : float, optional
        Weight of a soft constraint, of the order of 1; the constraint is hard when not given.
    """

    edges: ArrayLike | None = None
    lengths: ArrayLike | None = None
    weight: float | None = None

    __repr__ = short_repr

    def parts(self, subject: Subject) -> list[Part]:
        mesh = subject.mesh
        pairs = mesh.edges if self.edges is None else subject.pairs(self.edges, "edges")
        if self.lengths is None:
            ends = mesh.vertices[pairs]
            lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        else:
            lengths = np.atleast_1d(numbers(self.lengths))
            if lengths.shape != (len(pairs),) or not np.isfinite(lengths).all():
                raise subject.refuse(
                    f"needs a finite length for each of {len(pairs)} edges, got {np.shape(lengths)}"
                )
        short = np.flatnonzero((lengths <= 1e-9 * mesh.diagonal) | (pairs[:, 0] == pairs[:, 1]))
        if short.size:
            a, b = pairs[short[0]]
            raise subject.refuse(
                f"gives edge ({a}, {b}) the length {lengths[short[0]]:.3g}; it must be positive "
                "(Glue brings vertices together)"
            )
        return [Lengths(subject.number, pairs, lengths, subject.weight(self.weight))]

"""Vertices that coincide."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.constraints.base import Constraint, Subject
from gso.constraints.equations import Part, Relations
from gso.mesh.topology import label_components
from gso.short_repr import short_repr
from gso.typing import Ints


@dataclass(frozen=True, eq=False)
class Glue(Constraint):
    """Pairs of vertices that coincide exactly: ``v_i = v_j``.

    Both vertices may move. Chains of pairs glue several vertices together. Two corners of a
    face cannot be glued, because the face would lose its area.

    Parameters
    ----------
    pairs : array_like of int, (k, 2)
        Vertex indices.

    References
    ----------
    Jiang et al. 2020, Quad-mesh based isometric mappings and developable surfaces (gluing).
    """

    pairs: ArrayLike

    __repr__ = short_repr

    def parts(self, subject: Subject) -> list[Part]:
        pairs = subject.pairs(self.pairs, "what to glue")
        own = pairs[pairs[:, 0] == pairs[:, 1]]
        if len(own):
            raise subject.refuse(f"glues vertex {own[0, 0]} to itself")
        _check_faces(subject, pairs)
        dim = subject.dim
        return [
            Relations(subject.number, pairs[:, 0], pairs[:, 1], np.eye(dim), np.zeros(dim)),
        ]


def _check_faces(subject: Subject, pairs: Ints) -> None:
    """Refuse glue that joins two corners of a face, directly or through other vertices."""
    n, faces = subject.count, subject.mesh.faces
    label = label_components(n, *pairs.T)
    order = np.argsort(label[faces] + n * (faces < 0), axis=1)
    corners = np.take_along_axis(faces, order, axis=1)
    same = (label[corners[:, 1:]] == label[corners[:, :-1]]) & (corners[:, 1:] >= 0)
    if same.any():
        face, k = np.argwhere(same)[0]
        a, b = sorted(corners[face, k : k + 2])
        raise subject.refuse(
            f"brings corners {a} and {b} of face {face} together, which leaves it without area; "
            "merge them in the mesh"
        )

"""Mirror symmetry about a plane, or about a line in the flat image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.constraints.base import Constraint, Subject
from gso.constraints.equations import OnPlane, Part, Relations
from gso.typing import Array, Ints

#: How far a mirrored vertex may be from its partner, relative to the mean edge length.
_TOLERANCE = 0.25


@dataclass(frozen=True, eq=False)
class SymmetryPlane(Constraint):
    """Mirror symmetry of the result about a plane; vertices on the plane stay on it.

    Parameters
    ----------
    point, normal : array_like, (3,)
        A point of the plane, and its normal (of any length). For a flat image, (2,): a
        point of the line of symmetry and its normal.
    pairs : array_like of int, (k, 2), optional
        Which vertices are mirror images of each other; a vertex paired with itself is on
        the plane. Vertices in no pair are free. When not given, every vertex of the design
        is mirrored, and the vertex found there is its partner. A flat image needs pairs.
    tolerance : float, optional
        How far from a mirrored vertex its partner may be, in the unit of the mesh; a quarter
        of the mean edge length when not given.

    Examples
    --------
    >>> import numpy as np, gso
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9), indexing="ij")
    >>> panel = np.stack([u, v, 0.3 * u * u * v], axis=-1)
    >>> mirror = gso.SymmetryPlane(point=[0, 0, 0], normal=[1, 0, 0])
    >>> grid = gso.tno.optimize(panel, constraints=[mirror]).grid
    >>> np.allclose(grid[::-1] * [-1, 1, 1], grid)
    True
    """

    point: ArrayLike
    normal: ArrayLike
    pairs: ArrayLike | None = None
    tolerance: float | None = None

    def parts(self, subject: Subject) -> list[Part]:
        point = subject.vector(self.point, "a point")
        normal = subject.vector(self.normal, "a normal")
        size = np.linalg.norm(normal)
        if not 0 < size < np.inf:
            raise subject.refuse(f"has normal {self.normal!r}; it must not be zero")
        normal = normal / size
        if self.pairs is not None:
            first, second = _checked(subject, self.pairs).T
        elif subject.flat:
            raise subject.refuse(
                "cannot find mirror images in a flat image that is not made yet; give pairs=..."
            )
        else:
            first, second = _found(subject, point, normal, self.tolerance).T
        mirror = np.eye(subject.dim) - 2.0 * np.outer(normal, normal)
        on = first == second
        return [
            OnPlane(subject.number, first[on], normal, point),
            Relations(subject.number, first[~on], second[~on], mirror, point),
        ]


def _checked(subject: Subject, given: ArrayLike) -> Ints:
    """Check the user's pairs: no vertex may be in more than one."""
    pairs = subject.pairs(given, "mirror images")
    on = pairs[:, 0] == pairs[:, 1]
    ids, count = np.unique(np.r_[pairs[on, 0], pairs[~on].ravel()], return_counts=True)
    if (count > 1).any():
        raise subject.refuse(f"has vertex {ids[count > 1][0]} in more than one pair")
    return pairs


def _found(subject: Subject, point: Array, normal: Array, tolerance: float | None) -> Ints:
    """Find pairs by mirroring the design's vertices; vertices without a face are ignored."""
    from scipy.spatial import cKDTree

    mesh = subject.mesh
    ids = np.flatnonzero(mesh.used)
    v = mesh.vertices[ids]
    if tolerance is None:
        tolerance = _TOLERANCE * mesh.edge_lengths.mean()
    else:
        tolerance = subject.positive(tolerance, "tolerance")
    away, partner = cKDTree(v).query(v - 2.0 * np.outer((v - point) @ normal, normal))
    here = np.arange(len(ids))
    alone = np.flatnonzero(away > tolerance)
    if alone.size:
        at = alone[away[alone].argmax()]
        raise subject.refuse(
            f"finds no mirror image of vertex {ids[at]}: the nearest vertex to where it should be "
            f"is {ids[partner[at]]}, {away[at]:.3g} away ({alone.size} such vertices); move the "
            "plane, raise tolerance, or give pairs=..."
        )
    torn = np.flatnonzero(partner[partner] != here)
    if torn.size:
        at = torn[0]
        raise subject.refuse(
            f"finds the same mirror image, vertex {ids[partner[at]]}, for vertices {ids[at]} and "
            f"{ids[partner[partner[at]]]}; give pairs=..."
        )
    once = here <= partner
    return np.stack([ids[once], ids[partner[once]]], axis=1)

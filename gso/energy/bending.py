"""Change of bending: second differences of a surface in a frame that moves with it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso import geometry
from gso.energy import fairness
from gso.energy.base import Term
from gso.mesh import Mesh, topology
from gso.typing import Array, S, Vec

#: Rigid motions leave the residual unchanged, because the frame moves with the surface.
INVARIANT = ("translation", "rotation")

#: Lower bound of the edge lengths that curvatures are divided by, relative to the mean length.
_SHORTEST = 0.2


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return the curvature of a polyline at a vertex, minus its target value.

    Let d be the second difference of the points a, b, c, and e, f the chords along the
    polyline and across it, with unit normal n. The residuals compare d.e and d.f (the
    regulariser of Jiang et al. 2020, which couples the two checkerboard sub-lattices), and d.n.

    Points: a, b, c; the ends of f. Constants: a factor for each product, then the targets.
    """
    a, b, c, p, q = points
    d = geometry.second_difference(a, b, c)
    return _in_frame(d, geometry.sub(c, a), geometry.sub(p, q), constants)


def hinge_residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return the bending across the common edge a b of two triangles a b c and b a d.

    As :func:`residual`, with the linear combination of the four points that vanishes on affine
    functions as the second difference, and the chords b - a and d - c.

    Points: a, b, c, d. Constants: their four coefficients, then those of :func:`residual`.
    """
    a, b, c, d = points
    lack = tuple(
        geometry.dot(tuple(constants[:4]), parts) for parts in zip(a, b, c, d, strict=True)
    )
    return _in_frame(lack, geometry.sub(b, a), geometry.sub(d, c), constants[4:])


def _in_frame(d: Vec[S], e: Vec[S], f: Vec[S], constants: Sequence[S]) -> Vec[S]:
    normal = geometry.cross(e, f)
    along = geometry.dot(d, normal) / geometry.norm(normal)
    parts = (geometry.dot(d, e), geometry.dot(d, f), along)
    return tuple(s * x - t for s, x, t in zip(constants[:3], parts, constants[3:], strict=True))


def build(mesh: Mesh, *, tangential: float = 1.0) -> list[Term]:
    """Build the change of bending of the block "surface", relative to the bending of `mesh`.

    Residuals are differences of curvature, 1/length in the mesh's unit. The energy is half
    their mean square, summed over both directions. On meshes with triangles they belong to
    the interior edges of the triangulation.

    Parameters
    ----------
    mesh : Mesh
        The surface with the target bending.
    tangential : float
        Factor on the residuals within the tangent plane.
    """
    v = mesh.vertices
    if mesh.has_triangles:
        stencil, coefficients = fairness.differences(mesh)
        own, count = hinge_residual, float(len(stencil))
        a, b, c, d = (v[stencil[:, k]] for k in range(4))
        along, across, size = b - a, d - c, np.ones(len(stencil))
    else:
        stencil = topology.polyline_crosses(mesh.half_edges, mesh.faces)
        coefficients, own, count = np.empty((0, len(stencil))), residual, len(stencil) / 2.0
        a, b, c, d, e = (v[stencil[:, k]] for k in range(5))
        along, across, size = c - a, d - e, _lengths(b - a, c - b) ** -2
    constants = np.concatenate(
        [
            coefficients,
            [size * tangential / _lengths(along), size * tangential / _lengths(across), size],
            np.zeros((3, len(stencil))),
        ]
    )
    points = [tuple(v[stencil[:, k]].T) for k in range(stencil.shape[1])]
    constants[-3:] = own(points, list(constants))
    return [
        Term(
            "bending",
            own,
            (("surface", stencil),),
            weights=np.full(len(stencil), 1.0 / max(count, 1.0)),
            constants=constants,
        )
    ]


def _lengths(*vectors: Array) -> Array:
    """Average the lengths of vectors (e, 3) by element, with a lower bound."""
    length: Array = np.mean([np.linalg.norm(x, axis=1) for x in vectors], axis=0)
    return length.clip(_SHORTEST * length.mean() if len(length) else 0.0)

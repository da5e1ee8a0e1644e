"""Holonomy of holes: what loops around inner outlines lack to close in the plane.

The angle defect of an inner outline, 2 pi and its turning angle, is the curvature of a cone whose
tip fills the hole. It counts like the curvature of a vertex, so that a solve does not move
curvature from the surface into its holes. An outline with no defect may still have a gap, where
both ends of the unrolled loop are apart: it is the curvature of two cones of opposite defects.

The defect depends on all vertices of an outline, which as one element would fill a block of the
Hessian. Each vertex of the outline is an element instead, whose target is renewed before every
linearisation: the angle next to its present one with which the loop closes. For a convex loss the
mean over equal shares of a defect is never less than the loss of the whole, and equal, with its
gradient, where the targets were renewed (majorisation and minimisation).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from gso import geometry
from gso.energy.base import Term
from gso.mesh import Mesh, topology
from gso.typing import Array, Ints, S, Vec

#: The residual is 1/length^2 and does not change under rigid motions.
INVARIANT = ("translation", "rotation")
#: Area whose curvature a defect is, as a share of that of all vertex stars. It has the weight of
#: such a star; a small one shrinks the smoothing of the loss.
_SHARE = 0.03


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return by how much the angle at the first point is too small; the others are its fan.

    Constants: the wanted angle in radians, and the factor that makes it the curvature of the hole.
    """
    wanted, factor = constants
    return ((wanted - geometry.fan_angle(points[0], points[1:])) * factor,)


def build(mesh: Mesh, loops: Sequence[Ints]) -> list[Term]:
    """Build the terms of some inner outlines of a mesh, one per number of vertices of the fans.

    Weights are such that with the same weight in the objective a defect costs as much as the same
    defect of an interior vertex in the term of curvature.

    Parameters
    ----------
    mesh : Mesh
    loops : sequence of ndarray of int
        Inner outlines, of ``mesh.boundary_loops``.
    """
    if not loops:
        return []
    fans = topology.boundary_fans(mesh.triangle_edges, loops)
    size = np.array([len(loop) for loop in loops])
    number = np.repeat(np.arange(len(loops)), size)
    # Every triangle is in the stars of three vertices, and has half of its doubled area.
    stars = 1.5 * float(geometry.doubled_areas(mesh.vertices, mesh.triangles).sum())
    factor = (size / (_SHARE * stars))[number]

    def wanted(blocks: Mapping[str, Array]) -> Array:
        centre, *ring = geometry.corners(blocks["surface"], fans)
        turn = np.pi - np.asarray(geometry.fan_angle(centre, ring))
        length = np.asarray(geometry.norm(geometry.sub(ring[0], centre)))
        return np.pi - geometry.closing(turn, length, number).turn

    weights = (_SHARE / size)[number]
    terms = []
    # Shorter fans repeat their last vertex.
    count = 1 + (fans[:, 1:-1] != fans[:, 2:]).sum(axis=1)
    for k in np.unique(count).tolist():
        own = np.flatnonzero(count == k)
        refresh = partial(_constants, wanted, own, factor[own])
        terms.append(
            Term(
                "curvature",
                residual,
                (("surface", fans[own, : k + 1]),),
                weights=weights[own],
                constants=refresh({"surface": mesh.vertices}),
                refresh=refresh,
            )
        )
    return terms


def _constants(
    wanted: Callable[[Mapping[str, Array]], Array],
    own: Ints,
    factor: Array,
    blocks: Mapping[str, Array],
) -> Array:
    """Return the constants of the elements `own` among all vertices of the loops."""
    return np.stack([wanted(blocks)[own], factor])

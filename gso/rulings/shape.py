"""Curvatures and ruling directions of the faces, from the discrete Gauss map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gso import geometry, topology
from gso.io import as_mesh
from gso.mesh import Mesh
from gso.metrics import components
from gso.rulings.normals import gauss_image
from gso.status import OptionError

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Curvature times size below which a face counts as plane.
FLAT = 0.01


@dataclass(frozen=True)
class ShapeOperator:
    """How the faces of a surface are curved; arrays over its m faces.

    Curvatures are positive where the surface bends away from its normal, which points to the
    side from which faces are anticlockwise: a sphere with normals to the outside has
    `H` = 1 / radius. Reversing the faces changes the signs of `H` and `curvatures`.

    Attributes
    ----------
    points : ndarray, (m, 3)
        Midpoints of the faces (means of the corners).
    normals : ndarray, (m, 3)
        Unit normals: of the parallelogram of edge midpoints, or of the triangle.
    areas : ndarray, (m,)
        Areas of the faces, seen along their normals.
    K, H : ndarray, (m,)
        Gaussian and mean curvature, 1 / length^2 and 1 / length.
    curvatures : ndarray, (m, 2)
        Principal curvatures, 1 / length, the one of smaller absolute value first. Their mean is
        `H`; their product is `K` up to the error of discretisation.
    directions : ndarray, (m, 2, 3)
        Principal directions in the face's plane, orthonormal. Their signs mean nothing.
    flat : ndarray of bool, (m,)
        Faces that count as plane: both curvatures are (nearly) zero, `directions` arbitrary.
    """

    points: Array
    normals: Array
    areas: Array
    K: Array
    H: Array
    curvatures: Array
    directions: Array
    flat: NDArray[np.bool_]

    @property
    def rulings(self) -> Array:
        """Direction in which the surface bends least (m, 3), zero where it is flat."""
        return np.where(self.flat[:, None], 0.0, self.directions[:, 0])

    @property
    def gauss_area(self) -> float:
        """Area of the Gauss image, the integral of the absolute Gaussian curvature.

        0 for a developable surface.
        """
        return float((np.abs(self.K) * self.areas).sum())

    @property
    def thickness(self) -> float:
        """How far the Gauss image is from a curve: 0 for a developable surface, 1 for a sphere.

        The integral of the principal curvatures' absolute product over that of the square
        of the larger one: small disks on the surface have ellipses as images, and this is the
        mean ratio of their width to their length. Flat faces do not count.
        """
        low, high = self.curvatures[~self.flat].T
        areas = self.areas[~self.flat]
        width, length = (np.abs(low * high) * areas).sum(), (high**2 * areas).sum()
        return float(width / length) if areas.size else 0.0


def shape_operator(mesh: Any, *, flat: float = FLAT) -> ShapeOperator:
    """Curvatures and principal directions of every face.

    The shape operator of a quad maps its diagonals to those of its image in the discrete
    Gauss map (Jiang et al. 2020); that of a triangle is the derivative of the
    normal interpolated from its corners (the data of Rusinkiewicz 2004). Principal curvatures
    and directions are those of its symmetric part.

    Parameters
    ----------
    mesh : Mesh, or anything that :func:`gso.as_mesh` takes
        Quads, triangles or both.
    flat : float
        A face counts as plane when its curvatures times the surface's size (distance of the
        farthest vertex from the centroid) are below it.

    Returns
    -------
    ShapeOperator
        In the order of ``mesh.faces``.

    Raises
    ------
    MeshError
        The surface cannot be used.
    OptionError
        `flat` is no number above zero.

    Notes
    -----
    `K`, `H` and the directions converge with the second power of the edge length on grids and
    other smooth quad meshes, boundaries included, and with the first on irregular ones, on
    triangles, and next to irregular vertices.

    Examples
    --------
    A cylinder of radius 2 about the y axis:

    >>> y, s = np.mgrid[:9, :17] / 8
    >>> shape = shape_operator(np.stack([2 * np.sin(s / 2), y, 2 * np.cos(s / 2)], axis=-1))
    >>> bool(np.allclose(shape.H, -0.25, atol=2e-3) and np.allclose(shape.K, 0.0, atol=1e-6))
    True
    >>> bool(np.allclose(np.abs(shape.rulings), [0.0, 1.0, 0.0], atol=2e-3))
    True
    """
    surface = as_mesh(mesh)
    limit = checked_flat(flat)
    # In the unit ball, where no square of a length is too large or too small.
    points, size = surface.frame.to_unit(surface.vertices), surface.frame.scale
    corners = topology.four_corners(surface.faces)
    s, (e, f, n), areas = face_matrices(points, gauss_image(surface), corners)
    high, low, angle = geometry.eigen(s[0][0], 0.5 * (s[0][1] + s[1][0]), s[1][1])
    along = np.cos(angle)[:, None] * e + np.sin(angle)[:, None] * f
    curvatures = np.stack([low, high], axis=1)
    directions = np.stack([np.cross(n, along), along], axis=1)
    swap = np.abs(low) > np.abs(high)
    curvatures[swap], directions[swap] = curvatures[swap, ::-1], directions[swap, ::-1]
    return ShapeOperator(
        points=_midpoints(surface),
        normals=n,
        areas=areas * size**2,
        K=geometry.determinant(s) / size**2,
        H=geometry.half_trace(s) / size,
        curvatures=curvatures / size,
        directions=directions,
        flat=np.abs(curvatures[:, 1]) < limit,
    )


def face_matrices(
    points: Array, normals: Array, corners: Ints
) -> tuple[geometry.Matrix, tuple[Array, Array, Array], Array]:
    """Shape operators of faces with four corners, their tangent frames, and their areas.

    Of a triangle, whose last corner is its first one, the diagonals are two sides.
    """
    tangents = geometry.diagonals(*(components(points[c]) for c in corners.T))
    turns = geometry.diagonals(*(components(normals[c]) for c in corners.T))
    e, f, n = (np.stack(v, axis=1) for v in geometry.tangent_frame(*tangents))
    areas = 0.5 * geometry.norm(geometry.cross(*tangents))
    return geometry.shape_matrix(*tangents, *turns), (e, f, n), areas


def checked_flat(flat: float) -> float:
    """The option, if it is a number above zero.

    Raises
    ------
    OptionError
        It is not.
    """
    if not (isinstance(flat, (int, float, np.number)) and 0.0 < float(flat) < np.inf):
        raise OptionError(f"flat={flat!r}: give a number above zero, such as {FLAT}")
    return float(flat)


def _midpoints(mesh: Mesh) -> Array:
    there = mesh.faces >= 0
    return (mesh.vertices[mesh.faces] * there[..., None]).sum(axis=1) / there.sum(axis=1)[:, None]

"""Curvatures and ruling directions of the faces, from the discrete Gauss map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso import geometry
from gso.errors import OptionError
from gso.io import as_mesh
from gso.mesh import Mesh, topology
from gso.metrics import components
from gso.rulings.gauss_image import gauss_image
from gso.typing import Array, Flags, Ints, MeshLike

#: Curvature times size below which a face counts as flat.
FLAT = 0.01
#: Share of the area whose curvature counts for the smallest radius, and the curvature, times the
#: diagonal, up to which a surface is flat.
_MOST, _STRAIGHT = 0.99, 1e-6


@dataclass(frozen=True)
class ShapeOperator:
    """Curvatures and principal directions of a surface; arrays over its m faces.

    Curvatures are positive where the surface bends away from its normal, which points to the
    side from which faces are anticlockwise: a sphere with outward normals has
    `H` = 1 / radius. Reversing the faces changes the signs of `H` and `curvatures`.

    Attributes
    ----------
    points : ndarray, (m, 3)
        Midpoints of the faces (means of the corners).
    normals : ndarray, (m, 3)
        Unit normals: of the parallelogram of edge midpoints, or of the triangle.
    areas : ndarray, (m,)
        Areas of the faces, projected along their normals.
    K, H : ndarray, (m,)
        Gaussian and mean curvature, 1 / length^2 and 1 / length.
    curvatures : ndarray, (m, 2)
        Principal curvatures, 1 / length, the one of smaller absolute value first. Their mean is
        `H`; their product is `K` up to the discretisation error.
    directions : ndarray, (m, 2, 3)
        Principal directions in the face's plane, orthonormal. Their signs are arbitrary.
    flat : ndarray of bool, (m,)
        Flat faces: both curvatures are (nearly) zero and `directions` arbitrary.
    """

    points: Array
    normals: Array
    areas: Array
    K: Array
    H: Array
    curvatures: Array
    directions: Array
    flat: Flags

    @property
    def rulings(self) -> Array:
        """Unit direction in which the surface bends least (m, 3), zero where it is flat."""
        return np.where(self.flat[:, None], 0.0, self.directions[:, 0])

    @property
    def gauss_area(self) -> float:
        """Area of the Gauss image, the integral of the absolute Gaussian curvature.

        0 for a developable surface.
        """
        return float((np.abs(self.K) * self.areas).sum())

    @property
    def thickness(self) -> float:
        """Thickness of the Gauss image: 0 (a curve) for a developable surface, 1 for a sphere.

        The integral of the absolute product of the principal curvatures over that of the square
        of the larger one. The image of a small disk on the surface is an ellipse, and this is
        the mean ratio of its width to its length. Flat faces are ignored.
        """
        low, high = self.curvatures[~self.flat].T
        areas = self.areas[~self.flat]
        width, length = (np.abs(low * high) * areas).sum(), (high**2 * areas).sum()
        return float(width / length) if areas.size else 0.0


def shape_operator(mesh: MeshLike, *, flat: float = FLAT) -> ShapeOperator:
    """Compute curvatures and principal directions of every face.

    The shape operator of a quad maps its diagonals to those of its image in the discrete
    Gauss map (Jiang et al. 2020). That of a triangle is the derivative of the normal interpolated
    from its corners (as in Rusinkiewicz 2004). Principal curvatures and directions are those of
    its symmetric part.

    Parameters
    ----------
    mesh : Mesh, or anything that :func:`gso.as_mesh` takes
        Quads, triangles or both.
    flat : float
        A face counts as flat if its curvatures times the surface's size (distance of the
        farthest vertex from the centroid) are below this.

    Returns
    -------
    ShapeOperator
        In the order of ``mesh.faces``.

    Raises
    ------
    MeshError
        The surface cannot be used.
    OptionError
        `flat` is not a number above zero.

    Notes
    -----
    `K`, `H` and the directions converge with second order in the edge length on grids and other
    smooth quad meshes, boundaries included, and with first order on irregular ones, on triangles,
    and next to irregular vertices.

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
    # In the unit ball squared lengths neither overflow nor underflow.
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
) -> tuple[geometry.Matrix[Array], tuple[Array, Array, Array], Array]:
    """Compute shape operators, tangent frames and areas of faces with four corners.

    A triangle repeats its first corner as the last one, so that its diagonals are two sides.
    """
    tangents = geometry.diagonals(*(components(points[c]) for c in corners.T))
    turns = geometry.diagonals(*(components(normals[c]) for c in corners.T))
    e, f, n = (np.stack(v, axis=1) for v in geometry.tangent_frame(*tangents))
    areas = 0.5 * geometry.norm(geometry.cross(*tangents))
    return geometry.shape_matrix(*tangents, *turns), (e, f, n), areas


def checked_flat(flat: float) -> float:
    """Check that the option `flat` is a number above zero and return it.

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
    corners = mesh.vertices[mesh.faces] * there[..., None]
    middles: Array = corners.sum(axis=1) / there.sum(axis=1)[:, None]
    return middles


def smallest_radius(surface: Mesh) -> float:
    """Return the smallest radius that a surface is bent to, in its unit; infinite if it is flat.

    The 1 % of the area that is curved most is left out, as the curvature of single faces is not
    accurate.

    >>> t = np.linspace(0, 1, 33)
    >>> arch = np.stack(np.broadcast_arrays(2 * np.cos(t), 2 * np.sin(t), 2 * t[:, None]), axis=-1)
    >>> round(smallest_radius(Mesh.from_grid(arch)), 2)
    2.0
    """
    shape = shape_operator(surface)
    curved = np.abs(shape.curvatures).max(axis=1)
    order = np.argsort(curved)
    share = np.cumsum(shape.areas[order]) / shape.areas.sum()
    most = curved[order[min(int(np.searchsorted(share, _MOST)), len(order) - 1)]]
    return float(1.0 / most) if most * surface.diagonal > _STRAIGHT else np.inf

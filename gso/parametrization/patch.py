"""Resampling of a disk-like mesh to a grid, the only input of nets, and back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso import geometry
from gso.errors import MeshError
from gso.geometry.polygon import points_at
from gso.linalg import spd
from gso.mesh import Mesh
from gso.parametrization.embedding import parts, spanned
from gso.parametrization.low_strain import low_strain
from gso.parametrization.packing import upright
from gso.spline import basis, basis_matrix, clamped_knots
from gso.typing import Array, Ints

#: Largest number of control points along each side of the spline fitted to a mesh.
_CONTROLS = 24
#: Weight of the control net's second differences; it has effect only where vertices are missing.
_SMOOTH = 1e-6
#: Largest distance of a vertex from the spline, in the unit ball, for a net to be used.
_FAR = 0.05
#: Smallest distance of two corners along the boundary, as a share of its length.
_APART = 0.1


@dataclass(frozen=True)
class Patch:
    """A mesh resampled to a grid.

    Attributes
    ----------
    grid : ndarray, (size, size, 3)
        Samples of a bicubic spline fitted to the mesh, in the mesh's frame.
    vertices : ndarray of int, (n,)
        Vertices of the mesh that belong to a face.
    parameters : ndarray, (n, 2)
        Their parameters on the grid, in [0, 1]^2.
    """

    grid: Array
    vertices: Ints
    parameters: Array

    def at_vertices(self, values: Array) -> Array:
        """Interpolate values (size, size, d) on the grid at those vertices, (n, d)."""
        from scipy.interpolate import RectBivariateSpline

        sides = (np.linspace(0.0, 1.0, n) for n in values.shape[:2])
        u, v = sides
        columns = [
            RectBivariateSpline(u, v, values[..., k]).ev(*self.parameters.T)
            for k in range(values.shape[2])
        ]
        return np.stack(columns, axis=1)


def as_patch(mesh: Mesh, size: int, *, flat: bool = False) -> Patch:
    """Resample a mesh of one component to a grid.

    A harmonic map takes the mesh to a rectangle, whose corners are the sharpest corners of
    the outer boundary. A spline fitted to the vertices over the rectangle is sampled on the
    grid; it also covers holes.

    An outline that is far from four-sided makes that map uneven. The flat image of the mesh, in
    the rectangle around it, is then the better one: the spline is continued beyond the outline.

    Parameters
    ----------
    mesh : Mesh
        One component with a boundary and without handles; it may have holes.
    size : int
        Vertices along both sides of the grid.
    flat : bool
        Whether parameters are those of the flat image.

    Raises
    ------
    MeshError
        The mesh is not of this kind, or is too far from the fitted spline.

    Examples
    --------
    >>> grid = np.stack(np.meshgrid([0.0, 1, 2, 3], [0.0, 1, 2, 3], [0.0], indexing="ij"), -1)
    >>> mesh = Mesh(grid.reshape(-1, 3), Mesh.from_grid(grid[:, :, 0]).triangles)
    >>> patch = as_patch(mesh, 8)
    >>> bool(np.allclose(patch.at_vertices(patch.grid), mesh.vertices))
    True
    """
    loops, pieces = mesh.boundary_loops, parts(mesh)
    if not loops or mesh.euler_characteristic != 2 - len(loops) or len(pieces) > 1:
        raise MeshError("it is not one piece with a boundary and without handles")
    piece = _unit(mesh, pieces[0])
    loop, at, sides = _boundary(piece)
    whole, count = _filled(piece, loop), len(piece.vertices)
    if flat:
        image = upright(low_strain(whole).flat)[:count]
        image -= image.min(axis=0)
        sides = image.max(axis=0)
    else:
        image = spanned(whole, loop, at)[:count]
    parameters = (image / sides).clip(0.0, 1.0)
    fitted, grid = _spline(piece.vertices, parameters, size)
    far = float(np.linalg.norm(fitted - piece.vertices, axis=1).max())
    if not far <= _FAR:
        raise MeshError("it is no surface that a grid of few vertices follows")
    return Patch(mesh.frame.to_user(grid), pieces[0], parameters)


def _unit(mesh: Mesh, ids: Ints) -> Mesh:
    """Return the mesh in its unit ball, without vertices that belong to no face."""
    points = mesh.frame.to_unit(mesh.vertices)
    if len(ids) == len(points):
        return mesh.replaced(points)
    return mesh.replaced(points).restricted(ids)[0]


def _filled(mesh: Mesh, outer: Ints) -> Mesh:
    """Return the mesh as triangles, each hole filled with a fan round a vertex in its middle."""
    points, triangles = [mesh.vertices], [mesh.triangles]
    for loop in mesh.boundary_loops:
        if outer[0] in loop:
            continue
        # The surface is to the left of the loop, and the new faces on its other side.
        edge = loop[::-1]
        middle = len(mesh.vertices) + len(points) - 1
        points.append(mesh.vertices[loop].mean(axis=0, keepdims=True))
        triangles.append(np.stack([edge, np.roll(edge, -1), np.full(len(edge), middle)], axis=1))
    if len(points) == 1:
        return mesh
    try:
        return Mesh(np.concatenate(points), np.concatenate(triangles))
    except MeshError:
        # A slit has no middle, and stays open.
        return mesh


def _boundary(mesh: Mesh) -> tuple[Ints, Array, Array]:
    """Return the outer boundary loop from a corner on, its image, and the rectangle's sides."""
    loop = max(mesh.boundary_loops, key=lambda ids: _lengths(mesh.vertices[ids]).sum())
    turning = np.pi - _angles(mesh)[loop]
    corners = _corners(turning, _lengths(mesh.vertices[loop]))
    loop = np.roll(loop, -corners[0])
    ends = np.append(np.array(corners) - corners[0], len(loop))
    along = np.append(0.0, np.cumsum(_lengths(mesh.vertices[loop])))
    long = np.diff(along[ends])
    sides = 0.5 * (long[:2] + long[2:])
    corner_at = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]])
    at = points_at(along[:-1], along[ends], corner_at)
    return loop, at * sides, sides


def _lengths(points: Array) -> Array:
    """Return the edge lengths of a closed polygon; edge k starts at vertex k."""
    return np.asarray(np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1))


def _angles(mesh: Mesh) -> Array:
    """Sum of the triangles' angles at every vertex, (n,)."""
    angles = geometry.corner_angles(mesh.vertices, mesh.triangles)
    total = np.zeros(len(mesh.vertices))
    np.add.at(total, mesh.triangles, angles)
    return total


def _corners(turning: Array, lengths: Array) -> list[int]:
    """Choose four vertices of a closed polygon as corners: sharp, and not near each other."""
    whole = lengths.sum()
    along = np.cumsum(lengths) - lengths
    chosen: list[int] = []
    for k in np.argsort(-turning, kind="stable"):
        gap = np.abs(along[chosen] - along[k])
        if (np.minimum(gap, whole - gap) >= _APART * whole).all() and turning[k] > 0.5:
            chosen.append(int(k))
        if len(chosen) == 4:
            return sorted(chosen)
    # A smooth boundary: split its longest stretches.
    chosen = chosen or [0]
    while len(chosen) < 4:
        chosen.sort()
        ends = np.append(along[chosen], along[chosen[0]] + whole)
        widest = int(np.diff(ends).argmax())
        middle = (0.5 * (ends[widest] + ends[widest + 1])) % whole
        away = np.abs(along - middle)
        away = np.minimum(away, whole - away)
        away[chosen] = np.inf
        chosen.append(int(away.argmin()))
    return sorted(chosen)


def _spline(points: Array, parameters: Array, size: int) -> tuple[Array, Array]:
    """Fit a smooth bicubic spline to points; evaluate it at their parameters and on a grid."""
    from scipy.sparse import diags, identity, kron

    count = int(np.clip(0.75 * np.sqrt(len(points)), 4, _CONTROLS))
    knots = clamped_knots(count)
    u, v = (basis_matrix(knots, count, x) for x in parameters.T)
    # Row-wise products of both bases.
    matrix = kron(u, np.ones((1, count))).multiply(kron(np.ones((1, count)), v)).tocsr()
    second = diags([1.0, -2.0, 1.0], [0, 1, 2], shape=(count - 2, count))
    one = identity(count)
    bent = second.T @ second
    stiffness = kron(bent, one) + kron(one, bent)
    centre = points.mean(axis=0)
    normal = matrix.T @ matrix / len(points) + _SMOOTH * stiffness
    net = spd(normal)(np.asarray(matrix.T @ (points - centre)) / len(points))
    samples = basis(knots, count, np.linspace(0.0, 1.0, size))
    grid = np.einsum(
        "ia,jb,abk->ijk", samples, samples, net.reshape(count, count, 3), optimize=True
    )
    return matrix @ net + centre, grid + centre

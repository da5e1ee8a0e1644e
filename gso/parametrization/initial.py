"""Initial images of a whole mesh, computed from scratch or from a coarser grid."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from gso import geometry
from gso.energy.stretch import cells, pieces
from gso.errors import MeshError
from gso.hierarchy import coarser, resample
from gso.mesh import Mesh
from gso.mesh.topology import corner_triangles
from gso.parametrization.arap import Relaxed, relax, strain_level
from gso.parametrization.embedding import embeddings
from gso.parametrization.rectangle import rectangle
from gso.typing import Array, Ints

#: Largest side of a grid whose image starts from a rectangle.
COARSE = 40
#: Strain above which an initial image may be a bad one.
DOUBTFUL = 0.1


def strained_triangles(mesh: Mesh) -> Ints:
    """Return the corner triangles on which strain is measured.

    Raises
    ------
    MeshError
        There are none: no face has an area.
    """
    faces = pieces(mesh)
    if not faces:
        raise MeshError(
            f"no face of {mesh!r} has an area, so there is nothing to lay out; where x0 makes it "
            "so, give another one"
        )
    return np.concatenate([corner_triangles(f) for f in faces])


def oriented_triangles(mesh: Mesh) -> Ints:
    """Return the triangles that must not be inverted.

    These are the corner triangles of the cells. On meshes that are not grids a quad with a
    concave or degenerate corner is split into two triangles instead.
    """
    if mesh.grid_index is not None:
        return corner_triangles(mesh.faces)
    return np.concatenate([corner_triangles(f) for f in cells(mesh)])


def flips(mesh: Mesh, flat: Array) -> int:
    """Count the inverted triangles of an image (n, 2)."""
    return int((geometry.signed_areas(flat, oriented_triangles(mesh)) <= 0).sum())


def strain(mesh: Mesh, flat: Array) -> float:
    """Compute the root-mean-square strain of an image (n, 2)."""
    return strain_level(mesh.vertices, strained_triangles(mesh), flat)


def begin(
    mesh: Mesh,
    *,
    iterations: int = 100,
    doubtful: float = DOUBTFUL,
    relaxation: Callable[[Array], Relaxed] | None = None,
) -> Relaxed:
    """Compute an image of low squared strain without inverted triangles, and its strain.

    Grids start from their rectangle, fine ones from the image of a coarser copy; other meshes
    from the least strained image of :func:`gso.parametrization.embeddings`. If the strain stays
    above `doubtful`, the other embeddings are relaxed too (not on fine grids), and the best result
    is returned.

    Parameters
    ----------
    mesh : Mesh
        Components with a boundary and without handles.
    iterations : int
        Largest number of iterations of :func:`gso.parametrization.arap`.
    doubtful : float
        Strain above which the other embeddings are tried.
    relaxation : callable, optional
        What lowers the squared strain of an image (n, 2), in place of local and global steps.

    Raises
    ------
    MeshError
        A component is closed or has handles.
    """
    strained, kept = strained_triangles(mesh), oriented_triangles(mesh)
    relaxed = relaxation or partial(
        relax, mesh.vertices, strained, oriented=kept, iterations=iterations
    )
    if mesh.grid is not None:
        first = relaxed(_grid_image(mesh, mesh.grid, iterations))
        if first.level <= doubtful or max(mesh.grid.shape) > COARSE:
            return first
        images = [flat for flat in embeddings(mesh, strained, kept) if not flips(mesh, flat)]
    else:
        flat, *images = embeddings(mesh, strained, kept)
        first = relaxed(flat)
        if first.level <= doubtful:
            return first
    return min([first, *map(relaxed, images)], key=lambda image: image.level)


def _grid_image(mesh: Mesh, grid: Array, iterations: int) -> Array:
    levels = coarser(mesh, COARSE) if max(grid.shape) > COARSE else []
    if levels:
        image = _interpolated(begin(levels[-1], iterations=iterations).flat, levels[-1], mesh)
        if not flips(mesh, image):
            return image
    return rectangle(grid).reshape(-1, 2)


def given(mesh: Mesh, start: Array | None) -> tuple[Array | None, str]:
    """Return the user's start (n, 2), or None and the reason if it has inverted triangles."""
    if start is None:
        return None, ""
    flat = np.ascontiguousarray(start[:, :2])
    turned = flips(mesh, flat)
    if turned:
        return None, f"it turns {turned} corner triangles over"
    return flat, ""


def refine(coarse: Mesh, fine: Mesh, flat: Array) -> Array:
    """Interpolate an image (n, 2) to a finer grid; begin anew if that inverts triangles."""
    image = _interpolated(flat, coarse, fine)
    return begin(fine).flat if flips(fine, image) else image


def _interpolated(flat: Array, coarse: Mesh, fine: Mesh) -> Array:
    if coarse.grid_shape is None or fine.grid_shape is None:
        raise ValueError("both meshes must be grids")
    return resample(flat.reshape(*coarse.grid_shape, 2), *fine.grid_shape).reshape(-1, 2)

"""Conversion of arrays, files and trimesh objects to a mesh."""

from __future__ import annotations

import os
import sys
from typing import Any

import numpy as np

from gso.errors import MeshError
from gso.io.polygons import are_polygons, of_polygons
from gso.io.raw_surface import Surface, welded
from gso.mesh import Mesh
from gso.typing import MeshLike, Unwelded


def as_mesh(x: MeshLike, *, weld: float | None = None) -> Mesh:
    """Make a mesh from a mesh, a grid of points, vertices and faces, or a file.

    Parameters
    ----------
    x : Mesh, array_like (H, W, 3), (vertices, faces), trimesh.Trimesh, str or PathLike
        A `Mesh` is returned unchanged when `weld` is None. Faces may be lists of vertices of any
        length; those of five or more are cut into triangles.
    weld : float, optional
        Merge vertices that lie within this distance of each other (see
        :func:`gso.io.welded`).

    Returns
    -------
    Mesh

    Raises
    ------
    MeshError
        `x` is none of these, or its geometry is rejected (see :class:`gso.Mesh`).
    OptionError
        `weld` is not a finite number of 0 or more.

    Examples
    --------
    >>> as_mesh(([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]))
    Mesh(4 vertices, 1 faces, quads)
    """
    if isinstance(x, Unwelded):
        surface: Any = x.surface
        if x.chord is not None:
            from gso.io import load

            return load(surface, weld=x.weld, chord=x.chord)
        return as_mesh(surface, weld=x.weld)
    if isinstance(x, Mesh):
        return x if weld is None else welded(x, weld)
    if isinstance(x, (str, bytes, os.PathLike)):
        from gso.io import load

        return load(os.fsdecode(x), weld=weld)
    return as_surface(x).mesh(weld)


def as_surface(x: MeshLike) -> Surface:
    """Return the vertices and faces of what :func:`as_mesh` takes, without checking them.

    Raises
    ------
    MeshError
        `x` is no surface, or a file that cannot be read.

    Examples
    --------
    >>> as_surface(([[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 1, 2]])).faces
    [[0, 1, 2]]
    """
    if isinstance(x, Unwelded):
        given: Any = x.surface
        if isinstance(given, (str, bytes, os.PathLike)):
            from gso.io import read_surface

            surface = read_surface(os.fsdecode(given), chord=x.chord)
        else:
            surface = as_surface(given)
        return surface if x.weld is None else surface.welded(x.weld)
    if isinstance(x, Mesh):
        return Surface(x.vertices, x.faces, x.given_notes, x.attributes)
    if isinstance(x, (str, bytes, os.PathLike)):
        from gso.io import read_surface

        return read_surface(os.fsdecode(x))
    # If x is a Trimesh, trimesh has been imported already.
    trimesh = sys.modules.get("trimesh")
    if trimesh is not None and isinstance(x, trimesh.Trimesh):
        return Surface(x.vertices, x.faces)
    if trimesh is not None and isinstance(x, trimesh.Scene):
        raise MeshError("a trimesh.Scene is no single mesh; give scene.to_mesh()")
    if isinstance(x, (tuple, list)) and len(x) == 2:
        return of_polygons(*x) if are_polygons(x[1]) else Surface(*x)
    try:
        values: Any = x
        points = np.asarray(values)
    except (TypeError, ValueError):
        points = np.empty(0, object)
    if points.ndim == 3 and points.shape[2] == 3 and points.dtype.kind in "iuf":
        return Surface(points, None)
    what = f"an array {points.shape}" if points.dtype.kind in "iuf" else f"{type(x).__name__}"
    raise MeshError(
        f"{what} is no surface: give a Mesh, an array (H, W, 3), a pair (vertices, faces), a "
        "trimesh.Trimesh, or the path of a mesh file"
    )

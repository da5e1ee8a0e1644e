"""Conversion of arrays, files and meshes of other packages to a mesh, and back."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from gso.errors import MeshError
from gso.io import hosts
from gso.io.polygons import are_polygons, of_polygons
from gso.io.raw_surface import Surface, welded
from gso.mesh import Mesh
from gso.typing import MeshLike, Unwelded


def as_mesh(x: MeshLike, *, weld: float | None = None) -> Mesh:
    """Make a mesh from a mesh, a grid of points, vertices and faces, or a file.

    Parameters
    ----------
    x : Mesh, array_like (H, W, 3), (vertices, faces), mesh of another package, str or PathLike
        Meshes of trimesh, COMPAS, meshio and PyVista are recognised by their attributes. Faces may
        be lists of vertices of any length; those of five or more are cut into triangles. A `Mesh`
        is returned unchanged when `weld` is None.
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
    if isinstance(x, (tuple, list)) and len(x) == 2:
        return of_polygons(*x) if are_polygons(x[1]) else Surface(*x)
    found = hosts.surface_of(x)
    if found is not None:
        return found
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
        f"mesh of {', '.join(hosts.names())}, or the path of a mesh file"
    )


def as_host(x: MeshLike, name: str) -> Any:
    """Make the mesh of another package.

    Parameters
    ----------
    x : Mesh
        Or anything that :func:`as_mesh` takes.
    name : {"compas", "meshio", "pyvista", "trimesh"}
        The package. Its meshes have the vertices in the same order and the same faces: those of
        trimesh are triangles, and meshio has the triangles of mixed meshes before the quads.

    Returns
    -------
    compas.datastructures.Mesh, meshio.Mesh, pyvista.PolyData or trimesh.Trimesh

    Raises
    ------
    OptionError
        There is no such package here.
    GSOError
        It is not installed.
    MeshError
        `x` is no surface.

    Examples
    --------
    >>> y, x = np.mgrid[:3, :4]
    >>> as_host(np.stack([x, y, 0 * x], axis=-1), "trimesh")
    <trimesh.Trimesh(vertices.shape=(12, 3), faces.shape=(12, 3))>
    """
    return hosts.made(as_mesh(x), name)

"""Meshes of surfaces that are not manifold, and edges of them by given vertices."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import ArrayLike

from gso import io
from gso.errors import MeshError, NonManifoldError, OptionError
from gso.io.raw_surface import Surface
from gso.mesh import Mesh
from gso.mesh.topology import pair_keys
from gso.mesh.validation import checked_table, checked_vertices
from gso.typing import Ints, MeshLike
from gso.unfolding.manifold_division import divided


def manifold_mesh(given: MeshLike, *, sheets: bool = False) -> tuple[Mesh, Ints]:
    """Make a mesh as :func:`gso.as_mesh`; a surface that is not manifold is divided, with a note.

    Bodies that touch at a vertex or an edge become components; so does a fin at a body's edge.
    Vertices keep their numbers, and copies of them follow.

    Parameters
    ----------
    given : MeshLike
    sheets : bool
        Whether the surface is one of sheets rather than of bodies. Then faces inside bodies become
        sheets of their own, sheets that go on nearly straight across an edge of more than two
        faces stay joined there, and one-sided surfaces are cut.

    Returns
    -------
    Mesh
    ndarray of int, (n,)
        The given vertex of each vertex.

    Raises
    ------
    MeshError
        The surface cannot be read or used, or a body has faces inside and `sheets` is not set.
    """
    try:
        mesh = io.as_mesh(given)
        return mesh, np.arange(len(mesh.vertices))
    except NonManifoldError as error:
        refused = error
    surface = io.as_surface(given)
    try:
        found = _of_surface(surface, sheets)
    except MeshError as error:
        source = given.surface if isinstance(given, io.Unwelded) else given
        if not isinstance(source, str | bytes | os.PathLike):
            raise
        raise MeshError(f"{os.fsdecode(source)}: {error}") from None
    if found is None:
        raise refused
    return found


def edges_between(mesh: Mesh, vertex: Ints, pairs: ArrayLike | None, name: str) -> Ints:
    """Return the edges (e, 2) of a mesh between given vertices, of all copies of them.

    Parameters
    ----------
    mesh : Mesh
    vertex : ndarray of int, (n,)
        The given vertex of each vertex.
    pairs : array_like of int, (k, 2), or None
    name : str
        The option, for errors.

    Raises
    ------
    OptionError
        A pair is no edge of a face.
    """
    if pairs is None or np.size(pairs) == 0:
        return np.empty((0, 2), np.int64)
    given = np.asarray(pairs)
    if given.ndim != 2 or given.shape[1] != 2 or given.dtype.kind not in "iu":
        raise OptionError(f"{name} must be pairs of vertices, (k, 2), not {given.shape}")
    count = max(int(vertex.max()), int(np.abs(given).max())) + 1
    wanted = pair_keys(given, count)
    own = vertex[mesh.edges]
    keys = pair_keys(own, count)
    bad = np.flatnonzero((given < 0).any(axis=1) | ~np.isin(wanted, keys))
    if len(bad):
        a, b = given[bad[0]]
        raise OptionError(f"{name}: {a}-{b} is no edge of a face; cuts run along edges")
    return np.asarray(mesh.edges[np.isin(keys, wanted)])


def _of_surface(surface: Surface, sheets: bool) -> tuple[Mesh, Ints] | None:
    """Divide an unchecked surface; None where that does not make it manifold."""
    if surface.faces is None:
        return None
    points = checked_vertices(surface.vertices)
    table = checked_table(np.asarray(surface.faces), len(points))
    split = table[:, :3], table[:, [0, 2, -1]][(table.shape[1] == 4) & (table[:, -1] >= 0)]
    owner = np.concatenate([np.arange(len(table)), np.flatnonzero(table[:, -1] >= 0)])
    triangles = np.concatenate(split if table.shape[1] == 4 else split[:1])
    owner = owner[: len(triangles)]
    names = owner if surface.polygon is None else surface.polygon[owner]
    found = divided(points, triangles, names, sheets)
    if found is None:
        return None
    number, vertex, note = found
    # The triangles of a face hang together, so that its corners have one number each.
    new = table.copy()
    for k in range(3):
        for column in range(table.shape[1]):
            same = table[owner, column] == triangles[:, k]
            new[owner[same], column] = number[same, k]
    notes = (*surface.notes, note)
    made = Mesh(points[vertex], new, notes=notes, attributes=surface.attributes, touching=True)
    return made, vertex

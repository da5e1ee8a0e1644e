"""Division of surfaces where they are not manifold, and faces inside bodies."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import ArrayLike

from gso import io
from gso.errors import MeshError, NonManifoldError, OptionError
from gso.geometry.vectors import unit
from gso.io.raw_surface import Surface
from gso.mesh import Mesh
from gso.mesh.topology import edge_keys, label_components, pair_keys
from gso.mesh.validation import checked_table, checked_vertices
from gso.typing import Array, Flags, Ints, MeshLike

#: Volume, relative to the cube of the size, from which on a region of space is closed.
_CLOSED = 1e-9


def manifold_mesh(given: MeshLike) -> tuple[Mesh, Ints]:
    """Make a mesh as :func:`gso.as_mesh`; a surface that is not manifold is divided, with a note.

    Bodies that touch at a vertex or an edge become components; so does a fin at a body's edge.
    Vertices keep their numbers, and copies of them follow.

    Returns
    -------
    Mesh
    ndarray of int, (n,)
        The given vertex of each vertex.

    Raises
    ------
    MeshError
        The surface cannot be read or used, or a body has faces inside.
    """
    try:
        mesh = io.as_mesh(given)
        return mesh, np.arange(len(mesh.vertices))
    except NonManifoldError:
        if isinstance(given, tuple | list) and len(given) == 2:
            return _of_surface(Surface(*given))
        if not isinstance(given, str | bytes | os.PathLike):
            raise
    path = os.fsdecode(given)
    try:
        return _of_surface(io.read_surface(path))
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None


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


def _of_surface(surface: Surface) -> tuple[Mesh, Ints]:
    points = checked_vertices(surface.vertices)
    table = checked_table(np.asarray(surface.faces), len(points))
    split = table[:, :3], table[:, [0, 2, -1]][(table.shape[1] == 4) & (table[:, -1] >= 0)]
    owner = np.concatenate([np.arange(len(table)), np.flatnonzero(table[:, -1] >= 0)])
    triangles = np.concatenate(split if table.shape[1] == 4 else split[:1])
    owner = owner[: len(triangles)]
    names = owner if surface.polygon is None else surface.polygon[owner]
    found = divided(points, triangles, names)
    if found is None:
        raise MeshError("the surface is not manifold, and cannot be divided")
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


def divided(points: Array, triangles: Ints, names: Ints) -> tuple[Ints, Ints, str] | None:
    """Divide triangles (t, 3) where they are not manifold.

    Around an edge of more than two, those that bound the same body stay joined.

    Parameters
    ----------
    points : ndarray, (n, 3)
    triangles : ndarray of int, (t, 3)
    names : ndarray of int, (t,)
        The given face of each triangle.

    Returns
    -------
    (ndarray of int (t, 3), ndarray of int (m,), str) or None
        The triangles, the given vertex of each vertex, and a note; None if they are manifold.

    Raises
    ------
    MeshError
        A body has faces inside.
    """
    count = len(points)
    origin, dest = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    key = edge_keys(origin, dest, count)
    order = np.argsort(key, kind="stable")
    _, start, often = np.unique(key[order], return_index=True, return_counts=True)
    pair = start[often == 2]
    one, other = order[pair], order[pair + 1]
    crowded = often > 2
    if crowded.any():
        more = _around(points, triangles, order[np.repeat(crowded, often)], names)
        one, other = np.r_[one, more[0]], np.r_[other, more[1]]
    # The corners at both ends of an edge with two faces are joined.
    ahead = np.arange(len(origin)) // 3 * 3 + (np.arange(len(origin)) + 1) % 3
    same = origin[one] == origin[other]
    a = np.r_[one, ahead[one]]
    b = np.r_[np.where(same, other, ahead[other]), np.where(same, ahead[other], other)]
    fan = label_components(len(origin), a, b)
    _, corner = np.unique(fan, return_index=True)
    owner = origin[corner]
    if len(owner) == len(np.unique(origin)):
        return None
    rank = np.argsort(owner, kind="stable")
    fresh = np.r_[True, owner[rank][1:] != owner[rank][:-1]]
    # The first fan of a vertex keeps its number.
    number = owner.copy()
    number[rank[~fresh]] = count + np.arange(int((~fresh).sum()))
    vertex = np.r_[np.arange(count), owner[rank[~fresh]]]
    at = int(owner[rank[~fresh]][0])
    note = (
        f"the surface was divided at {len(np.unique(owner[rank[~fresh]]))} vertices where its "
        f"parts share no edge with two faces (the first is vertex {at})"
    )
    if crowded.any():
        edge = int(order[start[crowded][0]])
        note += (
            f"; {int(crowded.sum())} edges have more than two faces (the first is "
            f"{origin[edge]}-{dest[edge]})"
        )
    return number[fan].reshape(triangles.shape), vertex, note


def _around(points: Array, triangles: Ints, halves: Ints, names: Ints) -> tuple[Ints, Ints]:
    """Pair the half-edges at edges of more than two triangles that bound the same body.

    Both sides of each triangle belong to regions of space: around an edge, the sides that face
    each other belong to one. Closed regions have a volume above zero, and the space outside of
    them one below zero.

    Raises
    ------
    MeshError
        On both sides of some triangle there are different closed regions.
    """
    count, t = len(points), len(triangles)
    p = points[triangles]
    origin, dest = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    key = edge_keys(origin, dest, count)
    forward = origin < dest
    way = unit(np.where(forward, 1.0, -1.0)[:, None] * (points[dest] - points[origin]))
    inward = p[:, [2, 0, 1]].reshape(-1, 3) - points[origin]
    least = np.eye(3)[np.abs(way).argmin(axis=1)]
    x = unit(np.cross(least, way))
    angle = np.arctan2((np.cross(way, x) * inward).sum(axis=1), (x * inward).sum(axis=1))
    order = np.lexsort((angle, key))
    last = np.flatnonzero(np.diff(key[order], append=-1) != 0)
    first = np.r_[0, last[:-1] + 1]
    after = np.r_[order[1:], order[:1]]
    after[last] = order[first]
    # Anticlockwise about the edge is the front of a triangle that runs along it.
    triangle = order // 3
    left = triangle + t * ~forward[order]
    right = after // 3 + t * forward[after]
    region = label_components(2 * t, left, right)
    middle = points - points[np.unique(triangles)].mean(axis=0)
    q = middle[triangles]
    volume = np.einsum("td,td->t", q[:, 0], np.cross(q[:, 1], q[:, 2])) / 6.0
    size = np.bincount(region, np.r_[-volume, volume])
    closed: Flags = size > _CLOSED * float(np.ptp(points[origin], axis=0).max()) ** 3
    front, back = region[:t], region[t:]
    inner = np.flatnonzero(closed[front] & closed[back] & (front != back))
    if len(inner):
        some = np.unique(names[inner])
        place = ", ".join(f"{x:.6g}" for x in p[inner[0]].mean(axis=0))
        raise MeshError(
            f"face {some[0]} at ({place}) is inside a body, with parts of it on both sides "
            f"({len(some)} such faces); delete them, or separate the bodies"
        )
    solid = closed[region[left]] & np.isin(order, halves)
    return order[solid], after[solid]

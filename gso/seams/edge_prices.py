"""Edges that seams should follow, and faces that they should keep away from, as prices of edges."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import MeshError, OptionError
from gso.mesh import Mesh
from gso.mesh.topology import pair_keys
from gso.seams.kinds import Seam
from gso.seams.polyline_seam import Polyline
from gso.typing import Array, Ints

#: What seams should follow: edges (k, 2), polylines (k, 3), or seams.
Follow: TypeAlias = "ArrayLike | Seam | Sequence[ArrayLike | Seam]"
#: What seams should keep away from: faces, a mask of all faces, or polylines (k, 3).
Avoid: TypeAlias = "ArrayLike | Polyline | Sequence[ArrayLike | Polyline]"

#: Factors on the cost of edges in regions to avoid, and on edges to follow.
_AVOID, _FOLLOW = 20.0, 0.2


def prices(mesh: Mesh, along: Follow | None, avoid: Avoid | None) -> Array | None:
    """Return the factor on the cost of each edge of ``mesh.edges``; None if all are one.

    Parameters
    ----------
    mesh : Mesh
    along, avoid
        As for :func:`edges_to_follow` and :func:`faces_to_avoid`.
    """
    wanted, faces = edges_to_follow(mesh, along), faces_to_avoid(mesh, avoid)
    if not (len(wanted) or len(faces)):
        return None
    ends, count = mesh.edges, len(mesh.vertices)
    factor = np.ones(len(ends))
    corners = mesh.faces[faces]
    inside = np.zeros(count, bool)
    inside[corners[corners >= 0]] = True
    factor[inside[ends].all(axis=1)] *= _AVOID
    factor[np.isin(pair_keys(ends, count), pair_keys(wanted, count))] *= _FOLLOW
    return factor


def pairs_of(along: Follow | None) -> Array | None:
    """Return what seams should follow if it is edges, pairs of vertices; None if it is not."""
    whole = _array(along)
    return whole if whole is not None and whole.ndim == 2 and whole.shape[1] == 2 else None


def edges_to_follow(mesh: Mesh, along: Follow | None) -> Ints:
    """Return the edges (k, 2) of a mesh that seams should follow.

    Parameters
    ----------
    mesh : Mesh
    along : array_like of int (k, 2), array_like (k, 3), Seam, sequence of these, or None
        Edges by their vertices, points of polylines, or seams. Points are moved to the nearest
        vertices; between them the edges follow the polyline.

    Raises
    ------
    OptionError
        It is none of these, an edge is no edge of a face, or a polyline is not on the surface.

    Examples
    --------
    >>> u, v = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 5), indexing="ij")
    >>> sheet = Mesh.from_grid(np.dstack([u, v, 0.1 * u * v]))
    >>> edges_to_follow(sheet, [[[0.5, 0, 0], [0.51, 0.6, 0.03]]]).tolist()
    [[10, 11], [11, 12]]
    """
    none = np.empty((0, 2), np.int64)
    whole = _array(along)
    if along is None or (whole is not None and whole.size == 0):
        return none
    pairs = pairs_of(along)
    if pairs is not None:
        return _edges(mesh, pairs)
    found = [none]
    for number, one in enumerate(_lines(along, whole, "along", "edges as pairs of vertices"), 1):
        seam = one if isinstance(one, Seam) else Polyline(one)
        try:
            found.append(seam.edges(mesh))
        except (MeshError, OptionError) as error:
            raise OptionError(f"along, line {number}: {error}") from None
    return np.concatenate(found)


def faces_to_avoid(mesh: Mesh, avoid: Avoid | None) -> Ints:
    """Return the faces (k,) of a mesh that seams should keep away from.

    Parameters
    ----------
    mesh : Mesh
    avoid : array_like of int (k,), of bool (m,), or (k, 3), Polyline, sequence of these, or None
        Faces, a mask of all faces, or polylines: the faces that they pass over.

    Raises
    ------
    OptionError
        It is none of these, there is no such face, or a polyline is not on the surface.

    Examples
    --------
    >>> u, v = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 5), indexing="ij")
    >>> sheet = Mesh.from_grid(np.dstack([u, v, 0.1 * u * v]))
    >>> faces_to_avoid(sheet, [[[0.1, 0.1, 0], [0.4, 0.1, 0]]]).tolist()
    [0, 4]
    """
    none = np.empty(0, np.int64)
    whole = _array(avoid)
    if avoid is None or (whole is not None and whole.size == 0):
        return none
    if whole is not None and whole.ndim < 2 and not isinstance(avoid, Seam):
        return _faces(np.atleast_1d(whole), len(mesh.faces))
    found = [none]
    for number, one in enumerate(_lines(avoid, whole, "avoid", "faces, a mask of all faces"), 1):
        if isinstance(one, Seam) and not isinstance(one, Polyline):
            raise OptionError(
                f"avoid, line {number} is a {type(one).__name__}; of seams it takes Polyline"
            )
        line = one if isinstance(one, Polyline) else Polyline(one)
        try:
            found.append(line.faces(mesh))
        except OptionError as error:
            raise OptionError(f"avoid, line {number}: {error}") from None
    return np.unique(np.concatenate(found))


def _array(given: object) -> Array | None:
    """Return what was given as an array of numbers; None if it is something else."""
    if given is None or isinstance(given, Seam):
        return None
    try:
        whole = np.asarray(given)
    except ValueError:
        return None
    return whole if whole.dtype.kind in "biuf" else None


def _lines(given: object, whole: Array | None, name: str, others: str) -> list[ArrayLike | Seam]:
    """Return polylines (k, 3) and seams, one or several of them."""
    if isinstance(given, Seam):
        return [given]
    if _is_polyline(whole):
        return [np.asarray(whole)]
    several = given if isinstance(given, Iterable) and not isinstance(given, str) else ()
    lines: list[ArrayLike | Seam] = list(several)
    if not all(isinstance(line, Seam) or _is_polyline(_array(line)) for line in lines):
        lines = []
    if not lines:
        said = type(given).__name__ if whole is None else f"an array of shape {whole.shape}"
        raise OptionError(
            f"{name} is {said}; it must be {others}, or polylines as arrays of points (k, 3)"
        )
    return lines


def _is_polyline(line: Array | None) -> bool:
    return line is not None and line.ndim == 2 and line.shape[1] == 3


def _edges(mesh: Mesh, given: Array) -> Ints:
    """Check edges (k, 2)."""
    count = len(mesh.vertices)
    if given.dtype.kind not in "iu":
        raise OptionError("along has pairs that are not whole numbers; give pairs of vertices")
    wanted = given.astype(np.int64)
    beyond = wanted[((wanted < 0) | (wanted >= count)).any(axis=1)]
    if len(beyond):
        a, b = beyond[0]
        raise OptionError(f"along has the pair {a}-{b}; vertices are 0 to {count - 1}")
    missing = np.flatnonzero(~np.isin(pair_keys(wanted, count), pair_keys(mesh.edges, count)))
    if missing.size:
        a, b = wanted[missing[0]]
        raise OptionError(f"along has the pair {a}-{b}, which is no edge of a face")
    return wanted


def _faces(given: Array, count: int) -> Ints:
    """Check faces (k,), or a mask of all faces."""
    if given.dtype == bool and given.shape == (count,):
        return np.flatnonzero(given)
    if given.dtype.kind not in "iu":
        raise OptionError("avoid must be a list of faces, or a mask of all faces")
    bad = given[(given < 0) | (given >= count)]
    if bad.size:
        raise OptionError(f"avoid names face {bad[0]}; the mesh has {count}")
    return given.astype(np.int64)

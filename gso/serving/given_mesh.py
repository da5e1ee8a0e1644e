"""The surface that a request is about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.cut_pieces import Pieces
from gso.errors import OptionError
from gso.io import Unwelded, as_mesh
from gso.mesh import Mesh
from gso.seams import Edges, cut
from gso.spelling import check_keywords
from gso.typing import Array, Ints, Json, MeshLike
from gso.unfolding.unfold_mesh import Polygons

_FIELDS = ("vertices", "faces", "seams")
#: How surfaces are written in requests.
_FORM = 'a path, or {"vertices": [[x, y, z], ...], "faces": [[...], ...]}'


@dataclass(frozen=True)
class GivenMesh:
    """A surface as a request has it.

    Attributes
    ----------
    surface : str, Unwelded, tuple or Mesh
        A file, vertices and polygons, or a mesh with merged vertices.
    faces : sequence of sequences of int, or None
        The polygons; None for a file, or where vertices are merged.
    seams : ndarray of int, (k, 2)
        Edges of it that are marked as seams.
    """

    surface: Polygons
    faces: Sequence[Sequence[int]] | None
    seams: Ints

    @classmethod
    def of(cls, params: Json) -> GivenMesh:
        """Read the parameters ``mesh``, ``weld`` and ``chord``.

        Raises
        ------
        OptionError
            The mesh is missing, or is not written as one.
        """
        if "mesh" not in params:
            raise OptionError(f'there is no "mesh"; give {_FORM}')
        given, weld, chord = (params.get(name) for name in ("mesh", "weld", "chord"))
        if isinstance(given, str):
            plain = weld is None and chord is None
            return cls(given if plain else Unwelded(given, weld, chord), None, _edges(None))
        if not isinstance(given, dict) or not {"vertices", "faces"} <= given.keys():
            raise OptionError(f'"mesh" is not written as one; give {_FORM}')
        check_keywords('"mesh"', given, _FIELDS)
        if chord is not None:
            raise OptionError("chord is for CAD files, and the mesh is none; leave it out")
        pair = (given["vertices"], given["faces"])
        seams = _edges(given.get("seams"))
        if weld is None:
            return cls(pair, given["faces"], seams)
        mesh = as_mesh(pair, weld=weld)
        return cls(mesh, None, _merged(seams, np.asarray(given["vertices"], float), mesh))

    def mesh(self) -> Mesh:
        """Return it as a mesh."""
        given: MeshLike = self.surface
        return as_mesh(given)

    def cut(self) -> Mesh | Pieces:
        """Return it as a mesh, cut along its seams if it has any."""
        mesh = self.mesh()
        return cut(mesh, Edges(self.seams)) if len(self.seams) else mesh

    def seams_and(self, more: ArrayLike | None) -> Ints:
        """Return its seams and other edges, (k, 2)."""
        return np.concatenate([self.seams, _edges(more)])


def _merged(edges: Ints, points: Array, mesh: Mesh) -> Ints:
    """Return edges between points as edges of a mesh, in which points were merged."""
    from scipy.spatial import cKDTree

    if edges.size and not 0 <= edges.min() <= edges.max() < len(points):
        raise OptionError(f"seams name a vertex that is not there; there are {len(points)}")
    moved = np.asarray(cKDTree(mesh.vertices).query(points)[1])[edges]
    return np.asarray(moved[moved[:, 0] != moved[:, 1]], np.int64).reshape(-1, 2)


def _edges(given: object) -> Ints:
    """Return edges as pairs of vertices, (k, 2).

    Raises
    ------
    OptionError
        They are none.
    """
    if given is None:
        return np.empty((0, 2), np.int64)
    try:
        edges = np.asarray(given)
    except (TypeError, ValueError):
        edges = np.empty(0)
    if edges.size == 0 and isinstance(given, list):
        return np.empty((0, 2), np.int64)
    if edges.ndim != 2 or edges.shape[1] != 2 or edges.dtype.kind not in "iu":
        raise OptionError("edges are pairs of vertices, such as [[0, 7], [7, 8]]")
    return edges.astype(np.int64)

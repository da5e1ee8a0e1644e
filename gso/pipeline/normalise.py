"""The solver's form of a mesh: in the unit ball, grids numbered row by row."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gso.constraints import Compiled
from gso.errors import MeshError
from gso.mesh import Frame, Mesh, topology
from gso.typing import Array, Ints

if TYPE_CHECKING:
    from gso.io.convert import MeshLike


class Canonical:
    """A mesh in the unit ball, grids numbered row by row, with the maps back to the user's.

    Parameters
    ----------
    design : Mesh
    names : ndarray of int, (n,), optional
        Vertex indices for messages, where the design is a part of the user's mesh.
    """

    def __init__(self, design: Mesh, names: Ints | None = None):
        self.design = design
        self.frame: Frame = design.frame
        if not self.frame.scale > 0:
            raise MeshError("all vertices are at one point")
        n = len(design.vertices)
        if design.grid_index is None or _row_by_row(design):
            self.order = np.arange(n)
            self.mesh = design.replaced(self.frame.to_unit(design.vertices))
        else:
            self.order = design.grid_index.ravel()
            self.mesh = Mesh.from_grid(self.frame.to_unit(design.grid), weld=False)  # type: ignore[arg-type]
        self.new_index = np.empty(n, np.int64)
        self.new_index[self.order] = np.arange(n)
        #: Indices for messages of the vertices in this numbering.
        self.names = self.order if names is None else names[self.order]

    @property
    def scale(self) -> float:
        """Radius of the unit ball, in the user's unit."""
        return self.frame.scale

    def start(self, x0: MeshLike | None, *, flat: bool) -> Array | None:
        """Convert the coordinates of a warm start to this numbering and frame."""
        if x0 is None:
            return None
        points, ordered = given_points(x0, len(self.order), self.mesh.grid_shape, flat=flat)
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if not spread[1] > 1e-9 * spread[0]:
            raise MeshError("x0 has no area: all its vertices are on one line")
        points = points if ordered else points[self.order]
        return points[:, :2] / self.frame.scale if flat else self.frame.to_unit(points)

    def constraints(self, given: Compiled) -> Compiled:
        """Convert constraints on the design to this numbering and frame."""
        frame = Frame(np.zeros(2), self.scale) if given.flat else self.frame
        return given.mapped(frame, self.new_index)

    def back(self, block: str, values: Array) -> Array:
        """Reorder the rows of a block from this numbering to the user's."""
        return values[self._new_face if block == "scale" else self.new_index]

    @cached_property
    def _new_face(self) -> Ints:
        """Index in this numbering of every face of the design."""
        here, there = self.mesh.faces, self.design.faces
        if self.design.grid_index is None:
            return np.arange(len(there))
        corners = (np.sort(x, axis=1) for x in (self.new_index[there], here))
        users, own = (np.lexsort(x.T[::-1]) for x in corners)
        new = np.empty(len(there), np.int64)
        new[users] = own
        return new


def _row_by_row(mesh: Mesh) -> bool:
    """Return whether a grid has the numbering and the faces that grids are solved with."""
    height, width = mesh.grid_shape or (0, 0)
    return np.array_equal(mesh.faces, topology.grid_faces(height, width))


def given_points(
    x0: MeshLike, count: int, shape: tuple[int, int] | None, *, flat: bool
) -> tuple[Array, bool]:
    """Read points (count, 3), or (count, 2) of a flat image, that a user gave as mesh or array.

    Also returns whether they are in grid order, row by row, rather than in vertex order.

    Raises
    ------
    MeshError
        The points are not finite numbers, or not as many as the vertices.
    """
    try:
        points = np.asarray(getattr(x0, "vertices", x0), dtype=np.float64)
    except (TypeError, ValueError):
        raise MeshError("x0 must be a mesh or an array of numbers") from None
    columns = (2, 3) if flat else (3,)
    ordered = points.ndim == 3
    fits = points.shape[:1] == (count,) if not ordered else points.shape[:2] == shape
    if points.ndim not in (2, 3) or not fits or points.shape[-1] not in columns:
        grid = "" if shape is None else f" or {(*shape, columns[0])}"
        raise MeshError(f"x0 has shape {points.shape}; it must be {(count, columns[0])}{grid}")
    points = points.reshape(count, -1)
    if not np.isfinite(points).all():
        raise MeshError("x0 has coordinates that are not finite")
    return points, ordered

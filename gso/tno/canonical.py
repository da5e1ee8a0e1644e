"""A mesh as the solver wants it: in the unit ball, grids numbered row by row."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gso.constraints import Compiled, Constraint, compile_constraints
from gso.mesh import Frame, Mesh
from gso.status import MeshError

Array = NDArray[np.float64]


class Canonical:
    """A mesh in the unit ball, grids numbered row by row, and the way back."""

    def __init__(self, design: Mesh):
        self.design = design
        self.frame: Frame = design.frame
        if not self.frame.scale > 0:
            raise MeshError("all vertices are at one point")
        n = len(design.vertices)
        if design.grid_index is None:
            self.order = np.arange(n)
            self.mesh = design.replaced(self.frame.to_unit(design.vertices))
        else:
            self.order = design.grid_index.ravel()
            self.mesh = Mesh.from_grid(self.frame.to_unit(design.grid), weld=False)  # type: ignore[arg-type]
        self.new_index = np.empty(n, np.int64)
        self.new_index[self.order] = np.arange(n)

    def start(self, x0: Any, *, flat: bool) -> Array | None:
        """Coordinates of a warm start in this numbering and frame."""
        if x0 is None:
            return None
        try:
            points = np.asarray(getattr(x0, "vertices", x0), dtype=np.float64)
        except (TypeError, ValueError):
            raise MeshError("x0 must be a mesh or an array of numbers") from None
        n, shape = len(self.order), self.mesh.grid_shape
        columns = (2, 3) if flat else (3,)
        ordered = points.ndim == 3
        fits = points.shape[:1] == (n,) if not ordered else points.shape[:2] == shape
        if points.ndim not in (2, 3) or not fits or points.shape[-1] not in columns:
            grid = "" if shape is None else f" or {(*shape, columns[0])}"
            raise MeshError(f"x0 has shape {points.shape}; it must be {(n, columns[0])}{grid}")
        points = points.reshape(n, -1)
        if not np.isfinite(points).all():
            raise MeshError("x0 has coordinates that are not finite")
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if not spread[1] > 1e-9 * spread[0]:
            raise MeshError("x0 has no area: all its vertices are on one line")
        points = points if ordered else points[self.order]
        return points[:, :2] / self.frame.scale if flat else self.frame.to_unit(points)

    def constraints(self, given: Iterable[Constraint], *, flat: bool) -> Compiled:
        """Constraints checked against the design, in this numbering and frame."""
        frame = Frame(np.zeros(2), self.frame.scale) if flat else self.frame
        return compile_constraints(given, self.design, flat=flat).mapped(frame, self.new_index)

    def back(self, block: str, values: Array) -> Array:
        """Rows of a block in this numbering, put in the user's."""
        return values[self._new_face if block == "scale" else self.new_index]

    @cached_property
    def _new_face(self) -> NDArray[np.int64]:
        """Index in this numbering of every face."""
        here, there = self.mesh.faces, self.design.faces
        if self.design.grid_index is None:
            return np.arange(len(there))
        corners = (np.sort(x, axis=1) for x in (self.new_index[there], here))
        users, own = (np.lexsort(x.T[::-1]) for x in corners)
        new = np.empty(len(there), np.int64)
        new[users] = own
        return new

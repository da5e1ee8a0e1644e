"""What a result must keep: fixed vertices, a fixed boundary, position handles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gso.mesh import Mesh
from gso.status import OptionError

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Fixed:
    """Vertices that stay where they are.

    Parameters
    ----------
    ids : array_like of int
        Vertex indices.
    """

    ids: ArrayLike


@dataclass(frozen=True)
class FixedBoundary:
    """Every vertex on the boundary stays where it is."""


@dataclass(frozen=True, eq=False)
class Handle:
    """Vertices that move to given positions.

    Parameters
    ----------
    ids : array_like of int, (k,)
        Vertex indices.
    positions : array_like, (k, 3)
        Where they go, in the unit of the mesh.
    weight : float, optional
        Strength of a soft handle, of the order of 1; a hard one when not given.
    """

    ids: ArrayLike
    positions: ArrayLike
    weight: float | None = None


Constraint = Fixed | FixedBoundary | Handle


@dataclass
class Compiled:
    """Constraints in one place, positions in the frame of the mesh they were compiled for."""

    hard_ids: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    hard_positions: Array = field(default_factory=lambda: np.zeros((0, 3)))
    soft_ids: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    soft_positions: Array = field(default_factory=lambda: np.zeros((0, 3)))
    soft_weights: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def empty(self) -> bool:
        """Nothing is constrained."""
        return len(self.hard_ids) + len(self.soft_ids) == 0

    def mapped(self, to_unit, order: Ints) -> Compiled:
        """In another frame and another vertex numbering.

        Parameters
        ----------
        to_unit : callable
            From the user's positions to the new frame.
        order : ndarray
            New index of every vertex.
        """
        return Compiled(
            order[self.hard_ids],
            to_unit(self.hard_positions),
            order[self.soft_ids],
            to_unit(self.soft_positions),
            self.soft_weights,
        )


def compile_constraints(constraints: Sequence[Constraint], mesh: Mesh) -> Compiled:
    """Check constraints against a mesh and gather them.

    Raises
    ------
    OptionError
        An index or a shape is wrong, or two hard constraints want different positions of
        one vertex; the message names both.
    """
    if isinstance(constraints, Fixed | FixedBoundary | Handle):
        constraints = [constraints]
    hard: list[tuple[Ints, Array, str]] = []
    out = Compiled()
    for number, c in enumerate(constraints):
        name = f"constraint {number} ({type(c).__name__})"
        if isinstance(c, FixedBoundary):
            ids = np.flatnonzero(mesh.half_edges.boundary_vertex)
            hard.append((ids, mesh.vertices[ids], name))
            continue
        if not isinstance(c, Fixed | Handle):
            raise OptionError(f"{name} is none of Fixed, FixedBoundary, Handle")
        ids = _ids(c.ids, len(mesh.vertices), name)
        if isinstance(c, Fixed):
            hard.append((ids, mesh.vertices[ids], name))
            continue
        positions = _positions(c.positions)
        if positions.shape != (len(ids), 3) or not np.isfinite(positions).all():
            raise OptionError(
                f"{name} needs {len(ids)} finite positions (k, 3), got {np.shape(c.positions)}"
            )
        if c.weight is None:
            hard.append((ids, positions, name))
            continue
        if not (isinstance(c.weight, int | float) and 0 < c.weight < np.inf):
            raise OptionError(f"{name} has weight {c.weight!r}; it must be a positive number")
        out.soft_ids = np.r_[out.soft_ids, ids]
        out.soft_positions = np.r_[out.soft_positions, positions]
        out.soft_weights = np.r_[out.soft_weights, np.full(len(ids), float(c.weight))]
    if hard:
        _merge(hard, out, mesh)
    return out


def _merge(hard: list[tuple[Ints, Array, str]], out: Compiled, mesh: Mesh) -> None:
    ids = np.concatenate([h[0] for h in hard])
    positions = np.concatenate([h[1] for h in hard])
    owner = np.concatenate([np.full(len(h[0]), k) for k, h in enumerate(hard)])
    order = np.argsort(ids, kind="stable")
    ids, positions, owner = ids[order], positions[order], owner[order]
    same = ids[1:] == ids[:-1]
    far = np.abs(positions[1:] - positions[:-1]).max(axis=1) > 1e-12 * mesh.diagonal
    clash = np.flatnonzero(same & far)
    if clash.size:
        at = clash[0]
        raise OptionError(
            f"{hard[owner[at]][2]} and {hard[owner[at + 1]][2]} want different positions of "
            f"vertex {ids[at]}; remove one or give it a weight"
        )
    keep = np.ones(len(ids), bool)
    keep[1:] = ~same
    out.hard_ids, out.hard_positions = ids[keep], positions[keep]


def _positions(given: ArrayLike) -> Array:
    try:
        return np.atleast_2d(np.asarray(given, dtype=np.float64))
    except (TypeError, ValueError):
        return np.zeros((0, 3))


def _ids(given: ArrayLike, count: int, name: str) -> Ints:
    ids = np.atleast_1d(np.asarray(given))
    if ids.dtype == bool:
        ids = np.flatnonzero(ids)
    if ids.ndim != 1 or (ids.size and ids.dtype.kind not in "iu"):
        raise OptionError(f"{name} needs a list of vertex indices")
    ids = ids.astype(np.int64)
    bad = ids[(ids < 0) | (ids >= count)]
    if bad.size:
        raise OptionError(f"{name} names vertex {bad[0]}; the mesh has {count}")
    return ids

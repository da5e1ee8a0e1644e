"""The base class of all constraints, and the checks that they share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import OptionError
from gso.mesh import Mesh
from gso.spelling import KnownFields
from gso.typing import Array, Ints

if TYPE_CHECKING:
    from gso.constraints.equations import Part


class Constraint(KnownFields):
    """A condition on the result; subclasses give its equations in :meth:`parts`."""

    def parts(self, subject: Subject) -> list[Part]:
        """Return the equations on a mesh; raise `OptionError` if the constraint is invalid."""
        raise NotImplementedError


@dataclass(frozen=True)
class Subject:
    """The mesh that a constraint applies to, with the checks that all kinds need.

    Attributes
    ----------
    mesh : Mesh
        The design, in the user's frame and numbering.
    flat : bool
        Whether positions are those of the flat image (2D), which does not exist yet.
    number : int
        Place of the constraint in the user's list.
    name : str
        Name of the constraint in messages.
    """

    mesh: Mesh
    flat: bool
    number: int
    name: str

    @property
    def dim(self) -> int:
        """Number of components of a position."""
        return 2 if self.flat else 3

    def refuse(self, why: str) -> OptionError:
        """Return an error about this constraint."""
        return OptionError(f"{self.name} {why}")

    def in_space(self, instead: str) -> None:
        """Refuse a constraint on positions of the design if the result is a flat image."""
        if self.flat:
            raise self.refuse(
                f"refers to positions of the design, not of its flat image; {instead}"
            )

    def ids(self, given: ArrayLike) -> Ints:
        """Vertex indices (k,), from a list or a mask."""
        return self._chosen(given, self.count, "vertex", "vertices")

    def pairs(self, given: ArrayLike, what: str) -> Ints:
        """Pairs of vertex indices (k, 2)."""
        return self._indices(
            _array(given), 2, f"{what} as pairs of vertex indices (k, 2)", self.count, "vertex"
        )

    def faces(self, given: ArrayLike) -> Ints:
        """Face indices (k,), from a list or a mask."""
        return self._chosen(given, len(self.mesh.faces), "face", "faces")

    def _chosen(self, given: ArrayLike, count: int, kind: str, several: str) -> Ints:
        ids = np.atleast_1d(_array(given))
        if ids.dtype == bool:
            if ids.shape != (count,):
                raise self.refuse(
                    f"has a mask of shape {ids.shape}; the mesh has {count} {several}"
                )
            ids = np.flatnonzero(ids)
        return self._indices(ids, 1, f"a list of {kind} indices", count, kind)

    @property
    def count(self) -> int:
        """Number of vertices."""
        return len(self.mesh.vertices)

    def _indices(self, ids: np.ndarray, ndim: int, what: str, count: int, kind: str) -> Ints:
        if ids.size == 0:
            return np.zeros((0, 2)[:ndim], np.int64)
        if ids.ndim != ndim or (ndim == 2 and ids.shape[1] != 2) or ids.dtype.kind not in "iu":
            raise self.refuse(f"needs {what}")
        index: Ints = ids.astype(np.int64)
        bad = index[(index < 0) | (index >= count)]
        if bad.size:
            raise self.refuse(f"names {kind} {bad[0]}; the mesh has {count}")
        return index

    def points(self, given: ArrayLike, what: str, count: int | None = None) -> Array:
        """Finite positions (count, dim)."""
        points = np.atleast_2d(numbers(given))
        wanted = len(points) if count is None else count
        if points.shape == (wanted, self.dim):
            wrong = np.flatnonzero(~np.isfinite(points).all(axis=1))
            if wrong.size:
                raise self.refuse(f"needs {what} as finite numbers; row {wrong[0]} is not")
        else:
            number = "k" if count is None else count
            got = np.shape(_array(given))
            raise self.refuse(f"needs {what} as finite numbers ({number}, {self.dim}), got {got}")
        return points

    def vector(self, given: ArrayLike, what: str) -> Array:
        """A finite vector (dim,)."""
        vector = numbers(given)
        if vector.shape != (self.dim,) or not np.isfinite(vector).all():
            raise self.refuse(f"needs {what} with {self.dim} finite components, got {given!r}")
        return vector

    def weight(self, given: float | None) -> float | None:
        """Weight of a soft constraint, None for a hard one."""
        if given is None:
            return None
        return self.positive(given, "weight")

    def positive(self, given: object, what: str) -> float:
        """A finite number above zero."""
        if isinstance(given, int | float | np.integer | np.floating) and type(given) is not bool:
            number = float(given)
            if 0 < number < np.inf:
                return number
        raise self.refuse(f"has {what} {given!r}; it must be a positive number")


def _array(given: ArrayLike) -> np.ndarray:
    """Return the argument as an array; an array of one zero if it is ragged."""
    try:
        return np.asarray(given)
    except ValueError:
        return np.zeros(1)


def numbers(given: ArrayLike) -> Array:
    """Return the argument as an array of numbers; one NaN if it is not numeric."""
    try:
        return np.array(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return np.full((1, 1), np.nan)

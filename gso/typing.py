"""Types that annotations name; shapes of arrays are in the docstrings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from types import EllipsisType

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

#: What solves a linear system for one or more right-hand sides.
Solve = Callable[[Array], Array]

#: Path of a file or folder.
AnyPath = str | PathLike[str]

#: Content of a JSON object.
Json = dict[str, Any]

#: Keyword arguments that are passed on.
Keywords = dict[str, Any]


class Polyhedron(Protocol):
    """A surface with vertices and faces: :class:`gso.Mesh`, ``trimesh.Trimesh``."""

    @property
    def vertices(self) -> ArrayLike:
        """Coordinates, (n, 3)."""

    @property
    def faces(self) -> ArrayLike:
        """Vertices of each face."""


class PointSet(Protocol):
    """A mesh of PyVista (``faces``) or meshio (``cells``)."""

    @property
    def points(self) -> ArrayLike:
        """Coordinates, (n, 3)."""


class CompasMesh(Protocol):
    """A mesh of COMPAS."""

    def to_vertices_and_faces(self) -> Any:
        """Return coordinates and the vertices of each face."""


@dataclass(frozen=True)
class Unwelded:
    """Input of :func:`gso.as_mesh` together with how it is read.

    Attributes
    ----------
    surface : MeshLike
        Anything that it takes.
    weld : float or None
        Vertices within this distance of each other are merged.
    chord : float or None
        Chord tolerance of a CAD file, in millimetres.
    """

    surface: MeshLike
    weld: float | None = None
    chord: float | None = None


#: What :func:`gso.as_mesh` takes: a mesh, a grid of points, vertices and faces, or a file.
MeshLike: TypeAlias = (
    "Polyhedron | PointSet | CompasMesh | Unwelded | ArrayLike | "
    "tuple[ArrayLike, ArrayLike | Sequence[Sequence[int]]] | AnyPath"
)


class Scalar(Protocol):
    """What geometry and energy compute with: a number, an array, a tensor, a CasADi symbol."""

    def __neg__(self: S) -> S: ...
    def __add__(self: S, other: S | float, /) -> S: ...
    def __radd__(self: S, other: float, /) -> S: ...
    def __sub__(self: S, other: S | float, /) -> S: ...
    def __rsub__(self: S, other: float, /) -> S: ...
    def __mul__(self: S, other: S | float, /) -> S: ...
    def __rmul__(self: S, other: float, /) -> S: ...
    def __truediv__(self: S, other: S | float, /) -> S: ...
    def __rtruediv__(self: S, other: float, /) -> S: ...


S = TypeVar("S", bound=Scalar)

#: A vector: its components.
Vec = tuple[S, ...]


class Batch(Scalar, Protocol):
    """A NumPy array or a torch tensor."""

    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def dtype(self) -> object: ...
    def __pow__(self: B, other: float, /) -> B: ...
    def __gt__(self: B, other: B | float, /) -> object: ...
    def __getitem__(
        self: B, key: slice | EllipsisType | tuple[slice | EllipsisType, ...] | None, /
    ) -> B: ...
    def reshape(self: B, first: int, /, *others: int) -> B: ...
    def sum(self: B, axis: int, /) -> B: ...
    def mean(self: B, axis: int, /) -> B: ...
    def clip(self: B, low: float, high: float, /) -> B: ...


B = TypeVar("B", bound=Batch)


class Number(Scalar, Protocol):
    """A number, or a tensor of them."""

    def __abs__(self: N) -> N: ...
    def __pow__(self: N, other: float, /) -> N: ...
    def __ge__(self: N, other: N | float, /) -> object: ...
    def __gt__(self: N, other: N | float, /) -> object: ...
    def __le__(self: N, other: N | float, /) -> object: ...
    def __lt__(self: N, other: N | float, /) -> object: ...


N = TypeVar("N", bound=Number)

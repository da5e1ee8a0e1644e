"""A surface cut into pieces, and how they are joined."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from gso.components import Component, split
from gso.errors import MeshError
from gso.mesh import Cut, Mesh
from gso.typing import Array, Ints


@dataclass(frozen=True)
class Piece:
    """One piece of a surface.

    Attributes
    ----------
    name : str
    mesh : Mesh
    vertices, faces : ndarray of int
        For each of its vertices and faces, that of the whole surface.
    """

    name: str
    mesh: Mesh
    vertices: Ints
    faces: Ints

    @property
    def handles(self) -> int:
        """Number of handles."""
        return (2 - len(self.mesh.boundary_loops) - self.mesh.euler_characteristic) // 2

    @property
    def holes(self) -> int:
        """Number of boundary loops but one; -1 if it is closed."""
        return len(self.mesh.boundary_loops) - 1

    @property
    def is_disk(self) -> bool:
        """Whether it has one boundary loop and no handles, so that it can be laid flat."""
        return self.handles == 0 and self.holes == 0


@dataclass(frozen=True, eq=False)
class Pieces:
    """A surface cut along seams; :func:`gso.cut` makes it.

    A seam between two pieces joins their boundaries. A seam within a piece is a dart, or opens a
    ring or a handle.

    Attributes
    ----------
    design : Mesh
        The whole surface, with vertices inserted on seams where they are needed.
    opened : Cut
        It cut open: one mesh with a copy of a vertex for each piece, or side of a dart, at it.
    names : tuple of str
        Names of the pieces, largest first.
    """

    design: Mesh
    opened: Cut
    names: tuple[str, ...] = ()

    @cached_property
    def parts(self) -> list[Component]:
        """The connected parts of the mesh that is cut open, the largest first.

        Those with the same area, but for rounding, keep the order of their vertices.
        """
        return sorted(split(self.opened.mesh), key=lambda part: -float(f"{part.area:.9g}"))

    def __len__(self) -> int:
        return len(self.parts)

    def __iter__(self) -> Iterator[Piece]:
        return (self[k] for k in range(len(self)))

    def __getitem__(self, number: int) -> Piece:
        part = self.parts[number]
        said = self.design.attributes
        mesh = part.mesh
        if said is not None:
            mesh = Mesh(mesh.vertices, mesh.faces, attributes=said.taken(part.faces))
        return Piece(self.name(number), mesh, self.opened.vertex[part.vertices], part.faces)

    def name(self, number: int) -> str:
        """Return the name of a piece; a letter for those without."""
        if number < len(self.names):
            return self.names[number]
        letters = ""
        k = number + 1
        while k:
            k, digit = divmod(k - 1, 26)
            letters = chr(65 + digit) + letters
        return letters

    @cached_property
    def of_face(self) -> Ints:
        """Number of the piece of each face (m,)."""
        out = np.empty(len(self.design.faces), np.int64)
        for k, part in enumerate(self.parts):
            out[part.faces] = k
        return out

    @cached_property
    def of_vertex(self) -> Ints:
        """Number of the piece of each vertex (p,) of the mesh that is cut open; -1 for none."""
        out = np.full(len(self.opened.vertex), -1)
        for k, part in enumerate(self.parts):
            out[part.vertices] = k
        return out

    @property
    def edges(self) -> Ints:
        """The edges of the design (s, 2) that were cut."""
        return self.opened.vertex[self.opened.seams[:, 0]]

    @cached_property
    def sides(self) -> Ints:
        """The pieces (s, 2) on both sides of each cut edge; the same piece twice for darts."""
        return self.of_vertex[self.opened.seams[:, :, 0]]

    @property
    def lengths(self) -> Array:
        """Lengths (s,) of the cut edges."""
        a, b = self.design.vertices[self.edges].transpose(1, 0, 2)
        return np.asarray(np.linalg.norm(b - a, axis=1))

    @property
    def seam_length(self) -> float:
        """Length of all seams together, relative to the root of the area."""
        area = sum(part.area for part in self.parts)
        return float(self.lengths.sum() / np.sqrt(area))

    def seams(self) -> dict[tuple[int, int], float]:
        """Return the length of the seam between each pair of pieces, the smaller number first."""
        pairs, which = np.unique(np.sort(self.sides, axis=1), axis=0, return_inverse=True)
        total = np.bincount(which.ravel(), self.lengths, len(pairs)).tolist()
        return {(a, b): total[k] for k, (a, b) in enumerate(pairs.tolist())}

    def sewn(self, pieces: Sequence[ArrayLike] | None = None) -> Mesh:
        """Join the pieces again along all seams.

        Parameters
        ----------
        pieces : sequence of array_like, (n_k, 3), optional
            Positions of the vertices of each piece; those of the design when not given. Copies
            of a vertex are joined at their mean.

        Returns
        -------
        Mesh
            The design's faces and numbering.

        Raises
        ------
        MeshError
            The positions do not fit the pieces.
        """
        if pieces is None:
            return self.design
        wanted = [(len(part.vertices), 3) for part in self.parts]
        points = [np.asarray(x, float) for x in pieces]
        if [x.shape for x in points] != wanted:
            raise MeshError(
                f"the positions have shapes {[x.shape for x in points]}; the pieces need {wanted}"
            )
        every = np.empty((len(self.opened.vertex), 3))
        for part, x in zip(self.parts, points, strict=True):
            every[part.vertices] = x
        count = len(self.design.vertices)
        used = self.opened.mesh.used
        vertex = self.opened.vertex[used]
        number = np.bincount(vertex, minlength=count)
        out = self.design.vertices.copy()
        for d in range(3):
            total = np.bincount(vertex, every[used, d], count)
            out[number > 0, d] = (total / np.maximum(number, 1))[number > 0]
        return self.design.replaced(out)

    def __repr__(self) -> str:
        disks = sum(piece.is_disk for piece in self)
        return f"Pieces({len(self)} pieces, {disks} of them disks, seam {self.seam_length:.3g})"

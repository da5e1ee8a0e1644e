"""Unchecked surfaces as readers return them, and merging (welding) of their vertices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import MeshError
from gso.geometry.polygon import reflex_corners
from gso.mesh import Mesh
from gso.mesh.attributes import Attributes
from gso.mesh.topology import are_quads
from gso.mesh.validation import FaceError, checked_table, checked_vertices
from gso.mesh.welding import collapse, equal, near
from gso.quantities import as_positive
from gso.typing import Array, Ints


@dataclass(frozen=True)
class Surface:
    """Vertices and faces that have not been checked.

    Attributes
    ----------
    vertices, faces : ndarray
        As :class:`gso.Mesh` takes them; `faces` None with a grid (H, W, 3) as vertices.
    notes : tuple of str
        What was changed or left out.
    attributes : Attributes, optional
        Names and texture coordinates of the faces.
    polygon : ndarray of int, (m,), optional
        Number of each face in the file, where some were cut into triangles or left out.
    """

    vertices: ArrayLike
    faces: ArrayLike | None
    notes: tuple[str, ...] = ()
    attributes: Attributes | None = None
    polygon: Ints | None = None

    def mesh(self, weld: float | None = None) -> Mesh:
        """Make a mesh, after merging vertices within the distance `weld` if it is given."""
        if self.faces is None:
            grid = Mesh.from_grid(self.vertices)
            return grid if weld is None else welded(grid, weld)
        if weld is not None:
            return self.welded(weld).mesh()
        mesh = self._made(self.faces)
        if mesh.is_triangles or mesh.grid_index is not None:
            return mesh
        return self._convex(mesh, checked_table(self.faces, len(mesh.vertices)))

    def welded(self, weld: float) -> Surface:
        """Merge vertices within a distance, as :func:`welded` does; a grid stays as it is."""
        if self.faces is None:
            return self
        return _welded(self, self.faces, checked(weld))

    def _made(self, faces: ArrayLike) -> Mesh:
        try:
            return Mesh(self.vertices, faces, notes=self.notes, attributes=self.attributes)
        except FaceError as error:
            raise self._named(error) from None

    def _convex(self, mesh: Mesh, table: Ints) -> Mesh:
        """Cut the quads that are not convex into two triangles each, with a note.

        `mesh` has the faces of the `table`.
        """
        quad = np.flatnonzero(are_quads(table))
        corner = np.full(len(table), -1)
        corner[quad] = reflex_corners(mesh.vertices[table[quad]])
        concave = corner >= 0
        if not concave.any():
            return mesh
        face = np.repeat(np.arange(len(table)), 1 + concave)
        second = np.diff(face, prepend=-1) == 0
        turns = np.broadcast_to(np.arange(4), (len(face), 4)).copy()
        for half, corners in ((~second, [0, 1, 2]), (second, [0, 2, 3])):
            some = np.flatnonzero(concave[face] & half)
            turns[some, :3] = (corner[face[some], None] + corners) % 4
        turns[concave[face] | (table[face, 3] < 0), 3] = -1
        polygon = np.arange(len(table)) if self.polygon is None else self.polygon
        note = (
            f"{int(concave.sum())} quads are not convex and were cut into two triangles each "
            f"(the first is face {polygon[concave.argmax()]})"
        )
        faces = np.where(turns < 0, -1, np.take_along_axis(table[face], turns, axis=1))
        return Surface(
            mesh.vertices,
            faces,
            (*self.notes, note),
            None if self.attributes is None else self.attributes.taken(face, turns),
            polygon[face],
        )._made(faces)

    def _named(self, error: FaceError) -> MeshError:
        """Name the face of the file that an error is about."""
        if self.polygon is None:
            return error
        face = int(self.polygon[error.face])
        parts = int((self.polygon == face).sum())
        if parts > 1:
            return MeshError(f"face {face}: its triangle {error.what}")
        return FaceError(face, error.what)


def checked(weld: object) -> float:
    """Return a weld distance as a float after checking it.

    Raises
    ------
    OptionError
        `weld` is not a finite number of 0 or more.
    """
    return as_positive(weld, "weld", zero=True)


def welded(mesh: Mesh, weld: float) -> Mesh:
    """Merge the vertices of a mesh that lie within a distance of each other.

    Vertices keep their order; merged vertices take the position of the first of them. A quad
    that loses an edge becomes a triangle, and faces that lose more are left out. The notes
    say how many.

    Parameters
    ----------
    mesh : Mesh
    weld : float
        The distance, in the mesh's unit of length; 0 merges equal vertices.

    Raises
    ------
    OptionError
        `weld` is not a finite number of 0 or more.
    MeshError
        `weld` is so large that chains of vertices or all faces collapse, or the welded
        surface is rejected (see :class:`gso.Mesh`).

    Examples
    --------
    >>> corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> apart = Mesh([*corners, *np.add(corners, [1, 0, 0])], [[0, 1, 2, 3], [4, 5, 6, 7]])
    >>> welded(apart, 1e-6)
    Mesh(6 vertices, 2 faces, quads)
    """
    # Notes that the unwelded mesh computed about itself no longer hold; keep the given ones.
    surface = Surface(mesh.vertices, mesh.faces, mesh.given_notes, mesh.attributes)
    return surface.mesh(weld)


def _welded(surface: Surface, faces: ArrayLike, weld: float) -> Surface:
    points = checked_vertices(surface.vertices)
    table = checked_table(faces, len(points))
    if np.abs(points).max(initial=0.0) > 1e150:
        # Squared distances would overflow; the mesh constructor reports that.
        return surface
    corner = table >= 0
    used = np.unique(table[corner])
    target = np.arange(len(points))
    target[used] = used[near(points[used], weld, used)]
    kept = target == np.arange(len(points))
    if kept.all():
        note = f"weld={weld:.3g} merged nothing: no two vertices are that close"
        return Surface(points, table, (*surface.notes, note), surface.attributes, surface.polygon)
    done = collapse(table, target)
    if not len(done.faces):
        raise MeshError(f"weld={weld:.3g} leaves no face; give a length below that of the edges")
    new = np.cumsum(kept) - 1
    notes = [f"weld={weld:.3g} merged {int((~kept).sum())} of {len(points)} vertices with others"]
    triangles = int(((done.turns[:, 3:] < 0) & corner[done.kept, 3:]).sum())
    if triangles:
        notes.append(f"{triangles} quads lost an edge by that and are triangles now")
    lost = np.delete(np.arange(len(table)), done.kept)
    if lost.size:
        notes.append(
            f"{lost.size} faces collapsed and were left out (the first was face {lost[0]})"
        )
    said = surface.attributes
    return Surface(
        points[kept],
        np.where(done.faces < 0, -1, new[done.faces]),
        (*surface.notes, *notes),
        None if said is None else said.taken(done.kept, done.turns),
        None if surface.polygon is None else surface.polygon[done.kept],
    )


def merged(points: Array, triangles: Ints) -> tuple[Array, Ints, tuple[str, ...]]:
    """Merge vertices with equal coordinates and leave out triangles that collapse.

    For formats that store a separate vertex for each corner.
    """
    kept, index = np.unique(equal(points), return_inverse=True)
    done = collapse(triangles, index.ravel())
    lost = len(triangles) - len(done.kept)
    notes = (f"{lost} triangles with two equal corners were left out",) if lost else ()
    return points[kept], done.faces, notes

"""The mesh class of the package: vertices, faces, connectivity, and the grid where it is one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike

from gso import geometry
from gso.errors import MeshError
from gso.geometry.polygon import reflex_corners
from gso.mesh import topology
from gso.mesh.attributes import Attributes
from gso.mesh.validation import (
    JOINED,
    check_area,
    check_vertices,
    checked_faces,
    checked_grid,
    checked_vertices,
    reordered,
    unjoined,
    weld_poles,
    welding_advice,
)
from gso.mesh.welding import seams
from gso.short_repr import html_repr
from gso.typing import Array, Flags, Ints


@dataclass(frozen=True)
class Frame:
    """Similarity transform between the unit ball and the user's coordinates.

    ``user = centre + scale * internal``: internally a mesh has its centroid at the origin and
    its farthest vertex at distance 1.
    """

    centre: Array
    scale: float

    def to_unit(self, points: Array) -> Array:
        """Transform points from the user's coordinates to the unit ball."""
        return (points - self.centre) / self.scale

    def to_user(self, points: Array) -> Array:
        """Transform points from the unit ball to the user's coordinates."""
        return self.centre + self.scale * points


class Mesh:
    """A surface mesh of quads, triangles or both, checked on construction.

    Parameters
    ----------
    vertices : array_like, (n, 3)
        Coordinates in any unit of length.
    faces : array_like of int, (m, 3) or (m, 4)
        Vertex indices in cyclic order. In a mixed mesh the rows have four columns and a
        triangle ends in -1.
    notes : sequence of str
        Messages for the user about changes that were made before construction.
    attributes : Attributes, optional
        Labels and texture coordinates of these faces.
    touching : bool
        Whether components are meant to touch each other without being joined.

    Attributes
    ----------
    vertices, faces : ndarray
        Read-only arrays; faces are consistently oriented.
    grid_index : ndarray of int, (H, W), or None
        Vertex ids by row and column when the mesh is a grid, in any numbering.
    notes : tuple of str
        What was repaired or found: reversed faces, welded poles, unused vertices, several
        components, coincident edges that are not joined.
    attributes : Attributes or None
        Labels and texture coordinates from a file, to be written again with the faces.

    Raises
    ------
    MeshError
        Non-finite coordinates, faces out of range, repeated vertices in a face,
        duplicate faces, edges with three faces, non-orientable surfaces, non-manifold
        vertices, faces without area. The message names the face, edge or vertex.

    Examples
    --------
    >>> mesh = Mesh.from_grid(np.random.default_rng(0).random((4, 5, 3)))
    >>> mesh.faces.shape, mesh.grid.shape
    ((12, 4), (4, 5, 3))
    """

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        *,
        notes: tuple[str, ...] = (),
        attributes: Attributes | None = None,
        touching: bool = False,
    ):
        points = checked_vertices(vertices)
        table, flipped, said = checked_faces(faces, points)
        self.vertices: Array = points
        self.faces: Ints = table
        check_vertices(self.half_edges, points)
        self.given_notes: tuple[str, ...] = tuple(notes)
        self.notes: tuple[str, ...] = self.given_notes
        if not touching:
            self.notes += unjoined(self)
        self.notes += said
        self.attributes = None if attributes is None else reordered(attributes, table, flipped)
        self.vertices.flags.writeable = False
        self.faces.flags.writeable = False

    @classmethod
    def from_grid(cls, points: ArrayLike, *, weld: bool = True) -> Mesh:
        """Make the mesh of a grid of points (H, W, 3), at least 3 x 3.

        A side that is collapsed to one point (a pole) is welded: the result is then a general
        mesh with triangles at the pole, and `notes` says so. With ``weld=False`` it stays
        a grid.
        """
        grid = checked_grid(points)
        template = _grid_template(*grid.shape[:2])
        welded = weld_poles(grid, template.faces) if weld else None
        if welded is not None:
            return cls(welded[0], welded[1], notes=welded[2])
        points = grid.reshape(-1, 3)
        check_area(template.faces, points)
        return template.replaced(points)

    def replaced(self, vertices: Array, *, notes: tuple[str, ...] = ()) -> Mesh:
        """Copy the mesh with other vertices (n, 3); the connectivity is shared, not rechecked."""
        points = checked_vertices(vertices)
        if points.shape != self.vertices.shape:
            raise MeshError(f"{points.shape[0]} vertices given for {len(self.vertices)}")
        points.flags.writeable = False
        other = Mesh.__new__(Mesh)
        other.__dict__.update(
            {k: v for k, v in self.__dict__.items() if k in _CONNECTIVITY},
            vertices=points,
            attributes=self.attributes,
            given_notes=self.given_notes,
            notes=self.notes + tuple(notes),
        )
        return other

    _repr_html_ = html_repr

    def __repr__(self) -> str:
        if self.grid_shape:
            kind = f"grid {self.grid_shape[0]} x {self.grid_shape[1]}"
        elif self.is_triangles:
            kind = "triangles"
        else:
            kind = "quads and triangles" if (self.faces < 0).any() else "quads"
        return f"Mesh({len(self.vertices)} vertices, {len(self.faces)} faces, {kind})"

    @cached_property
    def half_edges(self) -> topology.HalfEdges:
        """Half-edges of the faces."""
        return topology.half_edges(self.faces, len(self.vertices))

    @cached_property
    def grid_index(self) -> Ints | None:
        """Vertex ids by row and column, (H, W), or None."""
        return topology.recognise_grid(self.half_edges, self.faces)

    @cached_property
    def triangles(self) -> Ints:
        """Triangulation (t, 3); quads are split as by :func:`gso.mesh.topology.quad_splits`."""
        if self.grid_index is not None:
            ids = self.grid_index.ravel()
            quads = ids[topology.grid_faces(*self.grid_index.shape)]
            return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        return topology.triangulate(self.faces, self.quad_splits)

    @cached_property
    def quad_splits(self) -> Flags:
        """Mask (m,) of the quads whose triangles meet at the diagonal 1-3 instead of 0-2."""
        if self.grid_index is not None:
            return np.zeros(len(self.faces), bool)
        inwards = np.full(len(self.faces), -1)
        quad = topology.are_quads(self.faces)
        if quad.any():
            inwards[quad] = reflex_corners(self.vertices[self.faces[quad]])
        return topology.quad_splits(self.faces, self.half_edges, inwards)

    @cached_property
    def triangle_edges(self) -> topology.HalfEdges:
        """Half-edges of the triangulation."""
        return topology.half_edges(self.triangles, len(self.vertices))

    @cached_property
    def face_stars(self) -> topology.Stars:
        """Interior vertices and the corners of the faces around them, by the number of faces."""
        return topology.face_stars(self.half_edges)

    @cached_property
    def stars_by_triangulation(self) -> tuple[topology.Stars, ...]:
        """Vertex stars of both triangulations of the quads, grouped by ring length.

        First the mesh's own triangulation, then that along the other diagonals (see
        :func:`gso.mesh.topology.vertex_stars`). A mesh of triangles has one.
        """
        if self.grid_index is not None:
            return tuple(topology.grid_stars(self.grid_index, r) for r in geometry.GRID_RINGS)
        own, other = topology.vertex_stars(self.faces, self.half_edges, self.quad_splits)
        return (own,) if self.is_triangles else (own, other)

    @property
    def stars(self) -> topology.Stars:
        """Interior vertices and their rings in the mesh's own triangulation, by ring length."""
        return self.stars_by_triangulation[0]

    @cached_property
    def edges(self) -> Ints:
        """Edges of the faces, each once, (e, 2)."""
        return topology.edges(self.half_edges)

    @property
    def edge_lengths(self) -> Array:
        """Length of each of :attr:`edges`, (e,)."""
        a, b = self.edges.T
        return np.asarray(np.linalg.norm(self.vertices[a] - self.vertices[b], axis=1))

    def edge_numbers(self, a: Ints, b: Ints) -> Ints:
        """Return the rows of :attr:`edges` that join vertices a and b, in either direction."""
        ends, count = self.edges, len(self.vertices)
        keys = topology.pair_keys(ends, count)
        order = np.argsort(keys)
        return order[np.searchsorted(keys[order], topology.edge_keys(a, b, count))]

    @cached_property
    def boundary_edges(self) -> Flags:
        """Mask over :attr:`edges`: boundary edges."""
        return topology.boundary_edges(self.half_edges)

    @cached_property
    def boundary_loops(self) -> list[Ints]:
        """Vertex ids of each boundary loop, longest first."""
        return topology.boundary_loops(self.half_edges)

    @cached_property
    def components(self) -> Ints:
        """Component number of each vertex, (n,)."""
        if self.grid_index is not None:
            return np.zeros(len(self.vertices), np.int64)
        return topology.label_components(len(self.vertices), *self.edges.T)

    def restricted(self, ids: Ints) -> tuple[Mesh, Ints]:
        """Return the mesh of whole components, given by their vertices, ascending.

        Also return the new number of each vertex, (n,); -1 for those of other components.
        """
        new = np.full(len(self.vertices), -1)
        new[ids] = np.arange(len(ids))
        faces = self.faces[new[self.faces[:, 0]] >= 0]
        return Mesh(self.vertices[ids], np.where(faces < 0, -1, new[faces])), new

    @property
    def seams(self) -> Flags:
        """Mask over half-edges: boundary edges that coincide with another boundary edge."""
        he = self.half_edges
        mask = he.twin < 0
        # Files have rounded coordinates, so vertices coincide up to a tolerance.
        step = JOINED * np.ptp(self.vertices[self.used], axis=0).max()
        origin, dest = he.origin[mask], he.dest[mask]
        mask[mask] = seams(np.round((self.vertices - self.frame.centre) / step), origin, dest)
        return mask

    def check_joined(self) -> None:
        """Refuse a polygon soup: faces that touch but share no vertices.

        Raises
        ------
        MeshError
            At least two components touch others, and their number is at least 0.4 of that of
            the faces.
        """
        if not self.components.any():
            return
        touching = np.unique(self.components[self.half_edges.origin[self.seams]]).size
        if touching >= max(2, _HEAP * len(self.faces)):
            raise MeshError(
                f"the {len(self.faces)} faces are {touching} separate pieces that touch: each "
                f"has vertices of its own. {welding_advice(self)}"
            )

    @property
    def euler_characteristic(self) -> int:
        """Number of vertices - edges + faces; unused vertices are not counted."""
        return int(self.used.sum()) - len(self.edges) + len(self.faces)

    @property
    def has_triangles(self) -> bool:
        """Whether some faces are triangles."""
        return self.is_triangles or bool((self.faces < 0).any())

    @property
    def is_triangles(self) -> bool:
        """Whether all faces are triangles."""
        return int(self.faces.shape[1]) == 3

    @property
    def grid_shape(self) -> tuple[int, int] | None:
        """(H, W) of a grid, otherwise None."""
        if self.grid_index is None:
            return None
        return int(self.grid_index.shape[0]), int(self.grid_index.shape[1])

    @property
    def grid(self) -> Array | None:
        """The vertices as (H, W, 3) when the mesh is a grid, otherwise None."""
        return None if self.grid_index is None else self.vertices.take(self.grid_index, axis=0)

    @property
    def diagonal(self) -> float:
        """Length of the bounding box's diagonal; unused vertices are not counted."""
        return geometry.box_diagonal(self.vertices[self.used])

    @property
    def size(self) -> float:
        """Twice the distance of the farthest vertex from the centroid.

        For a rectangle it is the diagonal. Unlike the bounding box it does not change when the
        surface is turned.
        """
        return 2.0 * self.frame.scale

    @cached_property
    def frame(self) -> Frame:
        """Transform from the unit ball: the centroid, and the largest distance from it.

        Unused vertices are not counted.
        """
        return Frame(*geometry.ball(self.vertices[self.used]))

    @cached_property
    def used(self) -> Flags:
        """Mask over vertices: those that belong to a face."""
        return self.half_edges.face_count > 0


@lru_cache(maxsize=32)
def _grid_template(height: int, width: int) -> Mesh:
    """Build a flat grid with precomputed connectivity, shared by all grids of this size."""
    rows, columns = np.mgrid[:height, :width]
    flat = np.stack([rows, columns, np.zeros_like(rows)], axis=-1).reshape(-1, 3)
    faces = topology.grid_faces(height, width)
    # These faces need no checks.
    mesh = Mesh.__new__(Mesh)
    mesh.__dict__.update(
        vertices=flat.astype(np.float64),
        faces=faces,
        given_notes=(),
        notes=(),
        attributes=None,
        grid_index=np.arange(height * width).reshape(height, width),
    )
    for array in (mesh.vertices, faces):
        array.flags.writeable = False
    for name in _CONNECTIVITY:
        if name != "triangle_edges" or len(faces) <= _SMALL_GRID:
            getattr(mesh, name)
    if len(faces) > _SMALL_GRID:
        # The largest ones, which a solve does not need.
        del mesh.__dict__["half_edges"]
    return mesh


#: Cached attributes that meshes of the same faces share.
_CONNECTIVITY = (
    "faces",
    "half_edges",
    "grid_index",
    "triangles",
    "triangle_edges",
    "stars_by_triangulation",
    "edges",
    "boundary_edges",
    "boundary_loops",
    "components",
    "used",
)
#: Faces of a grid up to which half-edges are kept for other grids.
_SMALL_GRID = 100_000
#: Number of touching components per face from which on a mesh counts as a polygon soup.
_HEAP = 0.4

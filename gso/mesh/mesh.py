"""The mesh class of the package: vertices, faces, connectivity, and the grid where it is one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gso import geometry
from gso.errors import MeshError
from gso.mesh import topology
from gso.mesh.attributes import Attributes
from gso.mesh.welding import collapse, seams
from gso.typing import Array, Ints


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
    ):
        points = _checked_vertices(vertices)
        table, flipped, said = _checked_faces(faces, points)
        self.vertices: Array = points
        self.faces: Ints = table
        topology.check_vertices(self.half_edges)
        self.given_notes: tuple[str, ...] = tuple(notes)
        self.notes: tuple[str, ...] = self.given_notes + _unjoined(self) + said
        self.attributes = None if attributes is None else _turned(attributes, table, flipped)
        self.vertices.flags.writeable = False
        self.faces.flags.writeable = False

    @classmethod
    def from_grid(cls, points: ArrayLike, *, weld: bool = True) -> Mesh:
        """Make the mesh of a grid of points (H, W, 3), at least 3 x 3.

        A side that is collapsed to one point (a pole) is welded: the result is then a general
        mesh with triangles at the pole, and `notes` says so. With ``weld=False`` it stays
        a grid.
        """
        grid = _numbers(points, "a grid is an array of numbers (H, W, 3)")
        if grid.ndim != 3 or grid.shape[2] != 3:
            raise MeshError(f"a grid is an array (H, W, 3), not {grid.shape}")
        height, width = grid.shape[:2]
        if height < 3 or width < 3:
            raise MeshError(
                f"a grid of {height} x {width} points has no interior vertex; give at least 3 x 3"
            )
        if not np.isfinite(grid).all():
            i, j = np.argwhere(~np.isfinite(grid))[0][:2]
            raise MeshError(f"the coordinates of grid vertex ({i}, {j}) are not finite")
        template = _grid_template(height, width)
        welded = _weld_poles(grid, template.faces) if weld else None
        if welded is not None:
            return cls(welded[0], welded[1], notes=welded[2])
        points = grid.reshape(-1, 3)
        _check_area(template.faces, points)
        return template.replaced(points)

    def replaced(self, vertices: Array, *, notes: tuple[str, ...] = ()) -> Mesh:
        """Copy the mesh with other vertices (n, 3); the connectivity is shared, not rechecked."""
        points = _checked_vertices(vertices)
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
        return topology.triangulate(self.faces, self._quad_splits)

    @cached_property
    def _quad_splits(self) -> NDArray[np.bool_]:
        return topology.quad_splits(self.faces, self.half_edges)

    @cached_property
    def triangle_edges(self) -> topology.HalfEdges:
        """Half-edges of the triangulation."""
        return topology.half_edges(self.triangles, len(self.vertices))

    @cached_property
    def splits(self) -> tuple[topology.Stars, ...]:
        """Vertex stars of both triangulations of the quads, grouped by ring length.

        First the mesh's own triangulation, then that along the other diagonals (see
        :func:`gso.mesh.topology.vertex_stars`). A mesh of triangles has one.
        """
        if self.grid_index is not None:
            return tuple(topology.grid_stars(self.grid_index, r) for r in geometry.GRID_RINGS)
        own, other = topology.vertex_stars(self.faces, self.half_edges, self._quad_splits)
        return (own,) if self.is_triangles else (own, other)

    @property
    def stars(self) -> topology.Stars:
        """Interior vertices and their rings in the mesh's own triangulation, by ring length."""
        return self.splits[0]

    @cached_property
    def edges(self) -> Ints:
        """Edges of the faces, each once, (e, 2)."""
        return topology.edges(self.half_edges)

    @cached_property
    def rim(self) -> NDArray[np.bool_]:
        """Mask over :attr:`edges`: boundary edges."""
        return topology.rim(self.half_edges)

    @cached_property
    def boundary_loops(self) -> list[Ints]:
        """Vertex ids of each boundary loop, longest first."""
        return topology.boundary_loops(self.half_edges)

    @cached_property
    def components(self) -> Ints:
        """Component number of each vertex, (n,)."""
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components

        n = len(self.vertices)
        e = self.edges
        links = coo_matrix((np.ones(len(e)), (e[:, 0], e[:, 1])), shape=(n, n))
        return connected_components(links, directed=False)[1].astype(np.int64)

    @property
    def seams(self) -> NDArray[np.bool_]:
        """Mask over half-edges: boundary edges that coincide with another boundary edge."""
        he = self.half_edges
        mask = he.twin < 0
        # Files have rounded coordinates, so vertices coincide up to a tolerance.
        step = _JOINED * np.ptp(self.vertices[self.used], axis=0).max()
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
        touching = np.unique(self.components[self.half_edges.origin[self.seams]]).size
        if touching >= max(2, _HEAP * len(self.faces)):
            raise MeshError(
                f"the {len(self.faces)} faces are {touching} separate pieces that touch: each "
                f"has vertices of its own. {_advice(self)}"
            )

    @property
    def euler_characteristic(self) -> int:
        """Number of vertices - edges + faces; unused vertices are not counted."""
        return int(self.used.sum()) - len(self.edges) + len(self.faces)

    @property
    def is_disk(self) -> bool:
        """Whether it is one component of genus zero with one boundary loop."""
        return (
            len(self.boundary_loops) == 1
            and self.euler_characteristic == 1
            and np.unique(self.components[self.used]).size == 1
        )

    @property
    def has_triangles(self) -> bool:
        """Whether some faces are triangles."""
        return self.is_triangles or bool((self.faces < 0).any())

    @property
    def is_triangles(self) -> bool:
        """Whether all faces are triangles."""
        return self.faces.shape[1] == 3

    @property
    def grid_shape(self) -> tuple[int, int] | None:
        """(H, W) of a grid, otherwise None."""
        if self.grid_index is None:
            return None
        return int(self.grid_index.shape[0]), int(self.grid_index.shape[1])

    @property
    def grid(self) -> Array | None:
        """The vertices as (H, W, 3) when the mesh is a grid, otherwise None."""
        return None if self.grid_index is None else self.vertices[self.grid_index]

    @property
    def diagonal(self) -> float:
        """Length of the bounding box's diagonal; unused vertices are not counted."""
        return geometry.box_diagonal(self.vertices[self.used])

    @cached_property
    def frame(self) -> Frame:
        """Transform from the unit ball: the centroid, and the largest distance from it.

        Unused vertices are not counted.
        """
        return Frame(*geometry.ball(self.vertices[self.used]))

    @property
    def used(self) -> NDArray[np.bool_]:
        """Mask over vertices: those that belong to a face."""
        return self.half_edges.face_count > 0


@lru_cache(maxsize=32)
def _grid_template(height: int, width: int) -> Mesh:
    """Build a flat grid with precomputed connectivity, shared by all grids of this size."""
    rows, columns = np.mgrid[:height, :width]
    flat = np.stack([rows, columns, np.zeros_like(rows)], axis=-1).reshape(-1, 3)
    mesh = Mesh(flat, topology.grid_faces(height, width))
    mesh.__dict__["grid_index"] = np.arange(height * width).reshape(height, width)
    for name in _CONNECTIVITY:
        getattr(mesh, name)
    return mesh


#: Tolerance for coincident vertices, relative to the longest side of the bounding box.
_JOINED = 1e-7
#: Number of touching components per face from which on a mesh counts as a polygon soup.
_HEAP = 0.4


def _unjoined(mesh: Mesh) -> tuple[str, ...]:
    """Write the note on coincident edges that are not joined; empty where there are none."""
    count = int(mesh.seams.sum())
    if not count:
        return ()
    return (f"{count} edges lie on others without being joined to them. {_advice(mesh)}",)


def _advice(mesh: Mesh) -> str:
    least = 10 * _JOINED * mesh.diagonal
    return f"Merge their vertices with weld={least:.1g} of gso.load, --weld {least:.1g} of gso"


def _turned(attributes: Attributes, table: Ints, flipped: NDArray[np.bool_]) -> Attributes:
    """Reorder the corners of the attributes for faces that were reversed or lost a column."""
    corners = np.broadcast_to(np.arange(table.shape[1]), table.shape).copy()
    corners[table < 0] = -1
    corners[flipped] = topology.reverse(corners[flipped])
    return attributes.taken(np.arange(len(table)), corners)


_CONNECTIVITY = (
    "faces",
    "half_edges",
    "grid_index",
    "triangles",
    "triangle_edges",
    "splits",
    "edges",
    "rim",
    "boundary_loops",
    "components",
)


def _numbers(values: ArrayLike, expected: str) -> Array:
    """Copy to an array of double precision."""
    try:
        given = np.asarray(values)
        if given.dtype.kind not in "c":
            return np.array(given, dtype=np.float64)
        error: Any = "complex numbers"
    except (TypeError, ValueError, OverflowError) as caught:
        error = caught
    raise MeshError(f"{expected}: {error}")


def _checked_vertices(vertices: ArrayLike) -> Array:
    points = _numbers(vertices, "vertices must be numbers in an array (n, 3)")
    if points.ndim != 2 or points.shape[1] != 3:
        raise MeshError(f"vertices must be an array (n, 3), not {points.shape}")
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if bad.size:
        raise MeshError(
            f"the coordinates of vertex {bad[0]} are not finite ({bad.size} such vertices); "
            "remove or replace them"
        )
    return points


def _checked_faces(faces: Any, points: Array) -> tuple[Ints, NDArray[np.bool_], tuple[str, ...]]:
    """Check and orient faces; return them, a mask of the reversed ones, and notes."""
    try:
        given = np.asarray(faces)
    except ValueError:
        raise MeshError("faces must be an array (m, 3) or (m, 4); pad triangles with -1") from None
    if given.ndim != 2 or given.shape[1] not in (3, 4) or given.dtype.kind not in "iuf":
        raise MeshError(f"faces must be integers in an array (m, 3) or (m, 4), not {given.shape}")
    with np.errstate(invalid="ignore"):
        table = given.astype(np.int64)
    if given.dtype.kind == "f" and (table != given).any():
        raise MeshError(f"face {np.argwhere(table != given)[0][0]} has an index that is no integer")
    if len(table) == 0:
        raise MeshError("the mesh has no faces")
    if table.shape[1] == 4 and (table[:, 3] == -1).all():
        table = table[:, :3].copy()
    tri = table[:, 3] == -1 if table.shape[1] == 4 else np.ones(len(table), bool)
    inside = (table >= 0) & (table < len(points))
    inside[tri, 3:] = True
    bad = np.flatnonzero(~inside.all(axis=1))
    if bad.size:
        raise MeshError(
            f"face {bad[0]} = {table[bad[0]].tolist()} points outside the {len(points)} vertices "
            f"({bad.size} such faces)"
        )
    _check_corners(table)
    given_table = table
    table, flips, components = topology.orient(table, len(points))
    _check_area(table, points)
    said = []
    if flips:
        said.append(f"{flips} faces were reversed to make the orientation consistent")
    if components > 1:
        said.append(f"the mesh has {components} components; each is treated on its own")
    unused = np.ones(len(points), bool)
    unused[table[table >= 0]] = False
    if unused.any():
        said.append(
            f"{int(unused.sum())} vertices belong to no face and stay as they are "
            f"(the first is vertex {np.flatnonzero(unused)[0]})"
        )
    return table, table[:, 1] != given_table[:, 1], tuple(said)


def _check_corners(table: Ints) -> None:
    ordered = np.sort(table, axis=1)
    bad = np.flatnonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1))
    if bad.size:
        raise MeshError(
            f"face {bad[0]} = {table[bad[0]].tolist()} repeats a vertex ({bad.size} such faces); "
            "write it with one corner less or delete it"
        )
    _, first, count = np.unique(ordered, axis=0, return_index=True, return_counts=True)
    if (count > 1).any():
        raise MeshError(
            f"face {first[count > 1][0]} = {table[first[count > 1][0]].tolist()} is there "
            f"{count[count > 1][0]} times; delete the duplicates"
        )


def _check_area(table: Ints, points: Array) -> None:
    """Refuse faces without area, measured by the cross product of two spanning vectors."""
    mask = np.zeros(len(points), bool)
    mask[table[table >= 0]] = True
    used = points[mask]
    # Squares and products of lengths must stay in the range of double precision.
    farthest = np.abs(used).max()
    size = np.ptp(used, axis=0).max() if farthest < 1e100 else np.inf
    if not 1e-100 < size < np.inf:
        raise MeshError(
            f"the surface is {size:.3g} wide and reaches to {farthest:.3g}: all its vertices are "
            "one point, or its unit of length needs changing"
        )
    p = points - used.mean(axis=0)
    if table.shape[1] == 3:
        last = table[:, 2]
    else:
        last = np.where(table[:, 3] < 0, table[:, 0], table[:, 3])
    # Diagonals of a quad, two edges of a triangle.
    a = p[table[:, 2]] - p[table[:, 0]]
    b = p[last] - p[table[:, 1]] if table.shape[1] == 4 else p[table[:, 1]] - p[table[:, 0]]
    scaled = np.linalg.norm(np.cross(a / size, b / size), axis=1)
    bad = np.flatnonzero(~(scaled > 1e-14))
    if bad.size:
        raise MeshError(
            f"face {bad[0]} = {table[bad[0]].tolist()} has no area ({bad.size} such faces); "
            "merge its vertices or delete it"
        )


def _weld_poles(grid: Array, faces: Ints) -> tuple[Array, Ints, tuple[str, ...]] | None:
    """Weld the sides of a grid that are one point; None if there are none."""
    points = grid.reshape(-1, 3)
    ids = np.arange(len(points)).reshape(grid.shape[:2])
    sides = {
        "first row": ids[0],
        "last row": ids[-1],
        "first column": ids[:, 0],
        "last column": ids[:, -1],
    }
    size = np.ptp(points, axis=0).max()
    poles = [n for n, s in sides.items() if np.ptp(points[s], axis=0).max() <= 1e-9 * size]
    if not poles or size == 0:
        return None
    target = np.arange(len(points))
    for name in poles:
        # A corner may already be welded to another side: merge that side as well.
        target[np.isin(target, target[sides[name]])] = target[sides[name]].min()
    kept, new = np.unique(target, return_inverse=True)
    table = collapse(faces, new).faces
    verb = "is one point" if len(poles) == 1 else "are one point each"
    note = f"the {' and the '.join(poles)} of the grid {verb}: welded to a pole"
    return points[kept], table, (note,)

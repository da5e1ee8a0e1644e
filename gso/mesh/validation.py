"""Checks and repairs of vertices and faces that a mesh is made of."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from gso import geometry
from gso.errors import MeshError
from gso.mesh import topology
from gso.mesh.attributes import Attributes
from gso.mesh.welding import collapse
from gso.typing import Array, Flags, Ints

if TYPE_CHECKING:
    from gso.mesh.mesh import Mesh


class FaceError(MeshError):
    """A face cannot be used.

    Attributes
    ----------
    face : int
        Its row in the table of faces.
    what : str
        Its corners, what is wrong, and what to do.
    """

    def __init__(self, face: int, what: str):
        super().__init__(f"face {face} = {what}")
        self.face, self.what = face, what

    def __reduce__(self) -> tuple[type[FaceError], tuple[int, str]]:
        return FaceError, (self.face, self.what)


#: Tolerance for coincident vertices, relative to the longest side of the bounding box.
JOINED = 1e-7


def reordered(attributes: Attributes, table: Ints, flipped: Flags) -> Attributes:
    """Reorder the corners of the attributes for faces that were reversed or lost a column."""
    corners = np.broadcast_to(np.arange(table.shape[1]), table.shape).copy()
    corners[table < 0] = -1
    corners[flipped] = topology.reverse(corners[flipped])
    return attributes.taken(np.arange(len(table)), corners)


def numbers(values: ArrayLike, expected: str) -> Array:
    """Copy to an array of double precision."""
    try:
        given = np.asarray(values)
        if given.dtype.kind not in "c":
            return np.array(given, dtype=np.float64)
        error: Exception | str = "complex numbers"
    except (TypeError, ValueError, OverflowError) as caught:
        error = caught
    raise MeshError(f"{expected}: {error}")


def checked_vertices(vertices: ArrayLike) -> Array:
    points = numbers(vertices, "vertices must be numbers in an array (n, 3)")
    if points.ndim != 2 or points.shape[1] != 3:
        raise MeshError(f"vertices must be an array (n, 3), not {points.shape}")
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if bad.size:
        raise MeshError(
            f"the coordinates of vertex {bad[0]} are not finite ({bad.size} such vertices); "
            "remove or replace them"
        )
    return points


def checked_grid(points: ArrayLike) -> Array:
    """Copy a grid of points (H, W, 3) to double precision.

    Raises
    ------
    MeshError
        Another shape, fewer than 3 rows or columns, or a coordinate that is not finite.
    """
    grid = numbers(points, "a grid is an array of numbers (H, W, 3)")
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
    return grid


def checked_table(faces: ArrayLike, count: int) -> Ints:
    """Convert faces to integers (m, 3) or (m, 4), with vertices from 0 to ``count - 1``."""
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
    inside = (table >= 0) & (table < count)
    inside[tri, 3:] = True
    _refuse(table, np.asarray(~inside.all(axis=1)), f"points outside the {count} vertices")
    return table


def _refuse(table: Ints, bad: Flags, what: str, instead: str = "") -> None:
    """Raise a FaceError that names the first of some faces, if there are any."""
    if bad.any():
        k = int(bad.argmax())
        raise FaceError(
            k,
            f"{table[k].tolist()} {what} ({int(bad.sum())} such faces)"
            + (f"; {instead}" if instead else ""),
        )


def checked_faces(faces: ArrayLike, points: Array) -> tuple[Ints, Flags, tuple[str, ...]]:
    """Check and orient faces; return them, a mask of the reversed ones, and notes."""
    table = checked_table(faces, len(points))
    check_corners(table)
    given_table = table
    table, flips, components = topology.orient(table, len(points))
    check_area(table, points)
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


def check_corners(table: Ints) -> None:
    ordered = np.sort(table, axis=1)
    twice: Flags = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1)
    _refuse(table, twice, "repeats a vertex", "write it with one corner less or delete it")
    _, first, count = np.unique(ordered, axis=0, return_index=True, return_counts=True)
    if (count > 1).any():
        face = int(first[count > 1][0])
        raise FaceError(
            face,
            f"{table[face].tolist()} is there {count[count > 1][0]} times; delete the duplicates",
        )


def check_area(table: Ints, points: Array) -> None:
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
    thin = ~have_area(table, points - used.mean(axis=0), size)
    _refuse(table, thin, "has no area", "merge its vertices or delete it")


def have_area(table: Ints, points: Array, size: float | None = None) -> Flags:
    """Mark the faces that have an area, relative to the size of the surface.

    Parameters
    ----------
    table : ndarray of int, (m, 3) or (m, 4)
    points : ndarray, (n, 2) or (n, 3)
        Vertices, all of them used.
    size : float, optional
        Longest side of the bounding box.
    """
    p = points - points.mean(axis=0)
    if p.shape[1] == 2:
        p = np.pad(p, ((0, 0), (0, 1)))
    size = float(np.ptp(p, axis=0).max()) if size is None else size
    x, y, z = geometry.quad_area_vectors(p / size, topology.four_corners(table)).T
    return np.asarray(np.sqrt(x * x + y * y + z * z) > 1e-14)


def check_vertices(he: topology.HalfEdges, points: Array) -> None:
    """Refuse non-manifold vertices; where an edge has a vertex on it, say that first.

    Raises
    ------
    MeshError
        Parts of the surface share no edge at a vertex.
    """
    try:
        topology.check_vertices(he)
    except MeshError:
        _check_t_junctions(he, points)
        raise


def _check_t_junctions(he: topology.HalfEdges, points: Array) -> None:
    """Refuse vertices of the outline that lie on its edges without being their ends."""
    from scipy.spatial import cKDTree

    rim = np.flatnonzero(he.twin < 0)
    if not rim.size:
        return
    a, b = he.origin[rim], he.dest[rim]
    ids = np.unique(a)
    way = points[b] - points[a]
    size = np.linalg.norm(way, axis=1)
    tree = cKDTree(points[ids])
    step = JOINED * np.ptp(points[ids], axis=0).max()
    near = tree.query_ball_point(0.5 * (points[a] + points[b]), 0.5 * size)
    edge = np.repeat(np.arange(len(rim)), [len(found) for found in near])
    vertex = ids[np.concatenate([np.asarray(found, np.int64) for found in near])]
    share = ((points[vertex] - points[a[edge]]) * way[edge]).sum(axis=1) / size[edge] ** 2
    foot = points[a[edge]] + share[:, None] * way[edge]
    on = np.linalg.norm(points[vertex] - foot, axis=1) <= step
    on &= (share * size[edge] > step) & ((1.0 - share) * size[edge] > step)
    if on.any():
        k = int(on.argmax())
        at = edge[k]
        raise MeshError(
            f"vertex {vertex[k]} lies on the edge from vertex {a[at]} to vertex {b[at]}, but the "
            f"face {he.face[rim[at]]} of that edge does not have it ({int(on.sum())} such "
            "vertices): add it to that face as a corner, so that the faces share edges"
        )


def weld_poles(grid: Array, faces: Ints) -> tuple[Array, Ints, tuple[str, ...]] | None:
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


def unjoined(mesh: Mesh) -> tuple[str, ...]:
    """Write the note on coincident edges that are not joined; empty where there are none."""
    count = int(mesh.seams.sum())
    if not count:
        return ()
    return (f"{count} edges lie on others without being joined to them. {welding_advice(mesh)}",)


def welding_advice(mesh: Mesh) -> str:
    """Return advice on how to merge the vertices of a mesh, with a suitable distance."""
    least = 10 * JOINED * mesh.diagonal
    return f"Merge their vertices with weld={least:.1g} of gso.load, --weld {least:.1g} of gso"

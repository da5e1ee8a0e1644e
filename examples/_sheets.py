"""Triangle and quad layouts for the example scripts: rows, discs, welding, relaxation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from _write import Faces, Points, grid_faces
from scipy.optimize import minimize
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree


def strip(counts: Sequence[int]) -> tuple[Faces, Points, Faces]:
    """Triangulate rows of segments; rows go down, their segments run to the right.

    Parameters
    ----------
    counts : sequence of int
        Segments of each row; 0 for a row that is a single point.

    Returns
    -------
    row : ndarray of int, (n,)
        Row of each vertex.
    along : ndarray, (n,)
        Where in its row each vertex is, from 0 to 1.
    faces : ndarray, (m, 3)
        Anticlockwise.

    Examples
    --------
    >>> row, along, faces = strip([0, 1, 2])
    >>> faces
    array([[0, 1, 2],
           [1, 3, 4],
           [1, 4, 2],
           [2, 4, 5]])
    """
    row = np.repeat(np.arange(len(counts)), np.array(counts) + 1)
    along = np.concatenate([np.linspace(0.0, 1.0, n + 1) for n in counts])
    first = np.cumsum([0, *(n + 1 for n in counts)]).tolist()
    faces = []
    for k, (m, n) in enumerate(pairwise(counts)):
        i, j = first[k], first[k + 1]
        above, below = (np.arange(m) + 0.5) / max(m, 1), (np.arange(n) + 0.5) / max(n, 1)
        # Segments are taken from both rows in the order of their midpoints.
        for upper in np.argsort(np.concatenate([above, below]), kind="stable") < m:
            faces.append((i, j, i + 1) if upper else (i, j, j + 1))
            i, j = i + int(upper), j + int(not upper)
    return row, along, np.array(faces)


def hexagon(length: int, rows: int) -> tuple[Points, Faces]:
    """Triangulate a hexagon, drawn out along x, by a lattice of equilateral triangles.

    Parameters
    ----------
    length : int
        Edges along the middle row; twice `rows` for a regular hexagon.
    rows : int
        Rows on either side of it; each is an edge shorter than the one before.

    Returns
    -------
    points : ndarray, (n, 2)
        Unit edges; the origin is in the middle.
    faces : ndarray, (4 length rows - 2 rows^2, 3)
        Anticlockwise.
    """
    counts = length - np.abs(np.arange(-rows, rows + 1))
    row, along, faces = strip(counts.tolist())
    y = (rows - row) * np.sqrt(0.75)
    return np.stack([(along - 0.5) * counts[row], y], axis=-1), faces


def disc(n: int) -> tuple[Points, Faces]:
    """Triangulate the unit disc by `n` rings, the k-th of which has 6 k vertices.

    Returns
    -------
    points : ndarray, (3 n^2 + 3 n + 1, 2)
    faces : ndarray, (6 n^2, 3)
        Anticlockwise.

    Examples
    --------
    >>> points, faces = disc(4)
    >>> points.shape, faces.shape
    ((61, 2), (96, 3))
    """
    row, along, faces = strip(range(n + 1))
    angle = (np.arange(6)[:, None] + along) * np.pi / 3
    points = (row / n)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return join(list(points), [faces] * 6)


def quad_disc(side: int, rings: int) -> tuple[Points, Faces]:
    """Quads on the unit disc: a square in the middle and four sectors round it.

    The four corners of the square have valence 3, all other inner vertices valence 4.

    Parameters
    ----------
    side : int
        Quads along a side of the square.
    rings : int
        Quads from the square to the circle.
    """
    x, t = np.linspace(-1.0, 1.0, side + 1), np.linspace(0.0, 1.0, rings + 1)[:, None, None]
    square = 0.5 * np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1)
    inner = 0.5 * np.stack([np.ones_like(x), x], axis=-1)
    outer = np.stack([np.cos(x * np.pi / 4), np.sin(x * np.pi / 4)], axis=-1)
    sector = ((1 - t) * inner + t * outer).reshape(-1, 2)
    quarter = np.array([[0.0, 1.0], [-1.0, 0.0]])
    sectors = [sector @ np.linalg.matrix_power(quarter, k) for k in range(4)]
    faces = [grid_faces(side + 1, side + 1)] + [grid_faces(rings + 1, side + 1)] * 4
    return join([square.reshape(-1, 2), *sectors], faces)


def beside(parts: Sequence[Points], faces: Sequence[Faces]) -> tuple[Points, Faces]:
    """Put meshes into one without joining them."""
    first = np.cumsum([0, *(len(p) for p in parts)])
    return np.concatenate(parts), np.concatenate([f + k for f, k in zip(faces, first)])


def join(parts: Sequence[Points], faces: Sequence[Faces]) -> tuple[Points, Faces]:
    """Put meshes into one and weld vertices that are nearer to each other than 1e-9."""
    points, numbered = beside(parts, faces)
    pairs = cKDTree(points).query_pairs(1e-9, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), tuple(pairs.T)), (len(points), len(points)))
    number = connected_components(graph, directed=False)[1]
    kept = np.unique(number, return_index=True)[1]
    return points[kept], number[numbered]


def edges_of(faces: Faces) -> tuple[Faces, Faces]:
    """Edges of a mesh, and the number of that from each corner of a face to the next.

    Returns
    -------
    edges : ndarray, (e, 2)
    number : ndarray, (m, k)
    """
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges, number = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
    return edges, number.reshape(faces.shape)


def rim(faces: Faces) -> Faces:
    """Vertices on the boundary of a mesh with one boundary loop, in order along it.

    They start at the lowest number and leave the mesh on their left.
    """
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    there = set(map(tuple, sides.tolist()))
    after = {a: b for a, b in there if (b, a) not in there}
    loop = [min(after)]
    while after[loop[-1]] != loop[0]:
        loop.append(after[loop[-1]])
    return np.array(loop)


def relax(points: Points, faces: Faces, steps: int = 30) -> Points:
    """Move the inner vertices until the fourth powers of the edges have the least sum.

    The squares would leave the mesh dense where it is far from the boundary. In the first
    step, the result of which depends on the boundary only, it is the squares.

    Parameters
    ----------
    points : ndarray, (n, d)
    faces : ndarray, (m, k)
    steps : int
        Steps of reweighted least squares.
    """
    ends, _ = edges_of(faces)
    edge, one, shape = np.arange(len(ends)), np.ones(len(ends)), (len(ends), len(points))
    start, stop = (csc_array((one, (edge, end)), shape) for end in ends.T)
    spring = stop - start
    fixed = rim(faces)
    inner = np.setdiff1d(np.arange(len(points)), fixed)
    points, stiff = points.copy(), one
    for _ in range(steps):
        pull = spring[:, inner].T @ diags_array(stiff)
        given = pull @ (spring[:, fixed] @ points[fixed])
        points[inner] = spsolve((pull @ spring[:, inner]).tocsc(), -given)
        square = np.sum((spring @ points) ** 2, axis=1)
        # Half way, for without it the steps swing to and fro.
        stiff = np.sqrt(stiff * square / square.mean())
    return points


def even(surface: Callable[[Points], Points], at: Points, faces: Faces) -> Points:
    """Move the inner vertices of triangles over a surface until these are nearly equilateral.

    What gets least is the sum over the triangles of squared edges over area, which is
    infinite for a triangle without area.

    Parameters
    ----------
    surface : callable
        Turns parameters (n, 2) into points (n, 3).
    at : ndarray, (n, 2)
        Parameters; those of boundary vertices are kept.
    faces : ndarray, (m, 3)

    Returns
    -------
    ndarray, (n, 2)
    """
    inner = np.setdiff1d(np.arange(len(at)), rim(faces))
    at, small = at.copy(), 1e-6

    def cost(flat: Points) -> tuple[float, Points]:
        at[inner] = flat.reshape(-1, 2)
        corners = surface(at)[faces]
        edges = np.roll(corners, -1, axis=1) - corners
        normal = np.cross(edges[:, 0], edges[:, 1])
        area = np.linalg.norm(normal, axis=1)[:, None, None]
        squares = np.sum(edges**2, axis=(1, 2))[:, None, None]
        # Slopes of `squares` and of `area`, which is twice the area, in the corners.
        widen = 2 * (np.roll(edges, 1, axis=1) - edges)
        grow = np.cross(normal[:, None] / area[:, 0, None], np.roll(edges, -1, axis=1))
        slope = np.zeros((len(at), 3))
        np.add.at(slope, faces, widen / area - squares / area**2 * grow)
        along = [surface(at + small * d) - surface(at - small * d) for d in np.eye(2)]
        gradient = np.stack([np.sum(slope * d, axis=1) for d in along], axis=1) / (2 * small)
        return float(np.sum(squares / area)), gradient[inner].ravel()

    start = at[inner].ravel()
    found = minimize(cost, start, jac=True, method="L-BFGS-B", options={"maxiter": 1000})
    at[inner] = found.x.reshape(-1, 2)
    return at

"""What a design is, and how quad meshes are refined, cut and numbered anew."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import gso
from gso.mesh import topology
from gso.typing import Array, Flags, Ints


@dataclass(frozen=True)
class Symmetry:
    """A rigid motion that maps a design onto itself.

    Attributes
    ----------
    image : ndarray of int, (n,)
        The vertex that each vertex goes to.
    motion : ndarray, (3, 3)
        The orthogonal matrix: ``vertices[image] == vertices @ motion.T``.
    splits : bool
        Whether it maps ``mesh.triangles``, one triangulation, onto itself.
    """

    image: Ints
    motion: Array
    splits: bool


@dataclass(frozen=True)
class Design:
    """A mesh with a name, and the motions that map it onto itself."""

    name: str
    mesh: gso.Mesh
    symmetries: tuple[Symmetry, ...] = ()

    def asymmetry(self, vertices: Array | None = None) -> float:
        """Largest distance of a vertex from its image under a symmetry, over the diagonal."""
        points = self.mesh.vertices if vertices is None else vertices
        centred = points - points.mean(axis=0)
        gaps = [
            np.linalg.norm(centred[s.image] - centred @ s.motion.T, axis=1).max()
            for s in self.symmetries
        ]
        return float(max(gaps, default=0.0) / self.mesh.diagonal)


def refined(points: Array, faces: Ints, n: int) -> tuple[Array, Ints]:
    """Every quad of a complex (k, d) cut into n x n by bilinear interpolation."""
    count, m = len(points), len(faces)
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1)
    edges, side = np.unique(np.sort(sides, axis=-1).reshape(-1, 2), axis=0, return_inverse=True)
    side = side.reshape(m, 4)
    forward = sides[..., 0] < sides[..., 1]
    on_edge = count + np.arange(len(edges) * (n - 1)).reshape(len(edges), n - 1)
    ids = np.empty((m, n + 1, n + 1), np.int64)
    inside = count + on_edge.size + np.arange(m * (n - 1) ** 2)
    ids[:, 1:-1, 1:-1] = inside.reshape(m, n - 1, n - 1)
    along = np.where(forward[..., None], on_edge[side], on_edge[side][..., ::-1])
    ids[:, 1:-1, 0], ids[:, -1, 1:-1] = along[:, 0], along[:, 1]
    ids[:, 1:-1, -1], ids[:, 0, 1:-1] = along[:, 2, ::-1], along[:, 3, ::-1]
    ids[:, 0, 0], ids[:, -1, 0], ids[:, -1, -1], ids[:, 0, -1] = faces.T
    t = np.linspace(0.0, 1.0, n + 1)
    s, r = np.meshgrid(t, t, indexing="ij")
    weights = np.stack([(1 - s) * (1 - r), s * (1 - r), s * r, (1 - s) * r], axis=-1)
    values = np.einsum("ijk,mkd->mijd", weights, points[faces])
    out = np.empty((count + on_edge.size + inside.size, points.shape[1]))
    out[ids] = values
    cells = topology.grid_faces(n + 1, n + 1)
    return out, ids.reshape(m, -1)[:, cells].reshape(-1, 4)


def relaxed(points: Array, faces: Ints, steps: int) -> Array:
    """Vertices inside moved to the mean of their neighbours, some times."""
    from scipy.sparse import csr_matrix

    he = topology.half_edges(faces, len(points))
    a, b = topology.edges(he).T
    n = len(points)
    links = csr_matrix((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, a])), shape=(n, n))
    inside = ~he.boundary_vertex & (he.face_count > 0)
    degree = np.maximum(np.asarray(links.sum(axis=1)), 1.0)
    for _ in range(steps):
        points = np.where(inside[:, None], (links @ points) / degree, points)
    return points


def even(points: Array, faces: Ints, n: int) -> tuple[Array, Ints]:
    """Every quad of a complex cut into n x n, and the vertices inside evened out."""
    plan, quads = refined(points, faces, n)
    return relaxed(plan, quads, n), quads


def without(points: Array, faces: Ints, gone: Flags) -> tuple[Array, Ints]:
    """A mesh without some of its faces, and without the vertices that only they had."""
    used, number = np.unique(faces[~gone], return_inverse=True)
    return points[used], number.reshape(-1, faces.shape[1])


def shuffled(points: Array, faces: Ints, rng: np.random.Generator) -> tuple[Array, Ints]:
    """The same mesh with its vertices in random order."""
    order = rng.permutation(len(points))
    return points[order], np.argsort(order)[faces]


def net(points: Array) -> tuple[Array, Ints]:
    """Points (H, W, d) as vertices (H W, d), and the quads between them."""
    return points.reshape(-1, points.shape[-1]), topology.grid_faces(*points.shape[:2])


def ring(points: Array) -> tuple[Array, Ints]:
    """The same, closed: the last column is joined to the first."""
    height, width = points.shape[:2]
    ids = np.arange(height * width).reshape(height, width)
    closed = np.c_[ids, ids[:, :1]].ravel()
    return points.reshape(-1, points.shape[-1]), closed[topology.grid_faces(height, width + 1)]


def rolling(plan: Array, rng: np.random.Generator, bow: float, wave: float) -> Array:
    """A freeform height over plan points: a bow in two directions and a few waves."""
    x, y = (plan / np.abs(plan).max()).T
    turn, phase = rng.uniform(0.0, np.pi, 2)
    u, v = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    share = rng.uniform(-1.0, 1.0)
    bent = bow * (u * u + share * v * v)
    return (bent + wave * np.sin(2.5 * u + phase) * np.cos(2.0 * v)) * np.abs(plan).max()

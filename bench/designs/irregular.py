"""Ten quad meshes with vertices of three, five and more faces; none is closed."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay

import gso
from designs.base import Design, even, net, refined, rolling, without
from gso.typing import Array, Ints


def irregular(seed: int = 0) -> list[Design]:
    """Stars, caps, roofs and subdivided triangulations over freeform heights."""
    rng = np.random.default_rng([2, seed])
    l_shape = np.array([[-1, -1], [1, -1], [1, 0], [0, 0], [0, 1], [-1, 1.0]])
    return [
        Design("star of five", _freeform(*star(5), 16, rng, 0.35, 0.1)),
        Design("gridshell dome of three", _dome(*star(3), 20, rng)),
        Design("cap with a square core", _freeform(*square_core(), 17, rng, 0.4, 0.08)),
        Design("lattice with an inset", _freeform(*inset(3, 3, (1, 1)), 11, rng, 0.35, 0.12)),
        Design("L-shaped roof", _freeform(*thirds(*_scattered(l_shape, rng)), 5, rng, 0.3, 0.1)),
        Design("T-shaped roof", _freeform(*_t_shape(), 13, rng, 0.35, 0.08)),
        Design("Y-shaped roof", _freeform(*_y_shape(), 14, rng, 0.35, 0.06)),
        Design("disc of thirds", _freeform(*thirds(*_disc(rng, 9)), 7, rng, 0.4, 0.1)),
        Design("five faces of a cube, rounded", _rounded_box(rng)),
        Design("disc of thirds, a saddle", _freeform(*thirds(*_disc(rng, 12)), 5, rng, -0.5, 0.05)),
    ]


def star(count: int) -> tuple[Array, Ints]:
    """So many quads round one vertex, their other corners on a regular polygon."""
    angle = np.pi * np.arange(2 * count) / count
    radius = np.where(np.arange(2 * count) % 2, 1.0, np.cos(np.pi / count) ** 0.5)
    rim = np.c_[radius * np.cos(angle), radius * np.sin(angle)]
    k = 2 * np.arange(count)
    faces = np.stack([np.zeros_like(k), 1 + k, 2 + k, 1 + (k + 2) % (2 * count)], axis=1)
    return np.r_[np.zeros((1, 2)), rim], faces


def square_core() -> tuple[Array, Ints]:
    """A square in the middle of a square: four vertices of three faces."""
    angle = np.pi * (0.25 + 0.5 * np.arange(4))
    square = np.c_[np.cos(angle), np.sin(angle)]
    k = np.arange(4)
    around = np.stack([k, 4 + k, 4 + (k + 1) % 4, (k + 1) % 4], axis=1)
    return np.r_[0.45 * square, square], np.r_[[[0, 1, 2, 3]], around]


def inset(rows: int, columns: int, cell: tuple[int, int]) -> tuple[Array, Ints]:
    """A lattice in which one quad has a smaller one inside: valences three and five."""
    x, y = np.mgrid[: rows + 1, : columns + 1].astype(float)
    points, faces = net(np.stack([x, y], axis=-1) - [rows / 2.0, columns / 2.0])
    place = cell[0] * columns + cell[1]
    corners = faces[place]
    inner = points[corners].mean(axis=0) + 0.45 * (points[corners] - points[corners].mean(axis=0))
    new = len(points) + np.arange(4)
    between = np.stack([corners, np.roll(corners, -1), np.roll(new, -1), new], axis=1)
    return np.r_[points, inner], np.r_[np.delete(faces, place, axis=0), new[None], between]


def thirds(points: Array, triangles: Ints) -> tuple[Array, Ints]:
    """Three quads for each triangle, a vertex of three faces in its middle."""
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1)
    edges, side = np.unique(np.sort(sides, axis=-1).reshape(-1, 2), axis=0, return_inverse=True)
    side = len(points) + side.reshape(-1, 3)
    middle = len(points) + len(edges) + np.arange(len(triangles))
    quads = np.stack([triangles, side, np.repeat(middle[:, None], 3, axis=1)], axis=-1)
    faces = np.concatenate([quads, np.roll(side, 1, axis=1)[..., None]], axis=-1)
    everything = [points, points[edges].mean(axis=1), points[triangles].mean(axis=1)]
    return np.concatenate(everything), faces.reshape(-1, 4)


def _freeform(
    points: Array, faces: Ints, n: int, rng: np.random.Generator, bow: float, wave: float
) -> gso.Mesh:
    """A coarse complex refined, evened out, and put at a freeform height."""
    plan, quads = even(points, faces, n)
    return gso.Mesh(np.c_[plan, rolling(plan, rng, bow, wave)], quads)


def _dome(points: Array, faces: Ints, n: int, rng: np.random.Generator) -> gso.Mesh:
    """The same over an ellipsoidal cap."""
    plan, quads = even(points, faces, n)
    a, b = rng.uniform(1.2, 1.5, 2)
    inside = 1.0 - (plan[:, 0] / a) ** 2 - (plan[:, 1] / b) ** 2
    return gso.Mesh(np.c_[plan, 0.8 * np.sqrt(np.maximum(inside, 0.05))], quads)


def _t_shape() -> tuple[Array, Ints]:
    """Two arms and a stem of squares; the square where they meet has another one inside."""
    points, faces = inset(5, 3, (2, 2))
    at = points[faces].mean(axis=1)
    return without(points, faces, (at[:, 1] <= 0.5) & (np.abs(at[:, 0]) >= 0.5))


def _y_shape() -> tuple[Array, Ints]:
    """Three quads round one vertex, and two squares on every second side of their hexagon."""
    angle = np.pi * (np.arange(6) / 3.0 + 1.0 / 6.0)
    rim = np.c_[np.cos(angle), np.sin(angle)]
    points = [np.zeros((1, 2)), rim]
    faces = [[0, 1 + k, 2 + k, 1 + (k + 2) % 6] for k in (0, 2, 4)]
    for k in (0, 2, 4):
        start = [1 + k, 2 + k]
        out = rim[k] + rim[k + 1]
        for step in (1, 2):
            new = 7 + 2 * (len(points) - 2)
            points.append(rim[[k, k + 1]] + 0.55 * step * out)
            faces.append([start[0], new, new + 1, start[1]])
            start = [new, new + 1]
    return np.concatenate(points), np.array(faces)


def _scattered(outline: Array, rng: np.random.Generator) -> tuple[Array, Ints]:
    """Delaunay triangles inside an L of three unit squares."""
    jitter = 0.06 * rng.uniform(-1.0, 1.0, (3, 2))
    inner = np.array([[-0.5, -0.5], [0.45, -0.5], [-0.5, 0.45]]) + jitter
    between = np.array([[0, -1], [-1, 0], [1, -0.5], [-0.5, 1], [0.5, 0.0], [0.0, 0.5]])
    points = np.r_[outline, inner, between]
    triangles = Delaunay(points).simplices.astype(np.int64)
    at = points[triangles].mean(axis=1)
    return points, triangles[~((at > 0.0).all(axis=1))]


def _disc(rng: np.random.Generator, count: int) -> tuple[Array, Ints]:
    """Delaunay triangles of a polygon with some points inside."""
    angle = 2.0 * np.pi * np.arange(count) / count
    inner = 2.0 * np.pi * (np.arange(count // 2) + rng.uniform()) / (count // 2)
    ring = 0.5 * np.c_[np.cos(inner), np.sin(inner)]
    ring += 0.05 * rng.uniform(-1.0, 1.0, ring.shape)
    points = np.r_[np.c_[np.cos(angle), np.sin(angle)], ring, 0.1 * rng.uniform(-1, 1, (1, 2))]
    return points, Delaunay(points).simplices.astype(np.int64)


def _rounded_box(rng: np.random.Generator) -> gso.Mesh:
    """The top of a cube and the upper half of its sides, pushed out to an ellipsoid."""
    points, faces = square_core()
    top = np.c_[points[:4] / 0.45 / np.sqrt(0.5), np.ones(4)]
    low = np.c_[points[4:] / np.sqrt(0.5), np.full(4, 0.1)]
    space, quads = refined(np.r_[top, low], faces, 16)
    radius = np.linalg.norm(space, axis=1, keepdims=True)
    return gso.Mesh(space / radius * [1.0, rng.uniform(0.8, 1.2), rng.uniform(0.5, 0.7)], quads)

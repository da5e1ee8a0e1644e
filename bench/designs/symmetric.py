"""Designs that a mirror or a turn maps onto themselves, with the image of every vertex."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

import gso
from designs.base import Design, Symmetry, even, net, ring
from designs.irregular import square_core, star
from gso.typing import Array, Ints

MIRROR_X = np.diag([-1.0, 1.0, 1.0])
MIRROR_Y = np.diag([1.0, -1.0, 1.0])
SWAP = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def symmetric(seed: int = 0) -> list[Design]:
    """Grids, triangles, rings and irregular quads with mirrors and turns."""
    rng = np.random.default_rng([4, seed])
    a, b, c = rng.uniform(0.2, 0.45, 3)
    wave = rng.uniform(0.05, 0.1)

    def mirrored(x: Array, y: Array) -> Array:
        return a * x * x - b * y * y + c * y**3 + wave * np.cos(3.0 * x) * np.sin(2.0 * y)

    def fourfold(x: Array, y: Array) -> Array:
        return -a * (x * x + y * y) + b * x * x * y * y + wave * np.cos(3.0 * x) * np.cos(3.0 * y)

    def swapped(x: Array, y: Array) -> Array:
        return a * (x * x + y * y) + c * x * y + wave * (np.sin(3.0 * x) + np.sin(3.0 * y))

    t = np.arange(-18, 19) / 18.0
    plan, faces = net(np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1))
    union, halves = _triangles(plan, faces, True), _triangles(plan, faces, False)
    core, core_faces = even(*square_core(), 17)
    five, five_faces = even(*star(5), 16)
    angle = 2.0 * np.pi * np.arange(72) / 72
    radius = np.linspace(0.4, 1.0, 15)[:, None]
    polar = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    band, band_faces = ring(polar)
    waves = wave * np.cos(4.0 * np.arctan2(band[:, 1], band[:, 0])) * (band**2).sum(axis=1)
    return [
        _design("mirror, grid", plan, mirrored, faces, [MIRROR_X]),
        _design("diagonal mirror, grid", plan, swapped, faces, [SWAP]),
        _design("four mirrors, grid", plan, fourfold, faces, [MIRROR_X, MIRROR_Y, SWAP]),
        _design("mirror, triangles", plan, mirrored, halves, [MIRROR_X]),
        _design("four mirrors, triangles", plan, fourfold, union, [MIRROR_X, MIRROR_Y, SWAP]),
        _design("four mirrors, square core", core, fourfold, core_faces, [MIRROR_X, SWAP]),
        _design("fifth turns, star of five", five, _round(a, wave), five_faces, [_turn(5)]),
        _design("quarter turns, ring", band, lambda *_: waves, band_faces, [_turn(4), MIRROR_X]),
    ]


def _triangles(plan: Array, faces: Ints, four: bool) -> Ints:
    """Every quad split, the splits mirrored at x = 0, or at both axes."""
    at = plan[faces].mean(axis=1)
    turn = (at[:, 0] > 0) ^ ((at[:, 1] > 0) & four)
    turned = np.where(turn[:, None], np.roll(faces, -1, axis=1), faces)
    return np.r_[turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]]


def _round(a: float, wave: float):
    """A height that a fifth of a turn leaves as it is."""

    def height(x: Array, y: Array) -> Array:
        r2, angle = x * x + y * y, np.arctan2(y, x)
        return -a * r2 + wave * r2 * r2 * np.sqrt(r2) * np.cos(5.0 * angle)

    return height


def _turn(count: int) -> Array:
    c, s = np.cos(2.0 * np.pi / count), np.sin(2.0 * np.pi / count)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _design(name: str, plan: Array, height, faces: Ints, motions: list[Array]) -> Design:
    """A mesh whose vertices are symmetric to rounding, with the images found by place."""
    points = np.c_[plan, height(*plan.T)]
    tree = cKDTree(points)
    images = [tree.query(points @ m.T)[1] for m in motions]
    mesh = gso.Mesh(points, faces)
    splits = [_maps(mesh.triangles, image) for image in images]
    found = zip(images, motions, splits, strict=True)
    return Design(name, mesh, tuple(Symmetry(i, m, s) for i, m, s in found))


def _maps(triangles: Ints, image: Ints) -> bool:
    """Whether the images of triangles are triangles."""
    here, there = (np.unique(np.sort(t, axis=1), axis=0) for t in (triangles, image[triangles]))
    return np.array_equal(here, there)

"""Ten meshes with holes: rings, perforated surfaces, a dome with an oculus."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay

import gso
from designs.base import Design, net, ring, rolling, without
from gso.typing import Array, Flags


def holes(seed: int = 0) -> list[Design]:
    """Annuli, perforated saddles, domes and grids with openings; 800 to 3000 faces."""
    rng = np.random.default_rng([1, seed])
    return [
        Design("annulus, nearly flat", _annulus(rng, 0.0, 0.08)),
        Design("annulus, conical", _annulus(rng, 0.5, 0.06)),
        Design("annulus, wavy", _annulus(rng, 0.1, 0.22)),
        Design("saddle with 2 holes", _perforated_saddle(rng, 2, 2)),
        Design("saddle with 4 holes", _perforated_saddle(rng, 2, 4)),
        Design("saddle with 9 holes", _perforated_saddle(rng, 3, 9)),
        Design("dome with an oculus", _oculus(rng)),
        Design("paraboloid with round holes in steps", _stepped_paraboloid(rng)),
        Design("grid with a rectangular opening", _opening(rng)),
        Design("triangles with three holes", _triangles(rng)),
    ]


def _annulus(rng: np.random.Generator, slope: float, wave: float) -> gso.Mesh:
    """A ring round a hole of a third of its width, in 16 x 72 quads."""
    radius = np.linspace(0.35, 1.0, 17)[:, None]
    angle = 2.0 * np.pi * np.arange(72) / 72
    fold = rng.integers(2, 4)
    phase = rng.uniform(0.0, 2.0 * np.pi)
    height = slope * (radius - 1.0) + wave * radius**2 * np.cos(fold * angle + phase)
    points = np.stack(
        [radius * np.cos(angle), radius * np.sin(angle), height + 0.1 * radius**2], axis=-1
    )
    return gso.Mesh(*ring(points))


def _perforated_saddle(rng: np.random.Generator, side: int, count: int) -> gso.Mesh:
    """A saddle with round holes in square cells; the quads follow the holes."""
    cells, half = (12, 2) if side == 3 else (18, 4)
    n = side * cells
    x, y = np.mgrid[: n + 1, : n + 1].astype(float)
    plan, faces = net(np.stack([x, y], axis=-1))
    middle = (np.mgrid[:side, :side].reshape(2, -1).T + 0.5) * cells
    if count == 2:
        middle = middle[[0, 3]]
    gone = np.zeros(len(faces), bool)
    faces_at = plan[faces].mean(axis=1)
    moved = plan.copy()
    for centre in middle:
        gone |= np.abs(faces_at - centre).max(axis=1) < half
        moved += _rounding(plan - centre, half, 0.5 * cells)
    plan, faces = without(moved, faces, gone)
    plan = plan / (0.5 * n) - 1.0
    bow = rng.uniform(0.3, 0.5)
    height = bow * (plan[:, 0] ** 2 - plan[:, 1] ** 2 + rng.uniform(-0.4, 0.4) * plan.prod(axis=1))
    return gso.Mesh(np.c_[plan, height], faces)


def _rounding(offset: Array, half: float, reach: float) -> Array:
    """Displacement that makes the square of a hole round and fades out at `reach`."""
    box = np.abs(offset).max(axis=1, keepdims=True)
    length = np.maximum(np.linalg.norm(offset, axis=1, keepdims=True), 1e-12)
    share = np.clip((reach - box) / (reach - half), 0.0, 1.0)
    return np.where(box < reach, share * (box / length - 1.0) * offset, 0.0)


def _oculus(rng: np.random.Generator) -> gso.Mesh:
    """Two thirds of a sphere, a little squashed, open at the top: 20 x 80 quads."""
    polar = np.radians(np.linspace(18.0, 78.0, 21))[:, None]
    angle = 2.0 * np.pi * np.arange(80) / 80
    squash = 1.0 + rng.uniform(0.02, 0.06) * np.cos(2.0 * angle + rng.uniform(0.0, np.pi))
    points = [np.sin(polar) * np.cos(angle) * squash, np.sin(polar) * np.sin(angle)]
    return gso.Mesh(*ring(np.stack([*points, np.cos(polar) * np.ones_like(angle)], axis=-1)))


def _stepped_paraboloid(rng: np.random.Generator) -> gso.Mesh:
    """A paraboloid on a square lattice without the faces whose middle lies in a circle."""
    n = 44
    grid = np.stack(np.meshgrid(*2 * [np.linspace(-1.0, 1.0, n + 1)], indexing="ij"), axis=-1)
    plan, faces = net(grid)
    at = plan[faces].mean(axis=1)
    circles = [(-0.45, -0.4, 0.26), (0.4, 0.35, 0.32), (0.5, -0.5, 0.2), (-0.5, 0.5, 0.22)]
    plan, faces = without(plan, faces, _inside(at, circles))
    a, b = rng.uniform(0.25, 0.5, 2)
    return gso.Mesh(np.c_[plan, -a * plan[:, 0] ** 2 - b * plan[:, 1] ** 2], faces)


def _inside(points: Array, circles: list[tuple[float, float, float]]) -> Flags:
    """Which plan points lie in one of the circles (x, y, radius)."""
    return np.any([np.hypot(*(points - c[:2]).T) < c[2] for c in np.array(circles)], axis=0)


def _opening(rng: np.random.Generator) -> gso.Mesh:
    """A freeform grid of 48 x 36 without a block of 16 x 10 quads."""
    x, y = np.meshgrid(np.linspace(-4.0, 4.0, 49), np.linspace(-3.0, 3.0, 37), indexing="ij")
    plan, faces = net(np.stack([x, y], axis=-1))
    at = plan[faces].mean(axis=1) - [0.5, -0.3]
    plan, faces = without(plan, faces, (np.abs(at) < [4.0 / 3.0, 0.85]).all(axis=1))
    return gso.Mesh(np.c_[plan, rolling(plan, rng, 0.3, 0.08)], faces)


def _triangles(rng: np.random.Generator) -> gso.Mesh:
    """Delaunay triangles of a disc with three round holes, over a freeform height."""
    step = 0.06
    x, y = np.meshgrid(np.arange(-20, 21) * step, np.arange(-23, 24) * step * np.sqrt(0.75))
    x = x + 0.5 * step * (np.arange(47) % 2)[:, None]
    lattice = np.stack([x.ravel(), y.ravel()], axis=-1)
    circles = [(0.0, 0.0, 1.0), (0.4, 0.25, 0.2), (-0.4, 0.3, 0.24), (0.0, -0.5, 0.22)]
    keep = np.hypot(*lattice.T) < 1.0 - 0.6 * step
    rims = []
    for cx, cy, r in circles:
        count = round(2.0 * np.pi * r / step)
        angle = 2.0 * np.pi * np.arange(count) / count
        rims.append(np.c_[cx + r * np.cos(angle), cy + r * np.sin(angle)])
        keep &= np.abs(np.hypot(lattice[:, 0] - cx, lattice[:, 1] - cy) - r) > 0.6 * step
    plan = np.concatenate([lattice[keep], *rims])
    faces = Delaunay(plan).simplices.astype(np.int64)
    plan, faces = without(plan, faces, _inside(plan[faces].mean(axis=1), circles[1:]))
    return gso.Mesh(np.c_[plan, rolling(plan, rng, 0.35, 0.1)], faces)

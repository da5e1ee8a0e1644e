"""Strongly curved grids, which no developable surface is close to."""

from __future__ import annotations

import numpy as np

import gso
from designs.base import Design
from gso.typing import Array


def curved(seed: int = 0) -> list[Design]:
    """Deep domes and doubly curved strips, 1000 to 2500 faces."""
    rng = np.random.default_rng([5, seed])
    return [
        Design("deep dome", gso.Mesh.from_grid(_dome(rng.uniform(1.1, 1.25)))),
        Design("deep dome, flat top", gso.Mesh.from_grid(_vault(rng.uniform(0.8, 1.1)))),
        Design("half a torus, outside", gso.Mesh.from_grid(_torus(rng, -1.2, 1.2))),
        Design("half a torus, inside", gso.Mesh.from_grid(_torus(rng, 2.0, 4.3))),
        Design("egg box", gso.Mesh.from_grid(_egg_box(rng.uniform(0.3, 0.4)))),
        Design("twisted strip", gso.Mesh.from_grid(_helicoid(rng.uniform(1.6, 2.2)))),
    ]


def _square(n: int) -> tuple[Array, Array]:
    t = np.linspace(-1.0, 1.0, n)
    x, y = np.meshgrid(t, t, indexing="ij")
    return x, y


def _dome(reach: float) -> Array:
    """A sphere through the equal-angle map of a square: four fifths of a half."""
    u, v = _square(41)
    x, y = np.tan(0.25 * np.pi * reach * u), np.tan(0.25 * np.pi * reach * v)
    return np.stack([x, y, np.ones_like(x)], axis=-1) / np.sqrt(1.0 + x * x + y * y)[..., None]


def _vault(rise: float) -> Array:
    """A pillow over a square, steep at its sides."""
    x, y = _square(41)
    return np.stack([x, y, rise * (1.0 - x**4) * (1.0 - y**4)], axis=-1)


def _torus(rng: np.random.Generator, start: float, stop: float) -> Array:
    """A long strip of a torus, curved both ways."""
    r = rng.uniform(0.35, 0.45)
    a, b = np.meshgrid(np.linspace(0.0, np.pi, 73), np.linspace(start, stop, 25), indexing="ij")
    away = 1.0 + r * np.cos(b)
    return np.stack([away * np.cos(a), away * np.sin(a), r * np.sin(b)], axis=-1)


def _egg_box(height: float) -> Array:
    x, y = _square(49)
    return np.stack([x, y, height * np.cos(2.4 * x) * np.cos(2.4 * y)], axis=-1)


def _helicoid(turn: float) -> Array:
    """A strip that turns round its middle line, which is bent as well."""
    t, w = np.meshgrid(np.linspace(-1.0, 1.0, 65), np.linspace(-0.3, 0.3, 21), indexing="ij")
    x, z = w * np.cos(turn * t), w * np.sin(turn * t)
    return np.stack([x, 1.5 * t, z + 0.3 * t * t], axis=-1)

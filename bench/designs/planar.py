"""Designs whose quads are planar."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix, identity
from scipy.sparse.linalg import spsolve

import gso
from designs.base import Design, even, net, ring
from designs.irregular import inset, star
from gso.typing import Array, Ints


def planar(seed: int = 0) -> list[Design]:
    """Translational, scale-translational and conical nets; irregular meshes made planar."""
    rng = np.random.default_rng([3, seed])
    open_angle, closed = np.linspace(0.0, 2.0, 37), 2.0 * np.pi * np.arange(60) / 60
    return [
        Design("translational net", gso.Mesh(*net(_translational(rng, 1.0)))),
        Design("translational net, a saddle", gso.Mesh(*net(_translational(rng, -1.0)))),
        Design("scale-translational net", gso.Mesh(*net(_scaled(rng)))),
        Design("conical net, a sector", gso.Mesh(*net(_revolved(rng, open_angle)))),
        Design("conical net, a ring", gso.Mesh(*ring(_revolved(rng, closed)))),
        Design("star of five, planarised", _planarised(*star(5), 14, rng)),
        Design("inset, planarised", _planarised(*inset(3, 3, (1, 1)), 9, rng)),
    ]


def _translational(rng: np.random.Generator, sign: float) -> Array:
    """A curve moved along another one: every quad is a parallelogram."""
    s, t = np.linspace(-1.0, 1.0, 41)[:, None], np.linspace(-0.8, 0.8, 33)[None]
    a, b = rng.uniform(0.25, 0.5, 2)
    zero = s * t * 0.0
    along = np.stack([s + zero, 0.1 * np.sin(2.0 * s) + zero, a * s * s + zero], axis=-1)
    return along + np.stack([0.08 * t * t + zero, t + zero, sign * b * t * t + zero], axis=-1)


def _scaled(rng: np.random.Generator) -> Array:
    """A curve that grows along another one: every quad is a trapezium."""
    s, t = np.linspace(-1.0, 1.0, 37)[:, None], np.linspace(0.0, 2.0, 37)[None]
    size = 1.0 + 0.3 * np.sin(t + rng.uniform(0.0, 1.0))
    zero = 0.0 * s * t
    rise = rng.uniform(0.3, 0.5) * np.cos(1.5 * s)
    profile = np.stack([s + zero, 0.1 * s * s + zero, rise + zero], axis=-1)
    return size[..., None] * profile + np.stack([zero, t + zero, 0.2 * t * t + zero], axis=-1)


def _revolved(rng: np.random.Generator, angle: Array) -> Array:
    """A surface of revolution: its net of circles and meridians is conical."""
    s = np.linspace(-0.7, 0.7, 25)[:, None]
    radius = 1.0 + 0.25 * np.cos(1.8 * s) + rng.uniform(0.1, 0.3) * s
    z = s * np.ones_like(angle)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1)


def _planarised(points: Array, faces: Ints, n: int, rng: np.random.Generator) -> gso.Mesh:
    """A freeform mesh with irregular vertices, moved as little as makes its quads planar."""
    plan, quads = even(points, faces, n)
    x, y = plan.T
    height = -0.15 * (x * x + rng.uniform(0.7, 1.0) * y * y) / np.abs(plan).max()
    return gso.Mesh(planarised(np.c_[plan, height], quads), quads)


def planarised(points: Array, quads: Ints) -> Array:
    """Newton's method on the volumes of the quads, each step the shortest one."""
    m = len(quads)
    for _ in range(30):
        a, b, c = (points[quads[:, k]] - points[quads[:, 0]] for k in (1, 2, 3))
        slopes = [np.cross(b, c), np.cross(c, a), np.cross(a, b)]
        volume = (a * slopes[0]).sum(axis=1)
        length = np.linalg.norm(a, axis=1).mean()
        if np.abs(volume).max() < 1e-12 * length**3:
            break
        slope = np.stack([-sum(slopes), *slopes], axis=1)
        column = 3 * quads[..., None] + np.arange(3)
        row = np.broadcast_to(np.arange(m)[:, None, None], column.shape)
        j = csr_matrix((slope.ravel(), (row.ravel(), column.ravel())), shape=(m, points.size))
        gram = (j @ j.T).tocsc()
        gram += 1e-9 * gram.diagonal().mean() * identity(m, format="csc")
        points = points - (j.T @ spsolve(gram, volume)).reshape(-1, 3)
    return points

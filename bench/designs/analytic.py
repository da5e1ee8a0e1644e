"""Developable surfaces with known rulings, sampled on grids that are turned against these."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

Array = np.ndarray
#: Angle of the grid against the rulings, in degrees.
TURN = 30.0


class Known(NamedTuple):
    """A grid of points, and functions of points (k, 3): distances to the surface, rulings there."""

    points: Array
    distance: Callable[[Array], Array]
    ruling: Callable[[Array], Array]


def cylinder(n: int, radius: float = 0.6) -> Known:
    """Make a square piece of a circular cylinder."""
    s, t = _turned(n, 1.0)
    points = np.stack([radius * np.sin(s / radius), t, radius * np.cos(s / radius)], axis=-1)
    return Known(
        points,
        lambda x: np.abs(np.hypot(x[:, 0], x[:, 2]) - radius),
        lambda x: np.tile([0.0, 1.0, 0.0], (len(x), 1)),
    )


def cone(n: int, slope: float = 0.5) -> Known:
    """Make a square piece of a circular cone with its apex at the origin."""
    s, t = _turned(n, 1.0)
    t = t + 1.6
    size = np.sqrt(1.0 + slope**2)
    radius, angle = np.hypot(s, t) / size, np.arctan2(s, t) * size
    points = np.stack([radius * np.sin(angle), radius * np.cos(angle), -slope * radius], axis=-1)
    return Known(
        points,
        lambda x: np.abs(x[:, 2] + slope * np.hypot(x[:, 0], x[:, 1])) / size,
        lambda x: x / np.linalg.norm(x, axis=1, keepdims=True),
    )


def tangents(n: int, pitch: float = 0.4) -> Known:
    """Make a piece of the surface of tangents of a helix."""
    size = np.sqrt(1.0 + pitch**2)

    def way(t: Array) -> Array:
        return np.stack([-np.sin(t), np.cos(t), np.full_like(t, pitch)], axis=-1) / size

    def at(t: Array, w: Array) -> Array:
        curve = np.stack([np.cos(t), np.sin(t), pitch * t], axis=-1)
        return np.asarray(curve + w[..., None] * way(t))

    def nearest(x: Array) -> tuple[Array, Array]:
        w = size * np.sqrt(np.maximum(x[:, 0] ** 2 + x[:, 1] ** 2 - 1.0, 1e-9))
        t = (x[:, 2] - w * pitch / size) / pitch
        for _ in range(30):
            off, b = at(t, w) - x, way(t)
            side = np.stack([-np.cos(t), -np.sin(t), 0 * t], axis=-1) / size
            a = size * b + w[:, None] * side
            aa, ab = (a * a).sum(axis=1), (a * b).sum(axis=1)
            p, q = (a * off).sum(axis=1), (b * off).sum(axis=1)
            # The rulings b have length one.
            det = aa - ab**2
            t, w = t - (p - ab * q) / det, w - (aa * q - ab * p) / det
        return t, w

    t, w = _turned(n, 0.7)
    return Known(
        at(t, w + 1.0),
        lambda x: np.linalg.norm(at(*nearest(x)) - x, axis=1),
        lambda x: way(nearest(x)[0]),
    )


SURFACES = {"cylinder": cylinder, "cone": cone, "tangents of a helix": tangents}


def _turned(n: int, size: float) -> tuple[Array, Array]:
    """Return a square grid of parameters, turned against the axes."""
    t = np.linspace(-0.5 * size, 0.5 * size, n)
    u, v = np.meshgrid(t, t, indexing="ij")
    c, s = np.cos(np.radians(TURN)), np.sin(np.radians(TURN))
    return c * u - s * v, s * u + c * v

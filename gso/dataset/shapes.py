"""Small named splits of other shapes than Bezier surfaces, for tests of generalisation.

These are analytic families (Enneper, monkey saddle, catenoid, helicoid, sphere, torus), each
on randomly rotated, translated and scaled windows of its parameter plane, patches of the
Utah teapot, and windows of terrain. Sources of the last two: ``gso/dataset/data/README.rst``.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib.resources import files
from io import BytesIO
from typing import NamedTuple

import numpy as np

from gso.dataset.bezier import BezierSurface, normalise
from gso.dataset.seeds import Stream, generator
from gso.hierarchy import resample
from gso.typing import Array

#: Surfaces of each split.
COUNT = 8


class Family(NamedTuple):
    """A parametric surface and the distribution of its random windows.

    Attributes
    ----------
    point : callable
        Function from (u, v, shape) to (x, y, z).
    centre : (2,) of float
        Largest distance of a window's centre from the origin of the (u, v) plane.
    half : (2,) of float
        Range of half the side length of a window.
    shape : (2,) of float
        Range of the shape parameter.
    """

    point: Callable[[Array, Array, float], tuple[Array, Array, Array]]
    centre: tuple[float, float]
    half: tuple[float, float]
    shape: tuple[float, float] = (1.0, 1.0)


def enneper(u: Array, v: Array, shape: float) -> tuple[Array, Array, Array]:
    """Evaluate Enneper's minimal surface."""
    return u - u**3 / 3 + u * v**2, v - v**3 / 3 + v * u**2, u**2 - v**2


def monkey_saddle(u: Array, v: Array, shape: float) -> tuple[Array, Array, Array]:
    """Evaluate the graph of the real part of (u + iv)^3."""
    return u, v, u**3 - 3 * u * v**2


def catenoid(u: Array, v: Array, shape: float) -> tuple[Array, Array, Array]:
    """Evaluate the catenoid, the minimal surface of revolution."""
    return np.cosh(v) * np.cos(u), np.cosh(v) * np.sin(u), v


def helicoid(u: Array, v: Array, shape: float) -> tuple[Array, Array, Array]:
    """Evaluate the helicoid, the ruled minimal surface."""
    return np.sinh(v) * np.cos(u), np.sinh(v) * np.sin(u), u


def sphere(u: Array, v: Array, shape: float) -> tuple[Array, Array, Array]:
    """Evaluate the unit sphere at longitude u and latitude v."""
    return np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)


def torus(u: Array, v: Array, shape: float) -> tuple[Array, Array, Array]:
    """Evaluate a torus of radii 1 and `shape`."""
    away = 1.0 + shape * np.cos(v)
    return away * np.cos(u), away * np.sin(u), shape * np.sin(v)


FAMILIES = {
    "enneper": Family(enneper, (0.6, 0.6), (0.3, 0.8)),
    "monkey_saddle": Family(monkey_saddle, (0.3, 0.3), (0.5, 1.0)),
    "catenoid": Family(catenoid, (0.0, 0.6), (0.4, 0.9)),
    "helicoid": Family(helicoid, (0.0, 0.6), (0.4, 0.9)),
    # Windows do not reach the poles, even when rotated by 45 degrees.
    "sphere": Family(sphere, (0.0, 0.5), (0.3, 0.6)),
    "torus": Family(torus, (0.0, np.pi), (0.4, 0.9), (0.3, 0.6)),
}
NAMES = (*FAMILIES, "teapot", "terrain")


def sample(name: str, *, seed: int, size: int = 64) -> Array:
    """Sample the surfaces of a named split, (COUNT, size, size, 3), in the unit ball.

    Parameters
    ----------
    name : str
        One of :data:`NAMES`.
    seed : int
        Seed of the random windows of the analytic families.
    size : int
        Samples along each side.

    Examples
    --------
    >>> sample("torus", seed=0, size=16).shape
    (8, 16, 16, 3)
    """
    if name == "teapot":
        return np.stack([_teapot(net).sample(size) for net in _data("teapot")["net"]])
    if name == "terrain":
        return np.stack([_terrain(k, size) for k in range(COUNT)])
    number = NAMES.index(name)
    draws = [generator(seed, Stream.SHAPES, number, k) for k in range(COUNT)]
    return np.stack([normalise(_patch(FAMILIES[name], rng, size)) for rng in draws])


def _patch(family: Family, rng: np.random.Generator, size: int) -> Array:
    """Sample a random window, rotated in the parameter plane, without normalisation."""
    turn = rng.uniform(0.0, 2.0 * np.pi)
    centre = rng.uniform(-1.0, 1.0, 2) * family.centre
    half = rng.uniform(*family.half)
    shape = rng.uniform(*family.shape)
    t = half * np.linspace(-1.0, 1.0, size)
    a, b = np.meshgrid(t, t, indexing="ij")
    u = centre[0] + a * np.cos(turn) - b * np.sin(turn)
    v = centre[1] + a * np.sin(turn) + b * np.cos(turn)
    return np.stack(family.point(u, v, shape), axis=-1)


def _teapot(net: Array) -> BezierSurface:
    # Reverses the published order of columns, so that normals point outwards.
    return BezierSurface(net, np.array([[0.0, 1.0], [1.0, 0.0]]))


def _terrain(k: int, size: int) -> Array:
    data = _data("terrain")
    height = data["elevation"][k].astype(float)
    rows, columns = (np.arange(n) for n in height.shape)
    north, east = np.meshgrid(
        -rows * data["spacing"][0], columns * data["spacing"][1], indexing="ij"
    )
    points = np.stack([east, north, height], axis=-1)
    return normalise(points if size == len(rows) else resample(points, size, size))


@cache
def _data(name: str) -> dict[str, np.ndarray]:
    """Read the arrays of a data file of this package."""
    content = (files("gso.dataset") / "data" / f"{name}.npz").read_bytes()
    with np.load(BytesIO(content), allow_pickle=False) as arrays:
        return dict(arrays)

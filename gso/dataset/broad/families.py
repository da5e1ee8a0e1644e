"""Families of random surfaces beside the recipe's: what architects and engineers draw.

A family is a function from a random generator to a surface, which is a function from parameters
(u, v) in [-1, 1]^2 to points. :data:`FAMILIES` says in which splits of the broad set it stands:
the families of validation and of the test are not trained on. SciPy is imported where a family
needs it: most sets have no surface of these families.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gso.dataset.seeds import RNG
from gso.typing import Array, Ints

if TYPE_CHECKING:
    from scipy.sparse import csc_array

#: A surface: points (H, W, 3) at parameters u and v (H, W).
Surface = Callable[[Array, Array], Array]
#: Largest ratio of the sides of a surface.
_LONGEST = 4.0
#: Vertices along a side of what is made as a grid, and of a generated terrain.
_SHELL, _TERRAIN = 33, 257


class Family(NamedTuple):
    """A family of surfaces, and the split of the broad set with its members."""

    draw: Callable[[RNG], Surface]
    split: str


def _sides(rng: RNG) -> tuple[float, float]:
    """Draw the half sides of a domain, the larger one 1, with a ratio of 1 to `_LONGEST`."""
    short = _LONGEST ** -rng.uniform(0.0, 1.0)
    return (1.0, short) if rng.random() < 0.5 else (short, 1.0)


def _amplitude(rng: RNG, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _wave(rng: RNG, terms: int = 4) -> Callable[[Array], Array]:
    """Draw a smooth function on [-1, 1] with values of about 1: a short Fourier series."""
    number = np.arange(1, terms + 1)
    size = rng.normal(size=terms) / number**1.5
    phase = rng.uniform(0.0, 2.0 * np.pi, terms)
    period = rng.uniform(0.35, 0.8)

    def wave(t: Array) -> Array:
        angle = np.pi * period * number * np.asarray(t)[..., None] + phase
        return np.asarray((size * np.sin(angle)).sum(axis=-1))

    return wave


def b_spline(rng: RNG) -> Surface:
    """Draw a B-spline surface of degrees 2 to 5 whose knots have random distances."""
    degrees = rng.integers(2, 6, 2)
    counts = degrees + rng.integers(1, 10, 2)
    sides = _sides(rng)
    knots = [_knots(rng, int(d), int(n)) for d, n in zip(degrees, counts, strict=True)]
    # Control points above the Greville abscissae make the identity; they are moved from there.
    at = [
        np.array([k[i + 1 : i + d + 1].mean() for i in range(n)])
        for k, d, n in zip(knots, degrees, counts, strict=True)
    ]
    x, y = np.meshgrid(sides[0] * at[0], sides[1] * at[1], indexing="ij")
    step = 2.0 * min(sides) / max(counts)
    net = np.stack([x, y, np.zeros_like(x)], axis=-1)
    net[..., :2] += rng.uniform(0.0, 0.8) * step * rng.uniform(-1.0, 1.0, (*counts, 2))
    net[..., 2] = _amplitude(rng, 0.1, 1.2) * min(sides) * rng.uniform(-1.0, 1.0, counts)

    def surface(u: Array, v: Array) -> Array:
        from scipy.interpolate import BSpline

        along, across = (
            BSpline.design_matrix(np.clip(t.ravel(), -1.0, 1.0), k, d).tocsr()
            for t, k, d in zip((u, v), knots, degrees, strict=True)
        )
        rows = along @ net.reshape(counts[0], -1)
        rows = rows.reshape(u.size, counts[1], 3)
        return np.asarray(np.einsum("nj,njd->nd", across.toarray(), rows).reshape(*u.shape, 3))

    return surface


def _knots(rng: RNG, degree: int, count: int) -> Array:
    spans = rng.uniform(0.4, 1.6, count - degree)
    inner = 2.0 * np.cumsum(spans) / spans.sum() - 1.0
    return np.concatenate([np.full(degree + 1, -1.0), inner[:-1], np.full(degree + 1, 1.0)])


def translational(rng: RNG) -> Surface:
    """Draw a surface of translation: a curve that is moved along another one."""
    a, b = _sides(rng)
    first, second, tilt = _wave(rng), _wave(rng), rng.normal(size=2) * 0.3
    size = _amplitude(rng, 0.08, 0.7) * np.array([a, b])

    def surface(u: Array, v: Array) -> Array:
        p, q = size[0] * first(u), size[1] * second(v)
        return np.stack([a * u + tilt[0] * q, b * v + tilt[1] * p, p + q], axis=-1)

    return surface


def rotational(rng: RNG) -> Surface:
    """Draw a sector of a surface of revolution."""
    length, angle = _amplitude(rng, 0.4, 2.0), rng.uniform(0.4, 2.6)
    wave, size, lean = _wave(rng), _amplitude(rng, 0.05, 0.5), rng.uniform(-0.4, 0.4)

    def surface(u: Array, v: Array) -> Array:
        radius = 1.0 + size * wave(u) + lean * u
        turn = 0.5 * angle * v
        return np.stack([radius * np.cos(turn), radius * np.sin(turn), length * u], axis=-1)

    return surface


def terrain(rng: RNG) -> Surface:
    """Draw the graph of a random height whose spectrum falls with a power of the frequency."""
    n, power = _TERRAIN, rng.uniform(3.0, 5.0)
    rough = np.fft.rfftfreq(2 * n), np.fft.fftfreq(2 * n)
    frequency = np.hypot(rough[1][:, None], rough[0])
    spectrum = np.zeros_like(frequency)
    high = rng.uniform(4.0, 24.0) / n
    some = (frequency > 0) & (frequency < high)
    spectrum[some] = (frequency[some] * n) ** (-power / 2)
    phase = rng.normal(size=(*spectrum.shape, 2)) @ np.array([1.0, 1j])
    height = np.fft.irfft2(spectrum * phase, (2 * n, 2 * n))[:n, :n]
    height *= _amplitude(rng, 0.01, 0.3) / max(float(height.std()), 1e-12)
    return _graph(height, _sides(rng))


def subdivided(rng: RNG) -> Surface:
    """Draw a coarse net of quads, subdivided a few times (Catmull and Clark 1978)."""
    sides = _sides(rng)
    shape = rng.integers(3, 8, 2)
    x, y = np.meshgrid(
        *(np.linspace(-s, s, n) for s, n in zip(sides, shape, strict=True)), indexing="ij"
    )
    net = np.stack([x, y, np.zeros_like(x)], axis=-1)
    step = 2.0 * min(sides) / max(shape)
    net += rng.uniform(-0.3, 0.3, net.shape) * step
    net[..., 2] += _amplitude(rng, 0.1, 0.8) * min(sides) * rng.uniform(-1.0, 1.0, shape)
    for _ in range(rng.integers(3, 5)):
        net = np.swapaxes(_finer(np.swapaxes(_finer(net), 0, 1)), 0, 1)
    return _grid(net)


def _finer(rows: Array) -> Array:
    """Subdivide the rows of a net by the cubic rule, with the ends of columns kept."""
    out = np.empty((2 * len(rows) - 1, *rows.shape[1:]))
    out[1::2] = 0.5 * (rows[1:] + rows[:-1])
    out[0::2] = rows
    out[2:-1:2] = 0.75 * rows[1:-1] + 0.125 * (rows[:-2] + rows[2:])
    return out


def sheet(rng: RNG) -> Surface:
    """Draw a bent sheet, a cylinder or cone over a curve, with or without a dent."""
    a, b = _sides(rng)
    wave, size, apex = _wave(rng), _amplitude(rng, 0.05, 0.8), rng.uniform(1.5, 6.0)
    dent = rng.choice([0.0, _amplitude(rng, 0.005, 0.1)])
    middle, width = rng.uniform(-0.7, 0.7, 2), rng.uniform(0.2, 0.6)
    turn, cone = rng.uniform(0.0, np.pi), rng.random() < 0.5

    def surface(u: Array, v: Array) -> Array:
        x, y = a * u, b * v
        p, q = x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)
        if cone:
            # Every point moves along its ray from the apex (apex, 0, 0).
            angle = q / (apex - p)
            points = np.stack([p, q, size * (apex - p) / apex * wave(angle * apex)], axis=-1)
        else:
            points = np.stack([p, q, size * wave(p)], axis=-1)
        away = ((u - middle[0]) ** 2 + (v - middle[1]) ** 2) / width**2
        points[..., 2] += dent * np.exp(-away)
        return points

    return surface


def minimal(rng: RNG) -> Surface:
    """Draw a minimal surface by Weierstrass' representation, with polynomials."""
    count = rng.integers(1, 4)
    f = rng.normal(size=(count, 2)) @ np.array([1.0, 1j]) * 0.5 ** np.arange(count)[::-1]
    g = rng.normal(size=(rng.integers(2, 4), 2)) @ np.array([1.0, 1j])
    one = np.poly1d([1.0])
    first, second = np.poly1d(f), np.poly1d(rng.uniform(0.3, 0.9) * g)
    square = second * second
    parts = [(0.5 * first * (one - square)), (0.5j * first * (one + square)), first * second]
    a, b = (rng.uniform(0.4, 0.9) * side for side in _sides(rng))
    whole = [part.integ() for part in parts]

    def surface(u: Array, v: Array) -> Array:
        w = a * u + 1j * b * v
        return np.stack([part(w).real for part in whole], axis=-1)

    return surface


def constant_mean_curvature(rng: RNG) -> Surface:
    """Draw a sector of an unduloid, a surface of revolution of constant mean curvature."""
    from scipy.integrate import solve_ivp

    neck = rng.uniform(0.15, 0.9)
    # Mean curvature 1/2: the meridian's curvature and that of the parallels add to 1, and the
    # radius is between the neck's and 2 minus that.
    length = rng.uniform(1.5, 5.0)

    def slope(_: float, state: Array) -> list[float]:
        radius, _, angle = state
        return [np.cos(angle), np.sin(angle), 1.0 - np.sin(angle) / radius]

    start = [neck, 0.0, 0.5 * np.pi]
    whole = solve_ivp(slope, (0.0, length), start, rtol=1e-9, atol=1e-11, dense_output=True)
    begin, end = length * np.sort(rng.uniform(0.0, 1.0, 2))
    begin, end = (begin, end) if end - begin > 0.25 * length else (0.0, length)
    angle = rng.uniform(0.5, 2.8)

    def surface(u: Array, v: Array) -> Array:
        t = begin + (end - begin) * 0.5 * (u + 1.0)
        radius, height, _ = whole.sol(t.ravel()).reshape(3, *t.shape)
        turn = 0.5 * angle * v
        return np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=-1)

    return surface


def grid_shell(rng: RNG) -> Surface:
    """Draw a shell in equilibrium under a load, by the force density method (Schek 1974)."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    n, sides = _SHELL, _sides(rng)
    i, j = np.meshgrid(*(np.linspace(-1.0, 1.0, n),) * 2, indexing="ij")
    bow = rng.uniform(-0.25, 0.25, 4)
    x = sides[0] * (i + (0.5 * (1 + i) * bow[0] + 0.5 * (1 - i) * bow[1]) * (1 - j**2))
    y = sides[1] * (j + (0.5 * (1 + j) * bow[2] + 0.5 * (1 - j) * bow[3]) * (1 - i**2))
    fixed = _supports(rng, n)
    grid = np.arange(n * n).reshape(n, n)
    edges = np.concatenate(
        [
            np.stack([grid[1:].ravel(), grid[:-1].ravel()], 1),
            np.stack([grid[:, 1:].ravel(), grid[:, :-1].ravel()], 1),
        ]
    )
    force = np.ones(len(edges))
    force[: len(edges) // 2] *= rng.uniform(0.5, 2.0)
    rim = np.zeros((n, n), bool)
    rim[[0, -1]] = rim[:, [0, -1]] = True
    on = rim.ravel()
    # Edges of free boundaries carry more.
    force[on[edges].all(axis=1)] *= rng.uniform(4.0, 12.0)
    stiff = _laplacian(edges, force, n * n)
    points = np.stack([x.ravel(), y.ravel(), np.zeros(n * n)], axis=1)
    points[fixed, 2] = 0.2 * rng.normal(size=1) * np.sign(points[fixed, 0])
    free = np.setdiff1d(np.arange(n * n), fixed)
    load = np.zeros((n * n, 3))
    load[:, 2] = 4.0 / n**2
    right = load[free] - stiff[free][:, fixed] @ points[fixed]
    points[free] = splu(csc_array(stiff[free][:, free])).solve(right)
    rise = np.ptp(points[:, 2])
    points[:, 2] *= rng.uniform(0.15, 0.6) * min(sides) * 2.0 / max(rise, 1e-9)
    return _grid(points.reshape(n, n, 3))


def _supports(rng: RNG, n: int) -> Ints:
    """Draw which vertices of a grid are supported: all sides, two sides, or around corners."""
    grid = np.arange(n * n).reshape(n, n)
    kind = rng.integers(3)
    if kind == 0:
        return np.unique(np.concatenate([grid[0], grid[-1], grid[:, 0], grid[:, -1]]))
    if kind == 1:
        return np.concatenate([grid[0], grid[-1]])
    some = int(rng.integers(2, n // 4))
    ends = [grid[0, :some], grid[0, -some:], grid[-1, :some], grid[-1, -some:]]
    return np.unique(np.concatenate(ends))


def _laplacian(edges: Ints, weight: Array, count: int) -> csc_array:
    from scipy.sparse import coo_array, csc_array

    i, j = edges.T
    rows, columns = np.concatenate([i, j, i, j]), np.concatenate([i, j, j, i])
    values = np.concatenate([weight, weight, -weight, -weight])
    return csc_array(coo_array((values, (rows, columns)), shape=(count, count)))


def _graph(height: Array, sides: tuple[float, float]) -> Surface:
    x, y = (np.linspace(-s, s, n) for s, n in zip(sides, height.shape, strict=True))
    grid = np.stack([*np.meshgrid(x, y, indexing="ij"), height * min(sides)], axis=-1)
    return _grid(grid)


def _grid(points: Array) -> Surface:
    """Return the surface of a grid of points, interpolated by cubic splines."""
    from scipy.interpolate import RectBivariateSpline

    h, w = points.shape[:2]
    at = np.linspace(-1.0, 1.0, h), np.linspace(-1.0, 1.0, w)
    parts = [RectBivariateSpline(*at, points[..., k]) for k in range(3)]

    def surface(u: Array, v: Array) -> Array:
        return np.stack([part.ev(u, v) for part in parts], axis=-1)

    return surface


FAMILIES = {
    "b_spline": Family(b_spline, "train"),
    "translational": Family(translational, "train"),
    "rotational": Family(rotational, "train"),
    "terrain": Family(terrain, "train"),
    "subdivided": Family(subdivided, "train"),
    "sheet": Family(sheet, "train"),
    "minimal": Family(minimal, "validation"),
    "constant_mean_curvature": Family(constant_mean_curvature, "test"),
    "grid_shell": Family(grid_shell, "test"),
}

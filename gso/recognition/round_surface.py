"""Cylinders and right circular cones: their equations, and fits to many sets of points at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gso.geometry.vectors import cross
from gso.typing import Array, Flags

#: Steps of Gauss-Newton at most, and the damping at the start.
_STEPS, _DAMPING = 25, 1e-3
#: Decrease of the sum of squares, relative to it, that ends the steps.
_ENOUGH = 1e-9
#: Decrease of the sum of squares in a step that is slow, and number of slow steps.
_SLOW, _PATIENCE = 0.5, 3
#: Damping that no step overcomes, and a mean square that is rounding error.
_STUCK, _NOTHING = 1e3, 1e-28
#: Largest gradient of a quadric with coefficients of norm one, and rounding errors of its values.
_STEEPEST, _ROUNDING = 8.0, 2e-7


@dataclass(frozen=True)
class RoundSurface:
    """A cylinder or a right circular cone.

    Attributes
    ----------
    centre : ndarray, (3,)
        A point on the axis.
    axis : ndarray, (3,)
        Unit vector, towards growing radii.
    radius : float
        Radius at the centre.
    slope : float
        Growth of the radius per length along the axis: the tangent of the half angle, 0 for a
        cylinder.
    """

    centre: Array
    axis: Array
    radius: float
    slope: float = 0.0

    @property
    def half_angle(self) -> float:
        """Angle between the axis and the rulings, in radians."""
        return float(np.arctan(self.slope))

    @property
    def apex(self) -> Array | None:
        """The point where the rulings meet; None for a cylinder."""
        return None if self.slope == 0 else self.centre - self.radius / self.slope * self.axis

    @cached_property
    def _across(self) -> tuple[Array, Array]:
        """Two directions that form a right-handed frame with the axis."""
        return _frames(self.axis[None])[0][0], _frames(self.axis[None])[1][0]

    def coordinates(self, points: Array) -> tuple[Array, Array, Array]:
        """Return angle around the axis, distance from it and height along it, of points (k, 3)."""
        d = points - self.centre
        x, y = d @ self._across[0], d @ self._across[1]
        return np.arctan2(y, x), np.hypot(x, y), d @ self.axis

    def distances(self, points: Array) -> Array:
        """Return signed distances of points (k, 3), positive outside."""
        _, rho, height = self.coordinates(points)
        return np.asarray((rho - self.radius - self.slope * height) * np.cos(self.half_angle))

    def normals(self, points: Array) -> Array:
        """Return outward unit normals at points (k, 3)."""
        angle = self.coordinates(points)[0][:, None]
        out = np.cos(angle) * self._across[0] + np.sin(angle) * self._across[1]
        return np.asarray((out - self.slope * self.axis) * np.cos(self.half_angle))

    def rulings(self, points: Array) -> Array:
        """Return unit directions (k, 3) of the rulings through points."""
        angle = self.coordinates(points)[0][:, None]
        out = np.cos(angle) * self._across[0] + np.sin(angle) * self._across[1]
        return np.asarray((self.axis + self.slope * out) * np.cos(self.half_angle))

    def point(self, angle: Array, height: Array) -> Array:
        """Return the points (k, 3) at angles around the axis and heights along it."""
        out = np.cos(angle)[:, None] * self._across[0] + np.sin(angle)[:, None] * self._across[1]
        radius = self.radius + self.slope * height
        return np.asarray(self.centre + height[:, None] * self.axis + radius[:, None] * out)


@dataclass(frozen=True)
class Fits:
    """Round surfaces fitted to b sets of points.

    Attributes
    ----------
    centre, axis : ndarray, (b, 3)
    radius, slope, worst : ndarray, (b,)
        `worst` is the largest distance of a point.
    """

    centre: Array
    axis: Array
    radius: Array
    slope: Array
    worst: Array

    def surface(self, k: int) -> RoundSurface:
        """Return the k-th one, its axis towards growing radii."""
        sign = -1.0 if self.slope[k] < 0 else 1.0
        return RoundSurface(
            self.centre[k], sign * self.axis[k], float(self.radius[k]), float(abs(self.slope[k]))
        )


def fit_round(
    points: Array, given: Flags, axis: Array, *, conical: bool, goal: float = 0.0
) -> Fits:
    """Fit cylinders or cones to sets of points by least squares of distances.

    A linear fit with the given axes is the start of damped Gauss-Newton steps, of all sets at
    once.

    Parameters
    ----------
    points : ndarray, (b, k, 3)
        Sets of points.
    given : ndarray of bool, (b, k)
        Which of the points count.
    axis : ndarray, (b, 3)
        Unit directions of the axes at the start.
    conical : bool
        Fit cones, otherwise cylinders.
    goal : float
        Root mean square distance above which sets that converge slowly are given up.

    Examples
    --------
    >>> angle, height = np.meshgrid([0.0, 0.4, 0.9, 1.3], [0.0, 2.0])
    >>> wall = np.stack([5 * np.cos(angle), 5 * np.sin(angle), height], axis=-1).reshape(1, -1, 3)
    >>> found = fit_round(wall, np.ones((1, 8), bool), np.array([[0.0, 0.1, 0.995]]), conical=False)
    >>> found.radius.round(6), found.axis.round(6) + 0.0
    (array([5.]), array([[0., 0., 1.]]))
    """
    weight = given.astype(float)
    count = np.maximum(weight.sum(axis=1), 1.0)
    middle = np.einsum("bk,bkd->bd", weight, points) / count[:, None]
    local = (points - middle[:, None]) * weight[..., None]
    size = np.sqrt(np.maximum((local**2).sum(axis=(1, 2)) / count, 1e-300))
    local = local / size[:, None, None]
    axis = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    centre, radius, slope = _linear_start(local, weight, axis, conical)
    free = 6 if conical else 5
    damping = np.full(len(points), _DAMPING)
    state = np.concatenate([centre, axis, radius[:, None], slope[:, None]], axis=1)
    best = np.full(len(points), np.inf)
    live, tried, slow = np.arange(len(points)), state, np.zeros(len(points), np.int64)
    for _ in range(_STEPS):
        residual, jacobian = _residuals(local[live], weight[live], tried)
        cost = (residual**2).sum(axis=1)
        before = best[live]
        better = cost < before
        won = live[better]
        state[won], best[won] = tried[better], cost[better]
        settled = np.isfinite(before) & (cost >= (1.0 - _ENOUGH) * before)
        done = better & (settled | (cost < _NOTHING * count[live]))
        damping[live] *= np.where(better, 0.1, 10.0)
        far = np.minimum(cost, before) > count[live] * (goal / size[live]) ** 2
        slow[live] += far & ~(cost < _SLOW * before)
        going = ~done & (damping[live] < _STUCK) & (slow[live] < _PATIENCE)
        if not going.any():
            break
        # A step that failed is tried again from the old state, with more damping.
        live, better = live[going], better[going]
        residual, jacobian = residual[going], jacobian[going]
        if not better.all():
            residual[~better], jacobian[~better] = _residuals(
                local[live[~better]], weight[live[~better]], state[live[~better]]
            )
        tried = _stepped(state[live], residual, jacobian[..., :free], damping[live])
    worst = np.abs(_residuals(local, weight, state)[0]).max(axis=1) * size
    centre, axis, radius, slope = state[:, :3], state[:, 3:6], state[:, 6], state[:, 7]
    return Fits(middle + centre * size[:, None], axis, radius * size, slope, worst)


def _stepped(state: Array, residual: Array, jacobian: Array, damping: Array) -> Array:
    """Take a damped Gauss-Newton step; states are rows of centre, axis, radius and slope."""
    transposed = jacobian.transpose(0, 2, 1)
    normal = transposed @ jacobian
    bulk = np.einsum("bii->bi", normal)
    scaled = damping[:, None] * bulk + 1e-15 * (1.0 + bulk.max(axis=1, keepdims=True))
    np.einsum("bii->bi", normal)[:] += scaled
    step = np.linalg.solve(normal, -(transposed @ residual[..., None]))[..., 0].clip(-1.0, 1.0)
    e1, e2 = _frames(state[:, 3:6])
    new = state.copy()
    new[:, :3] += step[:, :1] * e1 + step[:, 1:2] * e2
    new[:, 3:6] += step[:, 2:3] * e1 + step[:, 3:4] * e2
    new[:, 3:6] /= np.linalg.norm(new[:, 3:6], axis=1, keepdims=True)
    new[:, 6 : 2 + step.shape[1]] += step[:, 4:]
    return np.asarray(new)


def fit_quadrics(points: Array, given: Flags) -> tuple[Array, Array]:
    """Fit quadrics to sets of points, a quick test before cylinders and cones are fitted.

    Parameters
    ----------
    points : ndarray, (b, k, 3)
        Sets of points.
    given : ndarray of bool, (b, k)
        Which of the points count.

    Returns
    -------
    off : ndarray, (b,)
        Lower bound of the root mean square distance of the points from a quadric.
    axis : ndarray, (b, 3)
        Axis of the quadric if it is one of revolution.
    """
    count = np.maximum(given.sum(axis=1), 1)
    local = points - (points * given[..., None]).sum(axis=1, keepdims=True) / count[:, None, None]
    local = local * given[..., None]
    size = np.sqrt(np.maximum((local**2).sum(axis=(1, 2)) / count, 1e-300))
    x, y, z = np.moveaxis(local / size[:, None, None], -1, 0)
    terms = [x * x, y * y, z * z, x * y, x * z, y * z, x, y, z, given.astype(float)]
    table = np.stack(terms, axis=-1)
    values, vectors = np.linalg.eigh(table.transpose(0, 2, 1) @ table)
    off = np.sqrt(np.maximum(values[:, 0], 0.0) / count)
    q = vectors[:, :, 0]
    half = q[:, 3:6] / 2
    form = np.stack(
        [q[:, 0], half[:, 0], half[:, 1], half[:, 0], q[:, 1], half[:, 2], half[:, 1], half[:, 2],
         q[:, 2]], axis=1,
    )  # fmt: skip
    levels, directions = np.linalg.eigh(form.reshape(-1, 3, 3))
    # Of the three, two are equal.
    first = levels[:, 1] - levels[:, 0] > levels[:, 2] - levels[:, 1]
    axis = np.where(first[:, None], directions[:, :, 0], directions[:, :, 2])
    return np.asarray(np.maximum(off - _ROUNDING, 0.0) * size / _STEEPEST), axis


def _frames(axis: Array) -> tuple[Array, Array]:
    """Return two unit vectors across each axis (b, 3), right-handed with it."""
    least = np.eye(3)[np.abs(axis).argmin(axis=1)]
    e1 = cross(least, axis)
    e1 /= np.linalg.norm(e1, axis=1, keepdims=True)
    return e1, cross(axis, e1)


def _linear_start(
    local: Array, weight: Array, axis: Array, conical: bool
) -> tuple[Array, Array, Array]:
    """Fit the circle that grows linearly along given axes: centre, radius, slope."""
    e1, e2 = _frames(axis)
    x, y, z = (np.einsum("bkd,bd->bk", local, e) for e in (e1, e2, axis))
    columns = [2 * x, 2 * y, np.ones_like(x), *([z, z * z] if conical else [])]
    table = np.stack(columns, axis=-1) * weight[..., None]
    normal = np.einsum("bki,bkj->bij", table, table)
    bulk = np.einsum("bii->bi", normal).max(axis=1)
    normal += 1e-13 * bulk[:, None, None] * np.eye(len(columns))
    right = np.einsum("bki,bk->bi", table, x * x + y * y)
    found = np.linalg.solve(normal, right[..., None])[..., 0]
    cx, cy = found[:, 0], found[:, 1]
    radius = np.sqrt(np.maximum(found[:, 2] + cx**2 + cy**2, 1e-12))
    slope = found[:, 3] / (2 * radius) if conical else np.zeros(len(axis))
    return cx[:, None] * e1 + cy[:, None] * e2, radius, np.clip(slope, -10.0, 10.0)


def _residuals(local: Array, weight: Array, state: Array) -> tuple[Array, Array]:
    """Return distances (b, k) and their derivatives (b, k, 6) by centre, axis, radius, slope."""
    centre, axis, radius, slope = state[:, :3], state[:, 3:6], state[:, 6], state[:, 7]
    e1, e2 = _frames(axis)
    d = local - centre[:, None]
    z = np.einsum("bkd,bd->bk", d, axis)
    x, y = np.einsum("bkd,bd->bk", d, e1), np.einsum("bkd,bd->bk", d, e2)
    rho = np.maximum(np.hypot(x, y), 1e-12)
    scale = weight / np.sqrt(1.0 + slope**2)[:, None]
    m = slope[:, None]
    u, v = x / rho, y / rho
    residual = (rho - radius[:, None] - m * z) * scale
    parts = [-u, -v, -z * u - m * x, -z * v - m * y, -np.ones_like(z), -z]
    return residual, np.stack(parts, axis=-1) * scale[..., None]

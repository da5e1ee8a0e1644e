"""Remove noise from grids with creases: folded paper, roofs, mitred sheets.

The squared penalties of :mod:`gso.smoothing.grid_smoothing` round creases off and cause ripples
beside them. Here each second difference is split into a *kink* z, whose length is penalised, and a
*bend* w, whose change along its grid line is penalised: a second-order relative of total
generalised variation (Bredies, Kunisch and Pock 2010),

    1/2 |x - p|^2 + weight sigma sum |z| + c/2 sum |diff w|^2,     diff2 x = z + w,

with z and w vectors in space. Kinks become sparse, so that pieces between creases are smooth,
or flat if c is infinite. Reweighting (Candes, Wakin and Boyd 2008) keeps the penalty from
flattening the remaining creases.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gso.smoothing.base import Smoothed, checked_options, to_unit
from gso.smoothing.grid_smoothing import estimate
from gso.typing import Array

ORDERS = (2, 3)
DEFAULT_WEIGHT = 3.0
# Weights c of changes of the bend, relative to the penalty parameter of the splitting, for
# 64 samples; with inf there is no bend. Stein's risk estimate selects the best one.
STIFFNESS = (np.inf, 1e5, 1e4, 1e3, 1e2, 1e1)
ITERATIONS = 60
REWEIGHTED_AT = (20, 30, 40)
# Lengths in units of the noise: the kink whose weight reweighting halves, the most by which one
# iteration shrinks a kink, and the amplitude of the random probe.
KINK = 0.3
STEP = 0.5
PROBE = 0.1


def smooth_creased_grid(
    points: Array, *, order: int | None = None, weight: float | None = None
) -> Smoothed:
    """Smooth a noisy grid and preserve its creases.

    Parameters
    ----------
    points : ndarray, (H, W, 3)
        Noisy surface, finite, from 3 x 3 up.
    order : {2, 3}, optional
        2: pieces between creases are flat; 3: they are smooth. Chosen from the data by default.
    weight : float, optional
        Weight of the kinks in units of the noise, 3 by default.

    Returns
    -------
    Smoothed
        `sigma` is that of :func:`gso.smoothing.grid_smoothing.smooth_grid`; `dof` is estimated with
        a random probe.

    Notes
    -----
    Solved by the alternating direction method of multipliers (Boyd et al. 2011), whose linear
    step is diagonal in the eigenvectors of two small matrices. The weight c minimises Stein's
    unbiased risk estimate (1981), with the divergence estimated by a random probe as in Ramani,
    Blu and Unser (2008).

    Examples
    --------
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 33), np.linspace(-1, 1, 33), indexing="ij")
    >>> roof = np.stack([u, v, np.abs(u)], axis=-1)
    >>> noise = 0.01 * np.random.default_rng(0).standard_normal(roof.shape)
    >>> error = smooth_creased_grid(roof + noise).points - roof
    >>> bool(np.abs(error).max() < 0.01)
    True
    """
    checked_options(order, ORDERS, weight, "l1")
    charge = DEFAULT_WEIGHT if weight is None else float(weight)
    unit, frame, rounding = to_unit(points)
    sigma = float(np.sqrt(estimate(unit, 2, rounding, None)[0].variance))
    if charge == 0 or sigma < 10 * rounding:
        spent = float(unit[..., 0].size)
        return Smoothed(points.copy(), order or 2, charge, frame.scale * sigma, spent)
    turn = _attached_frame(unit)
    data = np.moveaxis(unit @ turn, 2, 0) / sigma
    probe = np.random.default_rng(0).choice([-1.0, 1.0], data.shape)
    pair = np.stack([data, data + PROBE * probe])
    state: State | None = None
    trials = []
    for stiffness in _stiffnesses(order, max(unit.shape[:2])):
        (smooth, probed), state = _split(pair, charge, stiffness, state)
        dof = float(((probed - smooth) * probe).sum()) / PROBE
        risk = float(((smooth - data) ** 2).sum()) + 2 * dof
        trials.append((risk, stiffness, dof, smooth))
    _, stiffness, dof, smooth = min(trials, key=lambda trial: trial[0])
    return Smoothed(
        points=frame.to_user(sigma * np.moveaxis(smooth, 0, 2) @ turn.T),
        order=2 if np.isinf(stiffness) else 3,
        weight=charge,
        sigma=frame.scale * sigma,
        dof=dof / 3,
    )


def _attached_frame(unit: Array) -> Array:
    """Compute axes (3, 3) that rotate with the grid, and with them the random probe."""
    height, width = unit.shape[:2]
    along_u = np.linspace(-1, 1, height) @ unit.sum(axis=1)
    along_v = np.linspace(-1, 1, width) @ unit.sum(axis=0)
    left, _, right = np.linalg.svd(np.stack([along_u, along_v], axis=1), full_matrices=False)
    tangents = left @ right
    return np.column_stack([tangents, np.cross(*tangents.T)])


def _stiffnesses(order: int | None, n: int) -> list[float]:
    """List the candidate weights c; they grow on fine grids, where w changes less per sample."""
    if order == 2:
        return [np.inf]
    finer = max(1.0, n / 64) ** 4
    return [s * finer for s in STIFFNESS if order is None or np.isfinite(s)]


@dataclass(frozen=True)
class Axis:
    """Second differences along one axis, with the optimal bend w eliminated.

    Attributes
    ----------
    resist : ndarray, (n - 2, n - 2)
        Maps a second difference to its remainder after the optimal bend is subtracted.
    spread : ndarray, (n, n - 2)
        `resist` followed by the transposed second difference.
    values, vectors : ndarray
        Eigendecomposition of the penalty on the n samples.
    """

    resist: Array
    spread: Array
    values: Array
    vectors: Array


@lru_cache(maxsize=32)
def _axis(n: int, stiffness: float) -> Axis:
    second = np.diff(np.eye(n), 2, axis=0)
    resist = np.eye(n - 2)
    if np.isfinite(stiffness):
        change = np.diff(np.eye(n - 2), axis=0)
        resist = resist - np.linalg.inv(np.eye(n - 2) + stiffness * change.T @ change)
    values, vectors = np.linalg.eigh(second.T @ resist @ second)
    return Axis(resist, second.T @ resist, np.maximum(values, 0.0), vectors)


#: Kinks and scaled multipliers, each along both grid directions.
State = tuple[list[Array], list[Array]]


def _split(
    data: Array, charge: float, stiffness: float, start: State | None
) -> tuple[Array, State]:
    """Minimise the energy for a batch (b, 3, H, W) in units of the noise."""
    along_u, along_v = (_axis(n, stiffness) for n in data.shape[2:])
    rho = charge / STEP
    keep = 1 / (1 + rho * (along_u.values[:, None] + along_v.values))
    zeros = [np.zeros_like(data[:, :, 2:]), np.zeros_like(data[..., 2:])]
    kinks, duals = (zeros, zeros) if start is None else start
    charges: list[Array | float] = [1.0, 1.0]
    smooth = data
    for iteration in range(ITERATIONS):
        if iteration in REWEIGHTED_AT:
            charges = [KINK / (KINK + _length(kink)) for kink in kinks]
        aim_u, aim_v = (kink - dual for kink, dual in zip(kinks, duals, strict=True))
        pull = data + rho * (along_u.spread @ aim_u + aim_v @ along_v.spread.T)
        inner = along_u.vectors.T @ pull @ along_v.vectors
        smooth = along_u.vectors @ (keep * inner) @ along_v.vectors.T
        bent_u = smooth[:, :, 2:] - 2 * smooth[:, :, 1:-1] + smooth[:, :, :-2]
        bent_v = smooth[..., 2:] - 2 * smooth[..., 1:-1] + smooth[..., :-2]
        targets = [
            aim_u + along_u.resist @ (bent_u - aim_u) + duals[0],
            aim_v + (bent_v - aim_v) @ along_v.resist + duals[1],
        ]
        duals = [_clip(target, STEP * c) for target, c in zip(targets, charges, strict=True)]
        kinks = [target - dual for target, dual in zip(targets, duals, strict=True)]
    return smooth, (kinks, duals)


def _length(vectors: Array) -> Array:
    return np.asarray(np.sqrt((vectors**2).sum(axis=1, keepdims=True)))


def _clip(vectors: Array, radius: Array | float) -> Array:
    """Shorten vectors (b, 3, ...) to at most a radius."""
    return vectors * np.minimum(1.0, radius / np.maximum(_length(vectors), 1e-300))

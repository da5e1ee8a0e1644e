"""Noise removal from any mesh of triangles and quads, open or closed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gso.mesh import Mesh
from gso.smoothing.base import Smoothed, checked_options, to_unit
from gso.smoothing.local_fits import Residuals, Rings, neighbours, residuals, rings, umbrella
from gso.smoothing.select import Choice, best_weight, factoring, gcv, largest_weight, unbiased_risk
from gso.typing import Array

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix, csr_matrix

ORDERS = (2, 3, 4)
# Cost of degrees of freedom in the cross-validation that chooses the first, coarse smoothing.
CAUTION = 1.2
# Noise below this share of the size counts as rounding.
NOTHING = 1e-12
# Lower quartile of a standard normal variable.
QUARTILE = -0.6745
# Upper bound on the noise, relative to an estimate from planes fitted to single rings. Such rings
# are mostly flat, even between dense creases, but tilted if the noise is as large as the edges.
SLACK = 1.15
# Roughness, relative to the median, at which a patch's trust is halved, pass by pass.
FALLING = (np.inf, 4.0, 3.0, 2.0, 2.0, 2.0)


def smooth_mesh(
    mesh: Mesh,
    *,
    order: int | None = None,
    weight: float | None = None,
    norm: str = "l2",
) -> Smoothed:
    """Smooth a noisy mesh.

    The result minimises

        mean |x - x_0|^2 + weight sum_p share_p |residual_p(x)|^2 / radius_p^(2 order)

    over patches p of neighbouring vertices; x_0 are the given vertices. The residual is that of
    a fit by a polynomial of degree below `order` over the plane of the patch
    (:mod:`gso.smoothing.local_fits`), shares are shares of area, and the unit of length is the
    root-mean-square distance from the centroid.
    The planes come from a mesh smoothed beforehand: by an umbrella operator whose weight
    minimises a generalised cross-validation, then with planes on single rings. The noise is
    estimated from the patches, and the weight minimises Mallows' unbiased risk estimate
    (:mod:`gso.smoothing.select`).

    Parameters
    ----------
    mesh : Mesh
        Noisy surface in any unit of length and any position. The noise is assumed to be
        independent and of equal variance in every coordinate. Boundaries and holes are free.
        Vertices of no face are ignored and returned unchanged.
    order : {2, 3, 4}, optional
        Patches have one ring of faces for 2, two rings for 3 and 4. 4 by default; for
        ``norm="l1"`` 2 or 3, whichever has fewer degrees of freedom.
    weight : float, optional
        Amount of smoothing, dimensionless.
    norm : {"l2", "l1"}
        "l1" preserves creases: patches rougher than most get lower and lower weights, so that
        each side of a crease is smoothed separately (iteratively reweighted least squares with
        the Cauchy function; Holland and Welsch 1977).

    Returns
    -------
    Smoothed
        Its `points` are the vertices (n, 3).

    Raises
    ------
    OptionError
        An order, weight or norm that does not exist.

    Examples
    --------
    >>> from scipy.spatial import Delaunay
    >>> rng = np.random.default_rng(0)
    >>> plane = rng.uniform(size=(400, 2))
    >>> saddle = np.column_stack([plane, plane[:, 0] * plane[:, 1]])
    >>> noisy = saddle + 0.01 * rng.standard_normal(saddle.shape)
    >>> x, y, z = smooth_mesh(Mesh(noisy, Delaunay(plane).simplices)).points.T
    >>> bool((z - x * y).std() < 0.003)
    True
    """
    checked_options(order, ORDERS if norm == "l2" else ORDERS[:2], weight, norm)
    # Vertices of no face may lie anywhere: they must not affect sizes, medians and traces.
    used = np.flatnonzero(mesh.used)
    unit, frame, _ = to_unit(mesh.vertices[used])
    near = neighbours(mesh)
    flat = umbrella(mesh, near)[used][:, used]
    near = near[used][:, used]
    pilot = best_weight((flat.T @ flat).tocsc(), unit, 1.0, gcv(CAUTION)).points
    at_most = SLACK * noise(unit, residuals(unit, rings(near, 1), 2))
    if norm == "l2":
        done, order, sigma = _squared(unit, pilot, near, order or 4, weight, at_most)
    else:
        orders = ORDERS[:2] if order is None else (order,)
        trials = [_creased(unit, pilot, near, k, weight, at_most) for k in orders]
        # Residuals of both are as large as the noise; the fewer degrees of freedom win.
        done, order, sigma = min(trials, key=lambda trial: trial[0].dof)
    smoothed = mesh.vertices.copy()
    smoothed[used] = frame.to_user(done.points)
    return Smoothed(
        points=smoothed,
        order=order,
        weight=done.weight,
        sigma=frame.scale * sigma,
        dof=done.dof,
    )


def _squared(
    unit: Array, pilot: Array, near: csr_matrix, order: int, weight: float | None, sigma: float
) -> tuple[Choice, int, float]:
    for degree, start in ((2, 1e-5), (order, 1e-4)):
        local = residuals(pilot, _patches(near, degree), degree)
        sigma = min(sigma, noise(unit, local))
        last = degree == order
        done = _solve(local.penalty(), unit, start, sigma, weight if last else None)
        pilot = done.points
    return done, order, sigma


def _creased(
    unit: Array, pilot: Array, near: csr_matrix, order: int, weight: float | None, sigma: float
) -> tuple[Choice, int, float]:
    patches = _patches(near, order)
    start = 1e-6
    for tolerance in FALLING:
        local = residuals(pilot, patches, order)
        sigma = min(sigma, noise(unit, local))
        rough = local.heights(pilot)
        typical = np.median(rough[local.freedom > 0]) if local.freedom.any() else 0.0
        limit = tolerance * (typical + NOTHING)
        trust = 1 / (1 + (rough / limit) ** 2)
        done = _solve(local.penalty(trust), unit, start, sigma, weight)
        pilot, start = done.points, done.weight
    return done, order, sigma


def _patches(near: csr_matrix, order: int) -> Rings:
    return rings(near, 1 if order == 2 else 2)


def _solve(
    penalty: csc_matrix, unit: Array, start: float, sigma: float, weight: float | None
) -> Choice:
    if weight is None and sigma < NOTHING:
        return Choice(unit, 0.0, float(len(unit)))
    if weight is None:
        return best_weight(penalty, unit, start, unbiased_risk(sigma**2))
    solve = factoring(penalty)(min(weight, largest_weight(penalty)))
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (len(unit), 3))
    dof = float((signs * solve(signs)).sum()) / signs.shape[1]
    return Choice(solve(unit), weight, dof)


def noise(points: Array, local: Residuals) -> float:
    """Estimate the standard deviation of the noise per coordinate, robustly against creases.

    The residuals of each patch along its normal give one estimate. Creases and curvature only
    increase it, so the lower quartile over the patches is used, after each estimate is divided
    by the lower quartile for a chi-squared variable (Wilson and Hilferty 1931).
    """
    enough = local.freedom >= 3
    if not enough.any():
        enough = local.freedom >= 1
    if not enough.any():
        return 0.0
    nu = local.freedom[enough]
    spread = 2 / (9 * nu)
    expected = (1 - spread + QUARTILE * np.sqrt(spread)) ** 1.5
    return float(np.quantile(local.heights(points)[enough] / expected, 0.25))

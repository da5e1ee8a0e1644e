"""Checks that are specific to a task."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from gso import metrics
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.tasks.request import Limits
from gso.typing import Array
from gso.verdict.codes import Code
from gso.verdict.compare import Measurement
from gso.verdict.surface_checks import Measured

if TYPE_CHECKING:
    from gso.result import Result

Bounds = dict[Code, float | None]

#: Distance from the design, relative to its size, beyond which a result is refused whatever limit
#: was given.
_FAR = 0.5


def developable(result: Result, limits: Limits, violation: float) -> tuple[Measured, Bounds]:
    """Measure deviation, strain of the pattern, and curvature."""
    # Imported here, as it imports scipy.
    from gso.tasks.developable.options import DEVELOPABLE, SHEET, Options

    design, mesh = result.design, result.mesh
    measured, bounds = _away(result, limits, violation)
    strain, allowed = np.inf, limits.max_strain
    if allowed is None and limits.target_curvature is None:
        allowed = SHEET if limits.max_deviation is None else DEVELOPABLE
    if result.pattern is not None:
        strains = _strains(mesh, result.pattern)
        strain = float(strains.max())
        measured[Code.STRAIN] = Measurement(strain)
        measured[Code.NOT_FLATTENED] = Measurement(strains, "face", range(len(strains)))
        bounds[Code.STRAIN] = allowed
    elif limits.max_strain is not None:
        measured[Code.NO_PATTERN] = Measurement(1.0)
    scale = metrics.unit(design)
    after = metrics.loss_gc_worst(mesh, scale=scale)
    target = limits.target_curvature
    measured[Code.TARGET_CURVATURE] = Measurement(after)
    bounds[Code.TARGET_CURVATURE] = target
    if violation <= 0 and after > max(Options().developable_below, target or 0.0):
        # As it is shown with the result: three times the published measure.
        before, after = (metrics.mean_abs_K(m, scale=scale) for m in (design, mesh))
        measured[Code.CURVATURE_ROSE] = curvature = Measurement(after)
        bounds[Code.CURVATURE_ROSE] = before
        same = after <= (1.0 + Code.CURVATURE_ROSE.info.tolerance) * before
        if same and strain > DEVELOPABLE:
            measured[Code.NOTHING_DONE] = curvature
            bounds[Code.NOTHING_DONE] = before
    _remember(result, measured, limits)
    return measured, bounds


def strips(result: Result, limits: Limits, violation: float) -> tuple[Measured, Bounds]:
    """Measure deviation and strain of strips, and count rulings that cross."""
    surface = result.ruled
    if surface is None:
        return {}, {}
    measured, bounds = _away(result, limits, violation)
    measured[Code.RULINGS_CROSS] = Measurement(float(surface.crossed))
    strain = surface.strain
    if strain is None:
        strain = _strains(result.mesh, surface.pattern).max()
    measured[Code.STRAIN] = Measurement(strain)
    bounds[Code.STRAIN] = limits.max_strain
    _remember(result, measured, limits)
    return measured, bounds


def denoise(result: Result, limits: Limits, violation: float) -> tuple[Measured, Bounds]:
    """Measure the roughness over that of the input."""
    if violation:
        return {}, {}
    return {Code.ROUGHER: Measurement(metrics.fairness_ratio(result.design, result.mesh))}, {}


def _away(result: Result, limits: Limits, violation: float) -> tuple[Measured, Bounds]:
    """Measure the distance to the design, also as a share of its size.

    Nothing is measured where no vertex has moved farther than the distance may be.
    """
    from gso.tasks.developable.options import NEAR

    design, mesh = result.design, result.mesh
    size = design.size
    free = limits.max_deviation is None and limits.target_curvature is None
    share = (NEAR if free else _FAR) + violation / size
    most = share * size if limits.max_deviation is None else min(share * size, limits.max_deviation)
    if np.array_equal(design.triangles, mesh.triangles) and (
        np.linalg.norm(mesh.vertices - design.vertices, axis=1).max(initial=0.0) <= most
    ):
        return {}, {}
    # Far from the origin, distances are only known up to the rounding of the coordinates.
    return {
        Code.DEVIATION: Measurement(result.deviation, slack=1e-12 * size),
        Code.FAR: Measurement(result.deviation / size),
    }, {Code.DEVIATION: limits.max_deviation, Code.FAR: share}


def _strains(surface: Mesh, pattern: Pattern) -> Array:
    return np.nan_to_num(metrics.face_strains(pattern.surface(surface), pattern.flat))


def _remember(result: Result, measured: Measured, limits: Limits) -> None:
    """Store the numbers of a verdict in the details of a result."""
    strain = {"strain_max": measured[Code.STRAIN].value} if Code.STRAIN in measured else {}
    result.details = {**result.details, "verdict": strain | limits.given}


#: Checks by task, or by kind of result; others only have the checks of surface and pattern.
CHECKS: dict[str, Callable[[Result, Limits, float], tuple[Measured, Bounds]]] = {
    "developable": developable,
    "denoise": denoise,
    "strips": strips,
}

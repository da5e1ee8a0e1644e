"""A result in one line, and in a few."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso.verdict.codes import Code
from gso.wording import length, percent

if TYPE_CHECKING:
    from gso.result.result import Result


def headline(result: Result, unit: str = "") -> str:
    """Summarise a developable result in one line: strain, deviation, and the verdict.

    The line is empty for other tasks, and if no verdict was made.

    Parameters
    ----------
    result : Result
    unit : str
        Name of the unit of the coordinates.

    Examples
    --------
    >>> import numpy as np
    >>> u = np.linspace(-1, 1, 17)
    >>> bowl = np.dstack([*np.meshgrid(10 * u, 10 * u), 2 * (u**2 + u[:, None] ** 2)])
    >>> from gso.tno import optimize
    >>> headline(optimize(bowl, max_deviation=0.5), "mm")
    'largest strain 0... %, deviation 0... mm (... % of the diagonal): developable within 0.5 mm'
    """
    found = result.details.get("verdict")
    if found is None:
        return ""
    far = result.deviation
    said = f"deviation {length(far, unit)}"
    if far and (size := result.design.diagonal):
        said += f" ({percent(far / size, 2)} of the diagonal)"
    if "strain_max" not in found:
        return said
    said = f"largest strain {percent(found['strain_max'])}, {said}"
    within = []
    if "max_deviation" in found:
        within.append(f"within {found['max_deviation']:g} {unit}".rstrip())
    if "max_strain" in found:
        within.append(f"to a strain of {100 * found['max_strain']:g} %")
    if not within:
        return said
    good = all(reason.code is not Code.STRAIN for reason in result.reasons)
    return f"{said}: {'developable' if good else 'not developable'} {' and '.join(within)}"


def measurement(result: Result) -> str:
    """Say what the task changed: curvature, strain or roughness; empty where none was measured."""
    found = result.metrics
    if "mean_abs_K_before" in found:
        change = f"{found['mean_abs_K_before']:.3g} -> {found['mean_abs_K']:.3g}"
        return f"mean |K| {change} in the unit ball"
    if "strain_max" in found:
        return (
            f"strain: mean {percent(found['strain_mean'])}, largest {percent(found['strain_max'])}"
        )
    if "roughness_ratio" in found:
        return f"roughness {found['roughness_ratio']:.3g} times the input's"
    return ""


def summary(result: Result) -> str:
    """Summarise a solve in at most five lines, and one for each reason against it.

    Lengths are in the mesh's own unit.

    Examples
    --------
    >>> import numpy as np
    >>> from gso.tno import optimize
    >>> u = np.linspace(-1, 1, 17)
    >>> saddle = np.dstack([*np.meshgrid(u, u), 0.1 * np.outer(u, u)])
    >>> lines = summary(optimize(saddle)).splitlines()
    >>> len(lines), lines[0]
    (5, 'Result of developable (curvature): usable, converged: the energy no longer falls')
    >>> lines[3]
    '  Mesh(289 vertices, 256 faces, grid 17 x 17)'
    """
    usable = "usable" if result.usable else "not usable"
    lines = [*map(str, result.reasons), headline(result), measurement(result)]
    start = "cold start" if result.warm_start == "cold" else f"warm start: {result.warm_start}"
    seconds = f"{result.seconds.get('total', 0.0):.2g} s"
    parts = [f"{result.iterations} iterations", seconds, result.backend, start]
    lines += [repr(result.mesh), ", ".join(part for part in parts if part)]
    why = "" if result.reasons else f", {result.status}"
    first = f"Result of {result.task} ({result.formulation}): {usable}{why}"
    return "\n  ".join([first, *(line for line in lines if line)])

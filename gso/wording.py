"""Wording of the verdict: places, lengths with their unit, headline and summary."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

#: Largest number of places that a reason lists.
_NAMED = 6


def places(what: str, ids: Any) -> str:
    """Format a list of elements by number; only the first few are listed.

    >>> places("face", [3]), places("face", range(8))
    ('face 3', 'faces 0, 1, 2, 3, 4, 5 and 2 more')
    """
    named = [str(k) for k in list(ids)[:_NAMED]]
    more = f" and {len(ids) - _NAMED} more" if len(ids) > _NAMED else ""
    return f"{what}{'s' if len(ids) > 1 else ''} {', '.join(named)}{more}"


def length(value: float, unit: str = "") -> str:
    """Format a measured length with three digits, and its unit if given.

    >>> length(20.0, "mm"), length(0.5), length(0.0123456), length(1234.5)
    ('20.0 mm', '0.500', '0.0123', '1230')
    """
    if value == 0 or not np.isfinite(value):
        text = f"{value:g}"
    elif not 1e-4 <= abs(value) < 1e6:
        text = f"{value:.2e}"
    else:
        rounded = float(f"{value:.3g}")
        text = f"{rounded:.{max(2 - int(np.floor(np.log10(abs(rounded)))), 0)}f}"
    return f"{text} {unit}" if unit else text


def percent(value: float) -> str:
    """Format a measured ratio as a percentage with three digits.

    >>> percent(0.01741), percent(0.58), percent(1e-8)
    ('1.74 %', '58.0 %', '0 %')
    """
    shown = 100.0 * value
    return f"{length(shown if shown >= 1e-4 else 0.0)} %"


def beyond(value: float, bound: float, shown: Callable[[float], str] = length) -> str:
    """Say that a value is larger than its bound, with as many digits as show it.

    >>> beyond(2.0, 1.0), beyond(1.0001, 1.0), beyond(0.03, 0.01, percent)
    ('2.00, more than 1.00', '1.0001, more than 1', '3.00 %, more than 1.00 %')
    """
    if shown(value) == shown(bound):
        return f"{value:.6g}, more than {bound:.6g}"
    return f"{shown(value)}, more than {shown(bound)}"


def headline(result: Any, unit: str = "") -> str:
    """Summarise a developable result in one line: strain, deviation, and the verdict.

    The line is empty for other tasks, and if no verdict was made.

    Parameters
    ----------
    result : Result
    unit : str
        Name of the unit of the coordinates.

    Examples
    --------
    >>> u = np.linspace(-1, 1, 17)
    >>> bowl = np.dstack([*np.meshgrid(10 * u, 10 * u), 2 * (u**2 + u[:, None] ** 2)])
    >>> from gso.tno import optimize
    >>> headline(optimize(bowl, max_deviation=0.5), "mm")
    'largest strain 0... %, deviation 0... mm: developable within 0.5 mm'
    """
    found = result.details.get("verdict")
    return sentence(found, unit) if found else ""


def summary(result: Any) -> str:
    """Summarise a solve in at most five lines; lengths are in the mesh's own unit.

    Examples
    --------
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
    why = result.reasons[0] if result.reasons else str(result.status)
    found = result.metrics
    lines = [headline(result)]
    if lines[0] == why:
        del lines[0]
    if "mean_abs_K_before" in found:
        change = f"{found['mean_abs_K_before']:.3g} -> {found['mean_abs_K']:.3g}"
        lines.append(f"mean |K| {change} in the unit ball")
    elif "strain_max" in found:
        lines.append(
            f"strain: mean {percent(found['strain_mean'])}, largest {percent(found['strain_max'])}"
        )
    elif "roughness_ratio" in found:
        lines.append(f"roughness {found['roughness_ratio']:.3g} times the input's")
    start = "cold start" if result.warm_start == "cold" else f"warm start: {result.warm_start}"
    seconds = f"{result.seconds.get('total', 0.0):.2g} s"
    parts = [f"{result.iterations} iterations", seconds, result.backend, start]
    lines += [repr(result.mesh), ", ".join(part for part in parts if part)]
    first = f"Result of {result.task} ({result.formulation}): {usable}, {why}"
    return "\n  ".join([first, *(line for line in lines if line)])


def sentence(found: dict[str, float], unit: str = "") -> str:
    """Format the :func:`headline` from the measured values and the limits that were given."""
    strain, deviation = found.get("strain_max"), found["deviation"]
    parts = [] if strain is None else [f"largest strain {percent(strain)}"]
    parts.append(f"deviation {length(deviation, unit)}")
    said = ", ".join(parts)
    if found.get("allowed") is None or strain is None:
        return said
    within = []
    if "max_deviation" in found:
        within.append(f"within {found['max_deviation']:g} {unit}".rstrip())
    if "max_strain" in found:
        within.append(f"to a strain of {100 * found['max_strain']:g} %")
    good = strain <= found["allowed"]
    return f"{said}: {'developable' if good else 'not developable'} {' and '.join(within)}"

"""The last steps of every solve: the pattern of its surface, and the verdict on it."""

from __future__ import annotations

import time

import numpy as np

from gso.constraints import Compiled
from gso.mesh import Mesh
from gso.metrics import nonplanarity
from gso.result import Result
from gso.status import Status
from gso.tno.layout import lay_out
from gso.verdict import Asked, judge

#: Distance of a quad's diagonals over the mean edge length: up to the first value quads count
#: as planar, above the second they are visibly not.
_PLANAR, _BENT = 1e-6, 1e-3


def requirements(mesh: Mesh, compiled: Compiled, scale: float, **limits: float | None) -> Asked:
    """Gather what a result has to meet, in the user's unit.

    Design and constraints are the solver's, in the unit ball of radius `scale`. `moved` is the
    design's largest violation of the constraints.
    """
    moved = 0.0
    if not compiled.empty and not compiled.flat:
        misses = compiled.violations(mesh.vertices).values()
        # Violations below rounding errors do not count.
        moved = max((miss.length for miss in misses if miss.length > 1e-9), default=0.0)
    return Asked(**limits, moved=scale * moved)


def judged(result: Result, asked: Asked) -> Result:
    """Add to a result the pattern of its surface, the reasons against it, and its final status.

    `seconds` gets entries "pattern" and "verdict". If there are reasons against the result, a
    status that does not refuse it becomes ``Status.UNUSABLE``. Each reason becomes a note.
    """
    known = result.ruled is not None
    if result.task == "developable" and not known and np.isfinite(result.mesh.vertices).all():
        clock = time.perf_counter()
        result.pattern = lay_out(result.mesh, result.pattern)
        result.seconds["pattern"] = time.perf_counter() - clock
        result.notes += _planarity(result)
    clock = time.perf_counter()
    result.reasons = judge(result, asked)
    said = str(result.status)
    result.notes += tuple(r for r in result.reasons if r != said and r not in result.notes)
    if result.reasons and not result.status.is_failure:
        result.status = Status.UNUSABLE
    result.seconds["verdict"] = time.perf_counter() - clock
    return result


def _planarity(result: Result) -> tuple[str, ...]:
    """Make a note if the design's quads are planar and the result's are not."""
    if result.design.is_triangles:
        return ()
    if nonplanarity(result.design).max() > _PLANAR:
        return ()
    after = float(nonplanarity(result.mesh).max())
    if after <= _BENT:
        return ()
    return (
        f"the input's quads are planar, those of the result are not: their diagonals are up to "
        f"{after:.2g} of the mean edge apart; the constraint PlanarFaces keeps them planar",
    )


def warning(result: Result) -> str:
    """Return what to warn of: the status or the first reason against the result; else empty."""
    if result.status.converged or result.status is Status.MAX_ITERATIONS:
        return ""
    if result.status is not Status.UNUSABLE:
        return str(result.status)
    return f"not usable as what was asked for: {result.reasons[0]}"


#: Relative difference up to which two energies count as the same minimum.
_SAME = 1e-3


def better(one: Result, other: Result) -> bool:
    """Return whether a result alone is usable, or has less energy at equal usability."""
    if one.usable != other.usable:
        return one.usable
    return sum(one.energy.values()) < (1.0 - _SAME) * sum(other.energy.values())


def difference(dragged: Result, taken: Result) -> str:
    """Describe how the result that was taken differs from the dragged one."""
    apart = np.linalg.norm(taken.mesh.vertices - dragged.mesh.vertices, axis=1)
    k = int(apart.argmax())
    why = (
        "has less energy than the dragged surface"
        if taken.usable == dragged.usable
        else "is usable and the dragged surface is not"
    )
    return (
        f"the solve from the design {why}, and was taken; the two are up to {apart[k]:.4g} apart, "
        f"at vertex {k}"
    )

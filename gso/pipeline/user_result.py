"""Results in the user's frame and numbering."""

from __future__ import annotations

import numpy as np

from gso.constraints import TIGHT
from gso.mesh.cut import Cut
from gso.pattern import Pattern
from gso.pipeline.case import Case
from gso.pipeline.run import Run
from gso.result import Result
from gso.spline.fit import describe_spline
from gso.status import Status
from gso.tasks.base import Solution
from gso.typing import Array


def record_violations(case: Case, points: Array, out: Solution | Result) -> None:
    """Record the violation of each constraint, in the user's unit; note missed hard ones.

    `points` are the vertices or the flat image, in the solver's frame and numbering.
    """
    constraints, frame = case.analysis.constraints, case.frame
    if not constraints.names:
        return
    misses = constraints.violations(points)
    lengths = {name: frame.scale * miss.length for name, miss in misses.items()}
    out.details = {**out.details, "constraints": lengths}
    broken = [k for k, miss in misses.items() if miss.hard and not miss.length <= TIGHT]
    for name in broken:
        where = ", ".join(map(str, frame.names[misses[name].vertices]))
        out.notes += (f"{name} is missed by {lengths[name]:.3g} (vertices {where})",)
    if broken and out.status is not Status.CANCELLED:
        out.status = Status.CONSTRAINTS_MISSED


def pattern_of(case: Case, solution: Solution) -> Pattern | None:
    """Return the flat image of a solution in the user's unit and numbering; None without one."""
    flat = solution.blocks.get("flat")
    return None if flat is None else in_user_frame(case, flat, solution.cut)


def in_user_frame(case: Case, flat: Array, cut: Cut | None) -> Pattern:
    """Return a flat image of the design, or of the design cut open, in the user's frame."""
    if cut is None:
        return Pattern.whole(case.design, case.frame.back("flat", flat) * case.frame.scale)
    # The numbering of a cut mesh begins with the user's.
    return Pattern(flat * case.frame.scale, cut.mesh.faces, cut.vertex, cut.seams)


def pack(run: Run, solution: Solution) -> Result:
    """Convert a solution to a result in the user's frame and numbering."""
    case, design, frame = run.case, run.case.design, run.case.frame
    record_violations(case, solution.points, solution)
    pattern = pattern_of(case, solution)
    flat = None if pattern is None or solution.cut is not None else pattern.flat
    surface, ratios = (solution.blocks.get(name) for name in ("surface", "scale"))
    if solution.status is Status.ALREADY_GOOD:
        mesh = design
    elif surface is not None:
        mesh = design.replaced(frame.frame.to_user(frame.back("surface", surface)))
    elif flat is not None:
        mesh = design.replaced(np.c_[flat, np.zeros(len(flat))])
    else:
        mesh = design if pattern is None else pattern.mesh
    seconds = run.timings.as_dict()
    details = dict(solution.details)
    details |= {k: details[k] * frame.scale for k in case.task.lengths if k in details}
    spline = None
    if solution.spline is not None:
        before = solution.fitted
        fitted = None if before is None else frame.frame.to_user(frame.back("surface", before))
        spline, said = describe_spline(frame.frame.to_user(solution.spline), mesh, design, fitted)
        details["spline"] = said
    start, notes = case.request.start, design.notes + solution.notes
    if run.start_refused:
        notes += (f"the start ({start.source}) was not used: {run.start_refused}",)
    begun = start.points is not None and not run.start_refused
    return Result(
        task=case.request.task,
        formulation=solution.formulation or case.request.formulation,
        design=design,
        mesh=mesh,
        flat=flat,
        pattern=pattern,
        cell_scale=None if ratios is None else frame.back("scale", ratios)[:, 0],
        status=solution.status,
        iterations=run.iterations,
        energy=solution.energy,
        history=run.history,
        seconds=seconds,
        backend=solution.backend,
        warm_start=start.source if begun else "cold",
        notes=notes,
        details=details,
        spline=spline,
    )

"""Results in the user's frame and numbering."""

from __future__ import annotations

import numpy as np

from gso import tasks
from gso.constraints import TIGHT, Compiled
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.result import Result
from gso.spline.fit import describe_spline
from gso.status import Status
from gso.tasks.base import Solution
from gso.tno.normalise import Canonical
from gso.tno.run import Run


def record_violations(compiled: Compiled, frame: Canonical, solution: Solution) -> None:
    """Record the violation of each constraint, in the user's unit; note missed hard ones."""
    if not compiled.names:
        return
    unit = frame.frame.scale
    misses = compiled.violations(solution.blocks[compiled.block])
    lengths = {name: unit * miss.length for name, miss in misses.items()}
    solution.details = {**solution.details, "constraints": lengths}
    broken = [k for k, miss in misses.items() if miss.hard and not miss.length <= TIGHT]
    for name in broken:
        where = ", ".join(map(str, frame.names[misses[name].vertices]))
        solution.notes += (f"{name} is missed by {lengths[name]:.3g} (vertices {where})",)
    if broken and solution.status is not Status.CANCELLED:
        solution.status = Status.CONSTRAINTS_MISSED


def packed(
    task: str,
    formulation: str,
    design: Mesh,
    frame: Canonical,
    solution: Solution,
    run: Run,
) -> Result:
    """Convert a solution to a result in the user's frame and numbering."""
    # The numbering of a cut mesh begins with the user's.
    own = {"flat"} if solution.cut is not None else set()
    blocks = {k: x if k in own else frame.back(k, x) for k, x in solution.blocks.items()}
    flat = blocks["flat"] * frame.frame.scale if "flat" in blocks else None
    pattern = None
    if solution.cut is not None and flat is not None:
        pattern = Pattern(flat, solution.cut.mesh.faces, solution.cut.vertex, solution.cut.seams)
        flat = None
    if solution.status is Status.ALREADY_GOOD:
        mesh = design
    elif "surface" in blocks:
        mesh = design.replaced(frame.frame.to_user(blocks["surface"]))
    elif pattern is not None:
        mesh = pattern.mesh
    else:
        mesh = design.replaced(np.c_[flat, np.zeros(len(design.vertices))])
    seconds = run.timings.as_dict()
    ruled = None
    if solution.ruled is not None:
        seconds["strips"] = run.converting
        ruled = solution.ruled.transformed(
            frame.frame.to_user, frame.frame.scale, lambda rows: frame.back("surface", rows)
        )
        mesh, pattern = ruled.mesh, ruled.pattern
        flat = None if pattern.is_cut else pattern.flat
    seconds["solve"] = sum(seconds.values())
    spline, details = None, dict(solution.details)
    lengths = getattr(tasks.get(task), "LENGTHS", ())
    details |= {name: details[name] * frame.frame.scale for name in lengths if name in details}
    if solution.spline is not None:
        before = solution.fitted
        fitted = None if before is None else frame.frame.to_user(frame.back("surface", before))
        spline, said = describe_spline(frame.frame.to_user(solution.spline), mesh, design, fitted)
        details = {**details, "spline": said}
    return Result(
        task=task,
        formulation=formulation,
        design=design,
        mesh=mesh,
        flat=flat,
        pattern=pattern,
        cell_scale=blocks["scale"][:, 0] if "scale" in blocks else None,
        status=solution.status,
        iterations=run.iterations,
        energy=solution.energy,
        history=run.history,
        seconds=seconds,
        backend=solution.backend,
        notes=design.notes + solution.notes,
        details=details,
        spline=spline,
        ruled=ruled,
    )

"""One solve: normalise, plan, solve the stages, return to the user's frame, judge."""

from gso.pipeline.case import Case
from gso.pipeline.component_solves import solve_mesh
from gso.pipeline.judgement import (
    add_reasons,
    add_verdict,
    conclude,
    violation_of,
    warning,
)
from gso.pipeline.lay_flat import lay_out, strains_of
from gso.pipeline.normalise import Canonical
from gso.pipeline.run import PlanState, Run, objective, solution_at

__all__ = [
    "Canonical",
    "Case",
    "PlanState",
    "Run",
    "add_reasons",
    "add_verdict",
    "conclude",
    "lay_out",
    "objective",
    "solution_at",
    "solve_mesh",
    "strains_of",
    "violation_of",
    "warning",
]

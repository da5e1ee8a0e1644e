"""What the constraints of a request mean to a stage: fewer unknowns, more terms."""

from __future__ import annotations

from gso.tasks.base import Request
from gso.terms import Weighted, position
from gso.variables import Variables


def hold(request: Request, variables: Variables) -> Variables:
    """Unknowns that can only make what the hard linear constraints allow."""
    c = request.constraints
    columns = variables.layout.columns("surface", c.hard_ids).ravel()
    return variables.fixing(columns, c.hard_positions.ravel())


def pulls(request: Request) -> list[Weighted]:
    """Terms of the other constraints, for an objective on the design's own vertices."""
    c = request.constraints
    if not len(c.soft_ids):
        return []
    return [Weighted(position.build(c.soft_ids, c.soft_positions, c.soft_weights), 1.0)]

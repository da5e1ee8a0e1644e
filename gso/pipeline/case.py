"""A design with a request: in the user's frame, and prepared for the solver."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

from gso import tasks
from gso.constraints import Compiled
from gso.mesh import Mesh
from gso.pipeline.normalise import Canonical
from gso.tasks.base import Analysis, Options, Task
from gso.tasks.request import Request
from gso.typing import Ints


@dataclass(frozen=True, eq=False)
class Case:
    """What one solve is given: a design, or a part of one that no constraint joins to the rest.

    What the solver needs is made when it is first used, in the unit ball and with grids numbered
    row by row.

    Attributes
    ----------
    request : Request
        In the user's frame.
    design : Mesh
        The design.
    constraints : Compiled
        Constraints on its vertices, in the user's frame.
    names : ndarray of int, (n,), optional
        Vertex indices for messages, where the design is a part of the user's mesh.
    """

    request: Request[Options]
    design: Mesh
    constraints: Compiled = field(default_factory=Compiled)
    names: Ints | None = None

    @property
    def task(self) -> Task:
        """The task."""
        return tasks.get(self.request.task)

    @cached_property
    def frame(self) -> Canonical:
        """The design in the solver's frame, and the way back."""
        return Canonical(self.design, self.names)

    @cached_property
    def analysis(self) -> Analysis:
        """The task's analysis of the design and its constraints, in the solver's frame."""
        return self.task.analysis(self.frame.mesh, self.frame.constraints(self.constraints))

    @cached_property
    def solver_request(self) -> Request[Options]:
        """The request in the solver's frame."""
        x0 = self.frame.start(self.request.start.points, flat=self.task.flat)
        return self.request.in_frame(self.frame.scale, x0)

    def constrained(self, constraints: Compiled) -> Case:
        """Return the case with other constraints."""
        other = replace(self, constraints=constraints)
        # These do not depend on constraints.
        kept = {k: v for k, v in vars(self).items() if k in ("frame", "solver_request")}
        vars(other).update(kept)
        return other

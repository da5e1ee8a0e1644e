"""Constraints on a design that hold for the mesh that is cut open from it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from gso.constraints import Constraint
from gso.mesh import Mesh

if TYPE_CHECKING:
    from gso.constraints import Part
    from gso.constraints.base import Subject


@dataclass(frozen=True, eq=False)
class OfDesign(Constraint):
    """A constraint whose vertices, faces and boundary are those of a design.

    The mesh that is cut open numbers the vertices of the design first. Copies of them are joined
    by the seams.

    Parameters
    ----------
    constraint : Constraint
    design : Mesh
    """

    constraint: Constraint
    design: Mesh

    def parts(self, subject: Subject) -> list[Part]:
        return self.constraint.parts(replace(subject, mesh=self.design))


def of_design(constraints: Iterable[Constraint], design: Mesh) -> list[Constraint]:
    """Return constraints that refer to a design."""
    return [OfDesign(constraint, design) for constraint in constraints]

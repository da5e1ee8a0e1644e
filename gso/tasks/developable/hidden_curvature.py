"""Further stages where coarse quads hide curvature by bending along their diagonals.

Neither triangulation sees what they hide; the normals of the quads do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from gso import metrics as measure
from gso.energy import Weighted
from gso.mesh import Mesh
from gso.mesh.topology import are_quads
from gso.tasks.base import Stage, same
from gso.typing import Array

#: Numbers of quads that may hide curvature: fewer are no surface yet, and at 64 x 64 all measures
#: agree.
_COARSE = (100, 3_000)
#: Curvature by the normals of quads over that of the worse triangulation above which it is hidden.
_HIDDEN = 1.4


def further(
    mesh: Mesh, least: float, last: Stage, objectives: Sequence[Callable[[], list[Weighted]]]
) -> Callable[[int, Array], Stage | None] | None:
    """Return what plans further stages with curvature by the normals of quads, one at a time.

    Parameters
    ----------
    mesh : Mesh
        The design in the unit ball.
    least : float
        Curvature that counts as none: what is hidden is compared with that at least.
    last : Stage
        The last stage.
    objectives : sequence of callable
        Make the terms of the further stages, with more and more weight on that curvature.
    """
    if not (_COARSE[0] <= len(mesh.faces) <= _COARSE[1] and are_quads(mesh.faces).all()):
        return None

    def stage(number: int, coordinates: Array) -> Stage | None:
        after = mesh.replaced(last.layout.split(coordinates)["surface"])
        seen = max(measure.loss_gc_worst(after, scale=1.0), least)
        if number == len(objectives) or measure.loss_gc_image(after, scale=1.0) <= _HIDDEN * seen:
            return None
        return replace(
            last,
            name="normals of quads",
            own_items=objectives[number](),
            continuation=last.continuation[-1:],
            enter=same,
            finished=None,
        )

    return stage

"""The parts that the pieces of a design become, and one result of all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gso import faults
from gso.cut_pieces import Pieces
from gso.errors import GSOError, MeshError
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.pipeline.component_results import worst_status
from gso.result import Result, StripsResult
from gso.ruled.fold_lines import Folds
from gso.ruled.paneling.options import RULED
from gso.ruled.paneling.strips_request import StripsRequest
from gso.ruled.paneling.surface_strips import wanted
from gso.ruled.ruled_surface import RuledSurface
from gso.ruled.together import together
from gso.rulings import smallest_radius
from gso.seams import Sheet
from gso.seams.joint_solve import gap
from gso.seams.sheets import flattened
from gso.status import Status
from gso.tasks import Limits
from gso.typing import Keywords
from gso.verdict import Code, Measurement, Reason, compare, judge, ordered
from gso.wording import length


@dataclass(frozen=True)
class Joint:
    """The joint solve of a design in pieces.

    Attributes
    ----------
    design : Mesh
        The whole design, from which distances count.
    shape : Pieces
        Its pieces, made developable; their seams are closed.
    result : Result
        The solve.
    """

    design: Mesh
    shape: Pieces
    result: Result

    @cached_property
    def sheets(self) -> list[Sheet | None]:
        """The flat patterns of the pieces; None for those without."""
        return [flattened(piece.mesh) for piece in self.shape]


@dataclass(frozen=True)
class Part:
    """What a piece became: its surface, how many strips it has, and the reasons against it."""

    surface: RuledSurface
    strips: int
    status: Status
    reasons: tuple[Reason, ...]
    iterations: int = 0


def part_of(
    joint: Joint, request: StripsRequest, number: int, made: Result | GSOError, strict: bool
) -> Part:
    """Choose between the strips of a piece and the pattern of the joint solve.

    Strips that do not follow the piece closely enough are taken unless this is `strict`.
    """
    name, leave = joint.shape.name(number), request.may_leave_pieces
    if isinstance(made, StripsResult) and not (strict and made.status.is_failure):
        met = wanted(request.options, None, 1.0).met(made.ruled)
        if met or not leave:
            made = replace(made, status=Status.CONVERGED if met else Status.TARGET_MISSED)
            reasons = tuple(why.within(f"piece {name}") for why in judge(made, Limits()))
            return Part(made.ruled, made.ruled.strips, made.status, reasons, made.iterations)
    sheet = joint.sheets[number] if leave else None
    if sheet is not None:
        return _as_it_is(name, sheet, request)
    why = made if isinstance(made, GSOError) else MeshError("it cannot be laid flat")
    raise type(why)(f"piece {name}: {why}")


def _as_it_is(name: str, sheet: Sheet, request: StripsRequest) -> Part:
    """Return a piece with the pattern of the joint solve, without rulings."""
    count = len(sheet.mesh.faces)
    none = Folds(np.empty((0, 2), np.int64), np.empty(0), np.empty(0))
    surface = RuledSurface(
        mesh=sheet.mesh,
        strip=np.zeros(count, np.int64),
        flat=np.zeros(count, bool),
        rulings=none,
        creases=none,
        pattern=Pattern.whole(sheet.mesh, sheet.flat),
        moved=sheet.mesh.vertices,
        crossed=0,
    )
    measured = {
        Code.PATTERN_INVERTED: Measurement.count("face", sheet.inverted),
        Code.PATTERN_OVERLAPS: Measurement.count("face", faults.overlaps(sheet.mesh, sheet.flat)),
        Code.STRAIN: Measurement(sheet.strain),
        Code.BEND_RADIUS: Measurement(smallest_radius(sheet.mesh)),
    }
    limits = {Code.STRAIN: request.max_strain, Code.BEND_RADIUS: request.options.min_radius}
    reasons = tuple(why.within(f"piece {name}") for why in compare(measured, limits))
    return Part(surface, 0, Status.CONVERGED, reasons)


def merged(joint: Joint, parts: Sequence[Part]) -> StripsResult:
    """Merge the parts into one result."""
    design, opened = joint.design, joint.shape.opened
    surface = together([part.surface for part in parts], design).measured(design, parts=True)
    points = opened.mesh.vertices.copy()
    for own, part in zip(joint.shape.parts, parts, strict=True):
        points[own.vertices] = part.surface.moved
    apart = gap(opened.mesh.replaced(points), opened.seams)
    numbers = [part.strips for part in parts]
    notes = [
        f"both sides of a seam are up to {length(apart)} apart, as strips follow the joint result "
        f"within a distance; number of strips of each piece: {', '.join(map(str, numbers))}"
    ]
    if 0 in numbers:
        bare = ", ".join(joint.shape.name(k) for k, n in enumerate(numbers) if n == 0)
        notes.append(
            f"no strips follow these pieces closely enough: {bare}; they have no bend lines, and "
            "are nearly developable"
        )
    statuses = [joint.result.status, *(part.status for part in parts)]
    made = result_of(joint, surface, statuses, notes, {"strips": numbers, "seam_gap": apart})
    made.iterations += sum(part.iterations for part in parts)
    return made


def result_of(
    joint: Joint,
    surface: RuledSurface,
    statuses: Sequence[Status],
    notes: Sequence[str],
    details: Keywords,
) -> StripsResult:
    """Return the result that a surface of all pieces is."""
    first = joint.result
    return StripsResult(
        task="developable",
        formulation=RULED,
        design=joint.design,
        status=worst_status(statuses),
        iterations=first.iterations,
        energy=first.energy,
        history=first.history,
        backend=first.backend,
        warm_start=first.warm_start,
        notes=(*joint.design.notes, *notes),
        details={**first.details, **details},
        pieces=joint.shape,
        **StripsResult.attributes(surface),
    )


def reasons_against(
    result: StripsResult, request: StripsRequest, parts: Sequence[Part]
) -> tuple[Reason, ...]:
    """Return why strips of pieces are not usable as what was asked for."""
    whole = {Code.DEVIATION: result.ruled.farthest, Code.SEAM_GAP: result.details["seam_gap"]}
    own = [why for part in parts for why in part.reasons]
    return ordered([*own, *compare(whole, dict.fromkeys(whole, request.max_deviation))])


def cancelled(joint: Joint) -> Result:
    """Return the joint result, as the solve was ended before there were strips."""
    notes = (*joint.result.notes, "the solve was ended before there were strips")
    return replace(joint.result, formulation=RULED, status=Status.CANCELLED, notes=notes)

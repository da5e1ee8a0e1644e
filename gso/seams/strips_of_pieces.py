"""A design in pieces, each of them exactly ruled: the joint solve, and then strips."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from gso import metrics
from gso.constraints import Constraint
from gso.cut_pieces import Pieces
from gso.errors import ConvergenceWarning, GSOError, MeshError
from gso.mesh import Mesh
from gso.pipeline.component_results import renumber, worst_status
from gso.result import Result
from gso.seams.joint_bounds import deviation
from gso.seams.joint_solve import gap
from gso.solver import Callback
from gso.status import Status
from gso.tasks.base import Options
from gso.tasks.request import Limits, Start
from gso.verdict import judge
from gso.wording import length

if TYPE_CHECKING:
    from gso.ruled.ruled_surface import RuledSurface

#: Share of the allowed distance that the joint solve may use; the strips get what is left.
_JOINT = 0.5
#: Distance within which strips follow the joint result where nothing is asked, relative to the
#: diagonal.
_FOLLOW = 0.01
#: Least share that the strips get.
_LEAST = 0.1


@dataclass(frozen=True)
class Ask:
    """What was asked of the strips.

    Attributes
    ----------
    options : Options
        Settings of the formulation "ruled".
    max_deviation : float or None
        Largest distance from the design, in its unit.
    verdict : bool
        Whether to judge the result.
    """

    options: Options
    max_deviation: float | None
    verdict: bool


def solved(
    pieces: Pieces,
    ask: Ask,
    constraints: Sequence[Constraint],
    start: Start,
    callback: Callback | None,
    optimize: Callable[..., Result],
) -> Result:
    """Make every piece developable in a joint solve, and then exactly ruled, one by one.

    Strips follow the joint result within a distance, so seams are closed up to that distance.

    Parameters
    ----------
    pieces : Pieces
    ask : Ask
    constraints : sequence of Constraint
        Of the joint solve, in the numbering of the design.
    start : Start
        Of the joint solve.
    callback : callable, optional
        Called after every iteration.
    optimize : callable
        :func:`gso.tno.optimize`.

    Returns
    -------
    Result
        `ruled` has the strips of all pieces, `pieces` the joint result, whose seams are closed.
        `details` has "strips", their number in each piece, and "seam_gap", the largest distance
        between both sides of a seam, in the mesh's unit.
    """
    allowed = ask.max_deviation
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        joint = optimize(
            pieces,
            constraints=constraints,
            x0=start,
            max_deviation=None if allowed is None else _JOINT * allowed,
            callback=callback,
            verdict=False,
        )
        shape = joint.pieces
        if shape is None or joint.status.is_failure:
            raise MeshError(f"the joint solve of the pieces failed: {joint.status}")
        left = _FOLLOW * pieces.design.diagonal if _unbounded(ask.options) else None
        if allowed is not None:
            left = max(allowed - deviation(pieces, joint), _LEAST * allowed)
        strips = []
        for number, piece in enumerate(shape):
            try:
                strips.append(
                    optimize(
                        piece.mesh,
                        formulation="ruled",
                        options=ask.options,
                        max_deviation=left,
                        callback=_numbered(callback, number, len(shape)),
                        verdict=False,
                    )
                )
            except GSOError as error:
                raise type(error)(f"piece {piece.name}: {error}") from None
    return _merged(pieces, joint, shape, strips, ask)


def _merged(
    pieces: Pieces, joint: Result, shape: Pieces, strips: Sequence[Result], ask: Ask
) -> Result:
    """Merge the results of the pieces into one, and measure it against the whole design."""
    from gso.ruled.together import together

    opened = shape.opened
    surfaces = []
    for result in strips:
        if result.ruled is None:
            joint.notes += ("the solve was ended before there were strips",)
            joint.status = Status.CANCELLED
            return joint
        surfaces.append(result.ruled)
    rows = [part.vertices for part in shape.parts]
    ruled = together(surfaces, rows, len(opened.vertex))
    ruled = replace(ruled, deviation=_distances(pieces.design, ruled))
    numbers = [surface.strips for surface in surfaces]
    apart = gap(opened.mesh.replaced(ruled.moved), opened.seams)
    allowed, far = ask.max_deviation, _far(ruled.deviation)
    for result in strips:
        # What counts is the distance of the whole from the design.
        if result.status is Status.TARGET_MISSED and (allowed is None or far <= allowed):
            result.status = Status.CONVERGED
    reasons: tuple[str, ...] = ()
    if ask.verdict:
        reasons = tuple(
            f"piece {shape.name(k)}: {why}"
            for k, r in enumerate(strips)
            for why in judge(r, Limits())
        )
        for size, what in ((far, "from the design"), (apart, "apart at seams")):
            if allowed is not None and size > allowed:
                reasons += (
                    f"the strips are up to {length(size)} {what}, more than {length(allowed)}",
                )
    status = worst_status([joint.status, *(result.status for result in strips)])
    seconds = dict(joint.seconds)
    seconds["strips"] = sum(result.seconds["total"] for result in strips)
    notes = (
        *joint.notes,
        f"both sides of a seam are up to {length(apart)} apart, as strips follow the joint result "
        f"within a distance; number of strips of each piece: {', '.join(map(str, numbers))}",
        *reasons,
    )
    return Result(
        task="developable",
        formulation="ruled",
        design=joint.design,
        mesh=ruled.mesh,
        flat=None if ruled.pattern.is_cut else ruled.pattern.flat,
        status=Status.UNUSABLE if reasons and not status.is_failure else status,
        iterations=joint.iterations + sum(result.iterations for result in strips),
        energy=joint.energy,
        history=joint.history,
        seconds=seconds,
        backend=joint.backend,
        warm_start=joint.warm_start,
        notes=notes,
        details={**joint.details, "strips": numbers, "seam_gap": apart},
        reasons=reasons,
        pattern=ruled.pattern,
        ruled=ruled,
        pieces=shape,
    )


def _unbounded(options: Options) -> bool:
    """Whether the options of the formulation "ruled" leave the number of strips open."""
    return getattr(options, "strips", None) in (None, "auto")


def _far(away: metrics.Distances | None) -> float:
    return 0.0 if away is None else max(away.there_max, away.back_max)


def _distances(design: Mesh, ruled: RuledSurface) -> metrics.Distances:
    """Measure the distances between strips and the whole design; gaps at seams are apart."""
    points, weight = ruled.samples()
    there = metrics.point_to_surface(points, design)
    back = metrics.point_to_surface(design.vertices[design.used], ruled.mesh)
    rim = metrics.boundary_distance(design, ruled.mesh)[1] if design.boundary_loops else 0.0
    return metrics.Distances(
        float(weight @ there), float(there.max()), float(back.mean()), max(float(back.max()), rim)
    )


def _numbered(callback: Callback | None, place: int, count: int) -> Callback | None:
    if callback is None:
        return None

    def call(progress: Any) -> Any:
        return callback(renumber(progress, place, count, "piece"))

    return call

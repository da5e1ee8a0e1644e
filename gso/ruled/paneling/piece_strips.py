"""Strips of a design in pieces: the joint solve, then rulings between seams, or strips nearby."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from gso import metrics
from gso.cut_pieces import Pieces
from gso.errors import GSOError, MeshError
from gso.executors import open_executor
from gso.mesh import Mesh
from gso.pipeline.component_results import renumber
from gso.result import Result, StripsResult
from gso.ruled.paneling.light_design import LightDesign
from gso.ruled.paneling.merged_pieces import (
    Joint,
    cancelled,
    merged,
    part_of,
    reasons_against,
    result_of,
)
from gso.ruled.paneling.options import Options
from gso.ruled.paneling.shared_seams import SharedSeams
from gso.ruled.paneling.strips_request import StripsRequest, silent
from gso.ruled.paneling.surface_strips import check_whole, of_surface, wanted
from gso.seams import pieces as search
from gso.seams.joint_solve import solve_pieces
from gso.seams.segmentation import Segmentation
from gso.solver import Callback
from gso.status import Progress, Status
from gso.tasks import check
from gso.tasks.start import Start
from gso.typing import Keywords
from gso.verdict import Reason, judge

#: Shares of the allowed distance: what the joint solve of the pieces and the search for them may
#: use, and the least and the most within which strips follow the shape of the pieces, so that the
#: two sides of a seam stay together.
JOINT, _LEAST, _MOST = 0.9, 0.1, 0.5
#: Distance within which strips follow the joint result where none is given, relative to the
#: diagonal.
_NEAR = 0.01
#: Largest number of strips of a piece that "auto" tries.
_STRIPS = 8
#: Numbers of points on the sides of a square of mean area, one after the other.
_SIDES = (8, 14, 20)
#: Number of pieces from which on processes make their strips.
_MANY = 8


def of_pieces(
    light: LightDesign, request: StripsRequest, division: Pieces, *, single: bool = False
) -> tuple[Result, tuple[Reason, ...]]:
    """Make strips of a design in pieces, which are solved together.

    Pieces first become one strip each, with the same points on both sides of their seams. Where
    that does not hold the limits, strips follow the joint result within a distance, so seams are
    closed up to that distance. A piece that no strips follow keeps the pattern of the joint solve,
    unless the number of strips was named or no distance from the design was given.

    Parameters
    ----------
    light : LightDesign
    request : StripsRequest
    division : Pieces
        The pieces of the design.
    single : bool
        Whether only one strip of each piece is of use, with the same points on both sides of seams.

    Returns
    -------
    result : Result
        A :class:`StripsResult`, or none if the callback ended the solve. Its `details` have
        "strips", their number in each piece or 0 for pieces without, and "seam_gap", the largest
        distance between both sides of a seam, in the mesh's unit.
    reasons : tuple of Reason
        Why it is not usable.

    Raises
    ------
    MeshError
        The pieces cannot be solved, or one of them is no disk, or no single strips are found.
    """
    clock = time.perf_counter()
    joint = _together(light, request, division)
    if joint.result.status is Status.CANCELLED:
        return cancelled(joint), ()
    seconds = time.perf_counter() - clock
    return _of_joint(joint, request, light, division.design, seconds, single=single)


def of_found(
    light: LightDesign, request: StripsRequest, found: Segmentation
) -> tuple[Result, tuple[Reason, ...]]:
    """Make strips of pieces that the search for them has made developable; see `of_pieces`."""
    if found.result is None:
        raise ValueError("the search did not change the shape of the pieces")
    shape = Pieces(found.design, found.opened, found.names)
    joint = Joint(light.design, shape, found.result)
    return _of_joint(joint, request, light, found.design, found.seconds)


def _of_joint(
    joint: Joint,
    request: StripsRequest,
    light: LightDesign,
    target: Mesh,
    seconds: float,
    *,
    single: bool = False,
) -> tuple[Result, tuple[Reason, ...]]:
    """Make strips of pieces that are developable, near a target with their vertices."""
    clock = time.perf_counter()
    tried, stopped = _sharing_seams(joint, request, light, target)
    if stopped:
        return cancelled(joint), ()
    if single and not tried:
        raise MeshError("no points on the seams of the pieces make single strips of them")
    enough = single or (bool(tried) and not tried[0][1])
    for strips, strict in () if enough else _candidates(joint, request, light):
        if any(isinstance(made, Result) and made.status is Status.CANCELLED for made in strips):
            return cancelled(joint), ()
        # What counts is the distance of the whole from the design, and the gaps at seams.
        parts = [part_of(joint, request, k, made, strict) for k, made in enumerate(strips)]
        result = merged(joint, parts)
        tried.append((result, reasons_against(result, request, parts)))
        if not tried[-1][1]:
            break
    result, reasons = min(tried, key=lambda one: (len(one[1]) > 0, one[0].ruled.farthest))
    result.seconds |= {"pieces": seconds, "strips": time.perf_counter() - clock}
    return result, reasons


def _sharing_seams(
    joint: Joint, request: StripsRequest, light: LightDesign, target: Mesh
) -> tuple[list[tuple[StripsResult, tuple[Reason, ...]]], bool]:
    """Return the pieces as one strip each, with the same points on both sides of their seams.

    Without an allowed distance they are taken if they are near. The second value tells whether the
    callback ended the solve.
    """
    options, design, count = request.options, joint.design, len(joint.shape)
    near = _NEAR * design.diagonal if light.allowed is None else light.allowed
    disks = all(piece.is_disk for piece in joint.shape)
    if options.number is not None or request.constraints or not disks:
        return [], False
    sheets = [sheet for sheet in joint.sheets if sheet is not None]
    if len(sheets) < count:
        return [], False
    try:
        shared = SharedSeams(target, joint.shape, sheets, near)
    except GSOError:
        return [], False
    stopped, tried = False, []

    def told(number: int) -> bool:
        nonlocal stopped
        name = f"piece {number + 1} of {count}: rulings"
        progress = Progress(number, count, 0, 1, 0.0, {}, 1.0, name)
        stopped = not request.goes_on(progress)
        return not stopped

    request.say("rulings between seams")
    for side in _SIDES:
        try:
            surface = shared.surface(side, told)
        except GSOError:
            continue
        if stopped:
            break
        if surface is None:
            continue
        surface = surface.on(design, parts=True)
        if light.allowed is None and surface.farthest > near:
            continue
        met = wanted(options, request.max_deviation, 1.0).met(surface)
        status = Status.CONVERGED if met else Status.TARGET_MISSED
        details: Keywords = {"strips": [1] * count, "seam_gap": 0.0}
        made = result_of(joint, surface, [status], ["both sides of a seam are the same"], details)
        tried.append((made, judge(made, request.limits)))
        if not tried[-1][1]:
            return tried[-1:], False
    return tried, stopped


def _candidates(
    joint: Joint, request: StripsRequest, light: LightDesign
) -> Iterator[tuple[list[Result | GSOError], bool]]:
    """Yield strips of each piece, and whether only those that follow it closely are to be taken.

    A piece is developable, so that one strip should do; more of them are more parts. Strips that
    follow their piece closely come first, as the sides of their seams fit.
    """
    allowed, options, design = light.allowed, request.options, joint.design
    most, near = min(options.max_strips, _STRIPS), _NEAR * design.diagonal
    if allowed is None:
        yield _of_each(joint.shape, request, most, None if options.number else near), False
        return
    left = allowed - metrics.largest_distance(light.mesh, joint.shape.design)
    follow = float(np.clip(left, _LEAST * allowed, _MOST * allowed))
    if not request.may_leave_pieces:
        yield _of_each(joint.shape, request, most, follow), False
        return
    # No strips hold the distance near pieces that are much farther away themselves.
    hopeless = left < -_MOST * allowed
    single = _of_each(joint.shape, request, 1, follow)
    for near in dict.fromkeys([follow] if hopeless else [_LEAST * allowed, follow]):
        strips = [_within(made, near, options) for made in single]
        if near == follow:
            yield strips, False
        yield strips, True
    if most > 1 and not hopeless:
        strips = _of_each(joint.shape, request, most, follow, single)
        yield strips, False
        yield strips, True


def found_pieces(
    light: LightDesign, request: StripsRequest, fewer_than: int | None = None
) -> Segmentation:
    """Search for seams without darts, and leave strips of the pieces some of the distance.

    Parameters
    ----------
    light : LightDesign
    request : StripsRequest
    fewer_than : int, optional
        Number of strips that there are without them.

    Raises
    ------
    MeshError
        A piece cannot be laid flat, or pieces will not be fewer.
    """
    mesh = request.seams.searched(light.mesh, light.allowed)
    found = search(
        mesh,
        max_strain=request.max_strain,
        max_deviation=None if light.allowed is None else JOINT * light.allowed,
        fewer_than=fewer_than,
        darts=False,
        # All lengths are in the design's unit, whatever that is.
        sheet=request.sheet,
        keep=request.kept if len(request.kept) else None,
        as_it_is=False,
        workers=request.workers,
        callback=request.say,
        **request.seams.keywords(light.mesh, mesh, gores=False),
    )
    if any(sheet is None for sheet in found.sheets):
        raise MeshError(f"a piece cannot be laid flat; {'; '.join(map(str, found.reasons))}")
    return found


def _together(light: LightDesign, request: StripsRequest, division: Pieces) -> Joint:
    """Solve given pieces together."""
    request.say("joint solve")
    far = None if light.allowed is None else JOINT * light.allowed
    joint = check("developable", max_deviation=far, x0=request.start, verdict=False)
    joint = joint.with_options(joint.options.for_pieces())
    result = solve_pieces(division, joint, request.constraints, request.callback)
    return Joint(light.design, division if result.pieces is None else result.pieces, result)


def _within(made: Result | GSOError, follow: float, options: Options) -> Result | GSOError:
    """Return strips with the status that they have within a distance of their piece."""
    if not isinstance(made, StripsResult) or made.status is Status.CANCELLED:
        return made
    met = wanted(options, follow, 1.0).met(made.ruled)
    return replace(made, status=Status.CONVERGED if met else Status.TARGET_MISSED)


def _of_each(
    shape: Pieces,
    request: StripsRequest,
    most: int,
    follow: float | None,
    fewer: Sequence[Result | GSOError] = (),
) -> list[Result | GSOError]:
    """Make strips of each piece, at most so many; `fewer`, which are kept where they follow it."""
    # Their own normals give the rulings of developable pieces.
    options = replace(request.options, starts=("design",), max_strips=most)
    own = replace(request, options=options, constraints=(), start=Start(None))
    found: dict[int, Result | GSOError] = {
        number: made
        for number, made in enumerate(fewer)
        if isinstance(made, Result) and made.status is Status.CONVERGED
    }
    count = len(shape)
    missing = [number for number in range(count) if number not in found]
    if request.callback is not None or len(missing) < _MANY:
        for number in missing:
            request.say(f"strips of piece {number + 1} of {count}")
            told = _numbered(request.callback, number, count)
            found[number] = _strips(replace(own, callback=told), follow, shape[number].mesh)
        return [found[number] for number in range(count)]
    work = partial(_strips, replace(own, say=silent), follow)
    with open_executor(request.workers) as executor:
        for done in executor.as_completed(work, [shape[number].mesh for number in missing]):
            found[missing[done.index]] = done.result or MeshError(str(done.error))
            request.say(f"strips of piece {len(found)} of {count}")
    return [found[number] for number in range(count)]


def _strips(request: StripsRequest, follow: float | None, mesh: Mesh) -> Result | GSOError:
    """Make strips of one piece; return an error, so that it keeps its type."""
    try:
        check_whole(mesh)
        return of_surface(mesh, request, follow)
    except GSOError as error:
        return error


def _numbered(callback: Callback | None, place: int, count: int) -> Callback | None:
    if callback is None:
        return None

    def call(progress: Progress) -> object:
        return callback(renumber(progress, place, count, "piece"))

    return call

"""Strips on sheets: divided across, or more of them, so that every part fits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from gso import metrics
from gso.components import split
from gso.geometry.flat_region import neck
from gso.geometry.polygon import rectangle
from gso.geometry.vectors import lengths
from gso.mesh import Mesh
from gso.result import Result, StripsResult
from gso.ruled.paneling.strips_request import StripsRequest
from gso.ruled.sheet_division import divided_to_fit
from gso.seams import Sheet
from gso.seams.sheets import least_neck, too_small
from gso.status import Status
from gso.typing import Array, Ints
from gso.verdict import Code, Measurement, Reason, compare

Narrow = Callable[[float, int | None], Result | None]

#: Share of the sheet that strips may be wide.
_ROOM = 0.97


def against_sheet(result: Result, request: StripsRequest) -> tuple[Reason, ...]:
    """Return the reasons if parts of the pattern are larger than the sheet."""
    pattern, sheet = result.pattern, request.sheet
    if pattern is None or sheet is None:
        return ()
    return _too_large([pattern.flat[part.vertices] for part in split(pattern.mesh)], sheet)


def against_parts(result: Result, request: StripsRequest, *, slivers: bool) -> tuple[Reason, ...]:
    """Return the reasons if parts do not fit the sheet, are pleated, or miss budgets of pieces.

    With `slivers` also if parts that are joined to others are smaller than anybody would make.
    """
    pattern = result.pattern
    reasons = (*against_sheet(result, request), *_against_pleats(result, request))
    if pattern is None:
        return reasons
    parts = split(pattern.surface(result.mesh))
    sheets = [Sheet(part.mesh, pattern.flat[part.vertices]) for part in parts]
    pieces = 1 if result.pieces is None else len(result.pieces)
    reasons += request.seams.reasons(pieces, sheets)
    if slivers:
        vertices = [pattern.vertex[part.vertices] for part in parts]
        shared = np.bincount(np.concatenate([np.unique(own) for own in vertices])) > 1
        joined = [s for s, own in zip(sheets, vertices, strict=True) if shared[own].any()]
        reasons += _against_slivers(joined, result.design)
    return reasons


def _against_slivers(joined: Sequence[Sheet], design: Mesh) -> tuple[Reason, ...]:
    """Return the reasons if parts that are joined to others are smaller than anybody would make."""
    if not joined:
        return ()
    least = least_neck(design.size)
    necks = np.array([neck(sheet.region, least) for sheet in joined])
    measured = too_small(joined, metrics.area(design), design.size, "part")
    return compare(measured | {Code.NECK: Measurement(necks, "part")}, {Code.NECK: least})


def _against_pleats(result: Result, request: StripsRequest) -> tuple[Reason, ...]:
    """Return the reason if strips are pleated; none where their number was named."""
    if not isinstance(result, StripsResult) or not request.is_counted:
        return ()
    return compare({Code.PLEATED: result.ruled.pleat_max}, {})


def _too_large(parts: Sequence[Array], sheet: tuple[float, float]) -> tuple[Reason, ...]:
    """Return the reasons if parts with vertices (k, 2) do not fit a sheet."""
    long, wide = np.array([rectangle(flat)[1] for flat in parts]).T
    measured = {Code.TOO_LONG: Measurement(long), Code.TOO_WIDE: Measurement(wide)}
    return compare(measured, {Code.TOO_LONG: max(sheet), Code.TOO_WIDE: min(sheet)})


def divided(result: Result, request: StripsRequest) -> Result:
    """Return strips divided across where parts are larger than the sheet, if all have rulings."""
    sheet = request.sheet
    pattern = result.pattern
    if sheet is None or pattern is None or not isinstance(result, StripsResult):
        return result
    before = result.details["strips"]
    if isinstance(before, list) and 0 in before:
        return result

    def fits(flat: Array, rings: Sequence[Ints]) -> bool:
        return not _too_large([flat[np.concatenate(rings)]], sheet)

    surface, faces = divided_to_fit(result.ruled, result.design, fits)
    if surface is result.ruled:
        return result
    numbers: int | list[int] = surface.strips
    if isinstance(before, list):
        # Of each piece: the parts before, and one more for each joint.
        owner = result.piece_of_face
        parts = [owner[part.faces[0]] for part in split(pattern.mesh)]
        every = np.concatenate([parts, owner[faces]]).astype(np.int64)
        numbers = np.bincount(every, minlength=len(before)).tolist()
    made = replace(result, **StripsResult.attributes(surface))
    made.details = result.details | {"strips": numbers}
    made.notes = (*result.notes, "strips are divided across, so that parts fit the sheet")
    return made


def on_sheets(result: Result, request: StripsRequest, ways: Sequence[Narrow]) -> Result:
    """Divide strips that are larger than the sheet, and take more where rulings are too long.

    Parameters
    ----------
    result : Result
    request : StripsRequest
    ways : sequence of callable
        Each solves for strips of a largest width, in its own way. It may return None where these
        would be more than a number, if one is given.

    Returns
    -------
    Result
        That with the smallest number of parts among those whose parts fit and that are near
        enough, or else that with the fewest parts. Of as many parts, the nearest.
    """
    sheet = request.sheet
    large = result.ruled is not None and len(against_sheet(result, request)) > 0
    if sheet is None or not large or result.status is Status.CANCELLED:
        return result
    first = divided(result, request)
    best, order = first, _order(first, request)
    # A number that was named stays, and without a distance there is one strip.
    free = request.options.number is None and request.max_deviation is not None
    for widest in sorted(sheet, reverse=True) if free else ():
        for way in ways:
            unfit, failed, parts, _ = order
            # A strip is one part or more.
            other = way(_ROOM * widest, None if unfit or failed else parts)
            if other is None:
                continue
            if other.status is Status.CANCELLED:
                return replace(first, status=Status.CANCELLED)
            other = divided(other, request)
            own = _order(other, request)
            if own < order:
                best, order = other, own
    return best


def _order(result: Result, request: StripsRequest) -> tuple[bool, bool, int, float]:
    """Sort key: parts that fit the sheet first, then no failure, few parts, and near strips."""
    unfit, surface = len(against_sheet(result, request)) > 0, result.ruled
    far = np.inf if surface is None else surface.farthest
    return unfit, result.status.is_failure, _parts(result), far


def longest_ruling(result: Result) -> float:
    """Return the length of the longest ruling; 0 without any."""
    folds = result.rulings
    if folds is None:
        return 0.0
    ends = result.mesh.vertices[folds.edges]
    return float(lengths(ends[:, 1] - ends[:, 0]).max(initial=0.0))


def _parts(result: Result) -> int:
    return 0 if result.pattern is None else len(split(result.pattern.mesh))

"""Strips on sheets: divided along rulings, or more of them, so that every part fits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gso.components import split
from gso.geometry.polygon import rectangle
from gso.geometry.vectors import lengths
from gso.result import Result, StripsResult
from gso.ruled.paneling.strips_request import StripsRequest
from gso.ruled.sheet_division import divided_to_fit
from gso.typing import Array
from gso.verdict import Code, Measurement, Reason, compare

#: Numbers of strips that are tried for the length of a sheet, and for its width.
_TRIES = 4


def against_sheet(result: Result, request: StripsRequest) -> tuple[Reason, ...]:
    """Return the reasons if parts of the pattern are larger than the sheet."""
    pattern, sheet = result.pattern, request.sheet
    if pattern is None or sheet is None:
        return ()
    sizes = [rectangle(pattern.flat[part.vertices])[1] for part in split(pattern.mesh)]
    long, wide = np.array(sizes).T
    measured = {Code.TOO_LONG: Measurement(long), Code.TOO_WIDE: Measurement(wide)}
    return compare(measured, {Code.TOO_LONG: max(sheet), Code.TOO_WIDE: min(sheet)})


def divided(result: Result, request: StripsRequest) -> Result:
    """Return strips divided along rulings where parts are larger than the sheet."""
    sheet = request.sheet
    if sheet is None or not isinstance(result, StripsResult):
        return result

    def fits(flat: Array) -> bool:
        long, wide = rectangle(flat)[1]
        return bool(long <= max(sheet) and wide <= min(sheet))

    surface = divided_to_fit(result.ruled, fits)
    if surface is result.ruled:
        return result
    numbers: int | list[int] = surface.strips
    if isinstance(result.details["strips"], list):
        owner = result.piece_of_face
        numbers = [
            len(np.unique(surface.strip[owner == k])) if before else 0
            for k, before in enumerate(result.details["strips"])
        ]
    made = replace(result, **StripsResult.attributes(surface))
    made.details = result.details | {"strips": numbers}
    return made


def on_sheets(
    result: Result, request: StripsRequest, again: Callable[[int], Result | None]
) -> Result:
    """Divide strips that are larger than the sheet, and take more where rulings are too long.

    Parameters
    ----------
    result : Result
    request : StripsRequest
    again : callable
        Solves for a number of strips.

    Returns
    -------
    Result
        That with the smallest number of parts whose parts fit; that which was given, divided as
        far as it can be, if none does.
    """
    sheet, surface, options = request.sheet, result.ruled, request.options
    if sheet is None or surface is None or not against_sheet(result, request):
        return result
    tried = [divided(result, request)]
    ends = surface.mesh.vertices[surface.rulings.edges]
    longest = float(lengths(ends[:, 1] - ends[:, 0]).max(initial=0.0))
    most = options.max_strips if options.number is None else 0
    for limit in sorted(sheet, reverse=True):
        least = max(int(np.ceil(surface.strips * longest / limit)), surface.strips + 1)
        for count in range(least, min(least + _TRIES, most + 1)):
            other = again(count)
            if other is not None:
                tried.append(divided(other, request))
                if not against_sheet(tried[-1], request):
                    break
    return min(tried, key=lambda one: (len(against_sheet(one, request)) > 0, _parts(one)))


def _parts(result: Result) -> int:
    return 0 if result.pattern is None else len(split(result.pattern.mesh))

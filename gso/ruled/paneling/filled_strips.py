"""Strips of a design with holes: those of the surface without them, from which they are cut."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from gso.mesh import Mesh
from gso.metrics.hole_defects import turning
from gso.result import StripsResult
from gso.ruled.paneling.cut_out import without_holes
from gso.ruled.paneling.hole_filling import filled, holes
from gso.ruled.paneling.light_design import LightDesign
from gso.ruled.paneling.strips_request import StripsRequest
from gso.ruled.paneling.tried_strips import Tried

#: Total curvature of a design from which on it is a dome. Strips around a hole of a dome are better
#: than those across it.
_CURVED = 2.0

#: Strips of a surface: in several ways, or only rings about an axis.
Ways = Callable[[Mesh, StripsRequest, bool], list[Tried]]


def filled_strips(light: LightDesign, request: StripsRequest, ways: Ways) -> Iterator[StripsResult]:
    """Make strips of a design with holes, such as windows, without a verdict.

    Parameters
    ----------
    light : LightDesign
    request : StripsRequest
    ways : callable
        Makes strips of the design without its holes; of a dome only rings.

    Yields
    ------
    StripsResult
        Those that hold the limits before the holes are cut out, the fewest first. There are none
        of designs without holes.
    """
    whole = filled(light.mesh)
    if whole is None:
        return
    domed = len(whole.boundary_loops) == 1 and _curvature(whole) > _CURVED
    request.say("without its holes")
    limits = replace(request.limits, max_deviation=light.allowed)
    tried = [one for one in ways(whole, replace(request, limits=limits), domed) if one.holds]
    outlines = [light.design.vertices[loop] for loop in holes(light.design)]
    for one in sorted(tried, key=lambda one: one.order(few=True)):
        if isinstance(one.result, StripsResult) and _is_one(one.result):
            surface = without_holes(one.result.ruled, light.design, outlines)
            if surface is not None:
                details = one.result.details | {"strips": surface.strips}
                changed = {"pieces": None, **StripsResult.attributes(surface)}
                yield replace(one.result, design=light.design, details=details, **changed)


def _is_one(result: StripsResult) -> bool:
    """Tell whether strips are joined along all seams, and every piece has some."""
    return not (result.ruled.mesh.components.any() or np.equal(result.details["strips"], 0).any())


def _curvature(mesh: Mesh) -> float:
    """Return the total curvature of a surface, by the theorem of Gauss and Bonnet."""
    return float(2.0 * np.pi * mesh.euler_characteristic - turning(mesh).sum())

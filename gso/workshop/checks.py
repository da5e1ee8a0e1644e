"""What cannot be made of fitted panels with the sheet that was asked for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso import metrics
from gso.typing import Array
from gso.workshop.asking import Ask
from gso.workshop.finish import Finish
from gso.workshop.measurements import bend_radius
from gso.workshop.panels import Panel
from gso.workshop.parts import Fitted
from gso.workshop.thickness import Thickness

#: Largest difference of the two sides of a seam that the thickness may add, in sheet thicknesses.
_SEAM = 0.1


def refused(own: Fitted, ask: Ask, finish: Finish) -> list[str]:
    """Return why fitted panels cannot be made, in millimetres; nothing if they can."""
    out = list(own.refused)
    sheet = finish.thickness
    if sheet is None:
        return out
    for panel, before in zip(own.panels, own.made.panels, strict=True):
        out += _of_sheet(panel, before, own.scale, ask, sheet)
    return out + _of_seams(own, ask, sheet)


def _of_sheet(panel: Panel, before: Panel, scale: float, ask: Ask, sheet: Thickness) -> list[str]:
    """Return why a panel cannot be made of a sheet; `before`: as it was, in the design's unit."""
    import shapely

    thick = f"a sheet of {sheet.sheet:g} mm"
    if not len(panel.bends):
        radius = scale * bend_radius(before)
        strain = sheet.strain(1.0 / radius)
        if 0.5 * sheet.sheet >= radius:
            return [f"{panel.name}: {thick} is too thick for its radius of {radius:.4g} mm"]
        if strain > ask.strain:
            return [
                f"{panel.name} has no bend lines, so its pattern is that of the design's surface; "
                f"the neutral surface of {thick} is longer or shorter by up to "
                f"{100 * strain:.3g} % (take --face middle and --k-factor 0.5, or a thinner sheet)"
            ]
        return []
    turn = np.degrees(np.abs(panel.angles))
    if sheet.table is not None:
        last = float(np.degrees(np.asarray(sheet.table, float)[-1, 0]))
        if turn.max() > last + 1e-9:
            return [
                f"{panel.name} has a bend of {turn.max():.4g} degrees, and the bend table ends at "
                f"{last:.4g}"
            ]
    elif sheet.radius is None and panel.radii.min() <= 0.0:
        k = int(panel.radii.argmin())
        radius = float(panel.radii[k]) + float(sheet.depth(panel.angles[k]))
        return [
            f"{panel.name}: {thick} is too thick to be rolled to a radius of {radius:.4g} mm (a "
            "fold needs --bend-radius)"
        ]
    elif sheet.radius is not None:
        near = _bends_too_near(panel, sheet)
        if near:
            return [near]
    inverted = int(metrics.flips(panel.surface, panel.flat))
    outline = shapely.Polygon(panel.flat[panel.loops[0]])
    if inverted or not outline.is_valid:
        return [f"{panel.name}: its bends are too near each other for {thick}"]
    return []


def _bends_too_near(panel: Panel, sheet: Thickness) -> str | None:
    """Name two neighbouring bends that need more room than there is between them."""
    import shapely

    lines = panel.flat[panel.bends]
    wide = np.abs(panel.angles) * (float(sheet.radius or 0.0) + sheet.k * sheet.sheet)
    segments = shapely.linestrings(lines)
    middle = shapely.points(lines.mean(axis=1))
    tree = shapely.STRtree(segments)
    one, two = tree.query(middle, predicate="dwithin", distance=float(wide.max()))
    other = one != two
    one, two = one[other], two[other]
    if not len(one):
        return None
    apart: Array = shapely.distance(middle[one], segments[two])
    needed = 0.5 * (wide[one] + wide[two])
    k = int((needed - apart).argmax())
    if needed[k] <= apart[k]:
        return None
    return (
        f"{panel.name}: two bends are {apart[k]:.3g} mm apart, and folded with a radius of "
        f"{sheet.radius:g} mm they need {needed[k]:.3g} mm"
    )


def _of_seams(own: Fitted, ask: Ask, sheet: Thickness) -> list[str]:
    """Tell whether the thickness makes the sides of a seam differ in length."""
    worst, why = 0.0, []
    for seam in own.made.matings:
        bound = own.scale * (seam.mismatch(own.made.panels) + ask.strain * seam.length)
        apart = seam.mismatch(own.panels)
        more = apart - bound - _SEAM * sheet.sheet
        if more > worst:
            names = _names(own.panels, (seam.one.panel, seam.two.panel))
            worst = more
            why = [
                f"the sides of seam {seam.number} of {names} differ by {apart:.3g} mm in a sheet "
                f"of {sheet.sheet:g} mm"
            ]
    return why


def _names(panels: Sequence[Panel], numbers: tuple[int, int]) -> str:
    return " and ".join(dict.fromkeys(panels[k].name for k in numbers))

"""Whether fitted panels can be made of the sheet that was asked for."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gso import metrics
from gso.geometry.flat_region import neck, region
from gso.seams.sheets import least_neck
from gso.typing import Array
from gso.verdict import Code, Measurement, Reason, compare, ordered
from gso.workshop.fabrication_settings import FabricationSettings
from gso.workshop.finish import Finish
from gso.workshop.measurements import bend_radius
from gso.workshop.panels import Panel
from gso.workshop.parts import Fitted
from gso.workshop.thickness import Thickness

#: Largest difference of the two sides of a seam that the thickness may add, in sheet thicknesses.
_SEAM = 0.1
#: Smallest inner radius of a fold, in sheet thicknesses: beyond it the outside of the sheet tears.
_SHARPEST = 0.4

#: A code with a value and its bound.
Row = tuple[Code, float, float]


def judge_sheet(own: Fitted, settings: FabricationSettings, finish: Finish) -> tuple[Reason, ...]:
    """Return why fitted panels cannot be made, in millimetres; nothing if they can."""
    sheet = finish.thickness
    known = [*own.reasons, *_necks(own, finish.kerf)]
    if sheet is None:
        return ordered(known)
    parts: list[tuple[str, Row]] = []
    for panel, before in zip(own.panels, own.made.panels, strict=True):
        if len(panel.bends):
            rows = _bends(panel, own.scale * before.radii, sheet)
        else:
            rows = _rolled(own.scale * bend_radius(before), settings, sheet)
        parts += [(panel.name, row) for row in rows]
    reasons = [
        *known,
        *_compared("part", parts),
        *_compared("seam", _seams(own, settings, sheet)),
    ]
    # Overlaps are what follows from the other faults.
    named = {name for reason in reasons for name in reason.places.ids}
    bad = [p.name for p in own.panels if p.name not in named and _overlaps(p)]
    return ordered([*reasons, *compare({Code.BENDS_OVERLAP: Measurement.count("part", bad)}, {})])


def _necks(own: Fitted, kerf: float) -> tuple[Reason, ...]:
    """Return why parts are too narrow: less than the kerf or, with seams, a share of the size."""
    pairs = [(seam.one.panel, seam.two.panel) for seam in own.made.matings]
    joined = {k for one, two in pairs if one != two for k in (one, two)}
    share = least_neck(own.made.record["size"] * own.scale)
    rows = []
    for number, panel in enumerate(own.panels):
        least = max(kerf, share if number in joined else 0.0)
        if least > 0:
            outline, *holes = (panel.flat[loop] for loop in panel.loops)
            rows.append((panel.name, (Code.NECK, neck(region(outline, holes), least), least)))
    return _compared("part", rows)


def _compared(kind: str, rows: list[tuple[str, Row]]) -> tuple[Reason, ...]:
    """Compare measured values of places of some kind."""
    measured, bounds = {}, {}
    for code in {code for _, (code, *_) in rows}:
        own = [(name, *row[1:]) for name, row in rows if row[0] is code]
        names, values, limits = zip(*own, strict=True)
        measured[code], bounds[code] = Measurement(np.array(values), kind, names), limits
    return compare(measured, bounds)


def _rolled(radius: float, settings: FabricationSettings, sheet: Thickness) -> Iterator[Row]:
    """Measure a panel without bend lines, which is bent to some radius."""
    yield Code.TOO_THICK, radius, 0.5 * sheet.sheet
    yield Code.NEUTRAL_STRAIN, sheet.strain(1.0 / radius), settings.strain


def _bends(panel: Panel, radii: Array, sheet: Thickness) -> Iterator[Row]:
    """Measure the bends of a panel, whose surface has some radii there (b,)."""
    if panel.rolled.any():
        yield _sharpest(panel.angles[panel.rolled], radii[panel.rolled], sheet)
    folded = ~panel.rolled
    if not folded.any():
        return
    if sheet.table is not None:
        turn = np.degrees(np.abs(panel.angles[folded]))
        last = float(np.degrees(np.asarray(sheet.table, float)[-1, 0]))
        yield Code.BEND_ANGLE, float(turn.max()), last
    elif sheet.radius is None:
        yield _sharpest(panel.angles[folded], radii[folded], sheet)
    else:
        yield Code.TOOL_RADIUS, sheet.radius, _SHARPEST * sheet.sheet
        yield from _nearest(panel, sheet)


def _sharpest(angles: Array, radii: Array, sheet: Thickness) -> Row:
    """Measure the bend of the smallest inner radius, which is rolled to that of the surface."""
    depth = sheet.depth(angles)
    k = int((radii - depth).argmin())
    return Code.TOO_THICK, float(radii[k]), max(float(depth[k]), _SHARPEST * sheet.sheet)


def _nearest(panel: Panel, sheet: Thickness) -> Iterator[Row]:
    """Measure the two neighbouring bends that lack most room."""
    import shapely

    bends = [b for b in panel.lines if b.zone < 0 or panel.zones[b.zone].pressed]
    lines = np.array([bend.line for bend in bends])
    wide = np.array([abs(bend.angle) * (bend.radius + sheet.k * sheet.sheet) for bend in bends])
    segments = shapely.linestrings(lines)
    middle = shapely.points(lines.mean(axis=1))
    tree = shapely.STRtree(segments)
    one, two = tree.query(middle, predicate="dwithin", distance=float(wide.max()))
    other = one != two
    one, two = one[other], two[other]
    if len(one):
        apart: Array = shapely.distance(middle[one], segments[two])
        needed = 0.5 * (wide[one] + wide[two])
        k = int((needed - apart).argmax())
        yield Code.BENDS_NEAR, float(apart[k]), float(needed[k])


def _overlaps(panel: Panel) -> bool:
    """Whether a panel with bends has a pattern that crosses itself."""
    import shapely

    if not len(panel.bends):
        return False
    outline = shapely.Polygon(panel.flat[panel.loops[0]])
    return bool(metrics.flips(panel.surface, panel.flat)) or not outline.is_valid


def _seams(own: Fitted, settings: FabricationSettings, sheet: Thickness) -> list[tuple[str, Row]]:
    """Measure how much the sides of seams differ in length, by the thickness or the strain."""
    rows = []
    for seam in own.made.matings:
        strained = seam.mismatch(own.made.panels) + settings.strain * seam.length
        bound = own.scale * strained + _SEAM * sheet.sheet
        both = dict.fromkeys(own.panels[k].name for k in (seam.one.panel, seam.two.panel))
        name = f"{seam.number} ({', '.join(both)})"
        rows.append((name, (Code.SEAM_SIDES, seam.mismatch(own.panels), bound)))
    return rows

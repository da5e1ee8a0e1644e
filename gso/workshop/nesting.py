"""Nesting: parts on sheets, with distances between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from gso.errors import OptionError
from gso.geometry.flat_region import moved
from gso.geometry.polygon import anticlockwise, signed_area
from gso.geometry.steady import steady
from gso.quantities import as_positive
from gso.typing import Array
from gso.wording import logged
from gso.workshop import sparrow
from gso.workshop.part import Drawing, Part
from gso.workshop.rectangles import ORDERS, packed

#: Largest number of corners of the polygons that are nested.
_CORNERS = 150
#: Tolerance of distances in the result, and what is asked for more, in millimetres.
_TIGHT, _MORE = 1e-6, 1e-3
#: Number of rotations that are tried where any is allowed, for rectangles.
_ANY = 4
#: Least time for a sheet, and how much more than a sheet's area is tried on it.
_LEAST, _TRIED = 0.5, 1.4
#: Share of the density of a first attempt that the second one aims at.
_FULL = 1.0
#: Largest number of sheets.
_MOST = 500

Say = Callable[[str], None]
#: Allowed angles in degrees, how many of them, or "any".
Rotations: TypeAlias = "Sequence[float] | int | str"
#: Parts in their places in the room of each sheet.
Sheets = list[list[Part]]


@dataclass(frozen=True, eq=False)
class Nested:
    """Parts on sheets.

    Attributes
    ----------
    sheets : tuple of Drawing
        Each with its parts in their places, every copy for itself.
    utilisation : tuple of float
        Area of the parts over that of the sheet, for each sheet.
    density : float
        Area of the parts over that of the sheets; of the last one the rectangle about its parts
        counts.
    method : {"spyrrow", "rectangles"}
    notes : tuple of str
    """

    sheets: tuple[Drawing, ...]
    utilisation: tuple[float, ...]
    density: float
    method: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Item:
    """A part to be nested, about the origin.

    Attributes
    ----------
    part : Part
    shape : ndarray, (k, 2)
        A polygon about it.
    border : float
        Largest distance between both.
    angles : tuple of float, or None
        Allowed rotations in degrees, None for all.
    """

    part: Part
    shape: Array
    border: float
    angles: tuple[float, ...] | None


def nest(
    parts: Sequence[Part],
    sheet: tuple[float, float],
    *,
    spacing: float = 2.0,
    margin: float = 0.0,
    rotations: Rotations = (0, 180),
    seconds: float = 10.0,
    seed: int = 0,
    method: str | None = None,
    callback: Say | None = None,
) -> Nested:
    """Nest parts on sheets of one size.

    Parameters
    ----------
    parts : sequence of Part
        Each is placed as often as its `count` says; holes stay empty. Parts with a grain are
        turned by 0 or 180 degrees, or so that their grain runs along the sheet.
    sheet : (float, float)
        Length and width, in millimetres.
    spacing, margin : float
        Distance between parts, and from the border of the sheet.
    rotations : sequence of float, int, or "any"
        Allowed angles in degrees, or how many of them, evenly.
    seconds : float
        Time in all, about.
    seed : int
        Of the search of spyrrow, which goes on for the given time: on another machine it may find
        another nesting.
    method : {"spyrrow", "rectangles"}, optional
        The denser of both when not given.
    callback : callable, optional
        Called with what is being done.

    Returns
    -------
    Nested

    Raises
    ------
    OptionError
        A part is larger than the sheet, or an option is wrong.

    Examples
    --------
    >>> square = Part("a", np.array([[0.0, 0], [40, 0], [40, 40], [0, 40]]), count=4)
    >>> nested = nest([square], (100.0, 100.0), spacing=5.0, method="rectangles")
    >>> len(nested.sheets), len(nested.sheets[0].parts), round(nested.utilisation[0], 2)
    (1, 4, 0.64)
    """
    say = logged(callback)
    room = checked_options(sheet, spacing, margin, rotations, seconds)
    _check_parts(parts, method)
    items = [_item(part, rotations, spacing) for part in parts]
    best = _rectangles(items, room, spacing)
    notes: tuple[str, ...] = ()
    if method != "rectangles":
        each = seconds / len(best)
        placed, why = None, f"{seconds:g} seconds are too few for {len(best)} sheets"
        if each >= _LEAST or method == "spyrrow":
            placed, why = _sparrow(items, room, spacing, each, seed, say)
        if placed is None:
            notes = (f"nested by rectangles: {why}",)
        elif method == "spyrrow" or _value(placed) < _value(best):
            return _result(placed, sheet, margin, "spyrrow", ())
    return _result(best, sheet, margin, "rectangles", notes)


def _checked_sheet(sheet: object) -> Array:
    """Return length and width of a sheet as an array (2,).

    Raises
    ------
    OptionError
        They are not two positive lengths.
    """
    try:
        size = np.asarray(sheet, float)
    except (TypeError, ValueError):
        size = np.empty(0)
    if size.shape != (2,) or not ((size > 0) & np.isfinite(size)).all():
        raise OptionError(f"sheet is {sheet!r}; it must be length and width in millimetres")
    return size


def checked_options(
    sheet: tuple[float, float],
    spacing: float = 0.0,
    margin: float = 0.0,
    rotations: Rotations = (0, 180),
    seconds: float = 1.0,
) -> tuple[float, float]:
    """Check the options of :func:`nest`; return the room inside the margin, in millimetres.

    Raises
    ------
    OptionError
        An option is wrong.
    """
    size = _checked_sheet(sheet)
    _angles(rotations)
    as_positive(spacing, "spacing", zero=True)
    as_positive(margin, "margin", zero=True)
    as_positive(seconds, "seconds")
    long, wide = (size - 2.0 * margin).tolist()
    if min(long, wide) <= 0:
        raise OptionError(f"margin is {margin!r}, which leaves nothing of the sheet; lower it")
    return long, wide


def _check_parts(parts: Sequence[Part], method: str | None) -> None:
    import shapely

    if method not in (None, "spyrrow", "rectangles"):
        raise OptionError(f"no method {method!r}; take 'spyrrow' or 'rectangles'")
    if not parts:
        raise OptionError("there are no parts to nest")
    for part in parts:
        if not shapely.Polygon(part.outline).is_valid:
            raise OptionError(f"part {part.name} cannot be nested: its outline crosses itself")


def _item(part: Part, rotations: Rotations, spacing: float) -> _Item:
    """Return a part about the origin, with a simple polygon that has half the spacing about it."""
    import shapely

    own = part.shifted(-part.outline.mean(axis=0))
    angles = _angles(rotations)
    if part.grain is not None:
        turn = -float(np.degrees(np.arctan2(part.grain[1], part.grain[0])))
        angles = (turn, turn + 180.0)
    grow = 1e-4 * float(np.ptp(own.outline, axis=0).max())
    while True:
        by = 0.5 * spacing + _MORE + grow
        wider = moved(shapely.Polygon(own.outline), by, 2.0)
        simple = shapely.simplify(wider, grow)
        outline = np.asarray(simple.exterior.coords)[:-1]
        if len(outline) <= _CORNERS:
            break
        grow *= 2.0
    return _Item(own, anticlockwise(outline), by, angles)


def _angles(rotations: Rotations) -> tuple[float, ...] | None:
    if isinstance(rotations, str) and rotations == "any":
        return None
    if isinstance(rotations, int | np.integer) and not isinstance(rotations, bool):
        if rotations >= 1:
            return tuple(360.0 * k / int(rotations) for k in range(int(rotations)))
    else:
        try:
            some = np.asarray(rotations, float)
        except (TypeError, ValueError):
            some = np.empty((0, 0))
        if some.ndim == 1 and some.size and np.isfinite(some).all():
            return tuple(some.tolist())
    raise OptionError(f"rotations is {rotations!r}; it must be angles, their number, or 'any'")


def _rectangles(items: Sequence[_Item], room: tuple[float, float], spacing: float) -> Sheets:
    """Pack bounding rectangles in several orders, and return the best."""
    from gso.geometry.polygon import rectangle

    copies: list[tuple[int, list[float]]] = []
    sizes = []
    for number, item in enumerate(items):
        if item.angles is None:
            flat = -float(np.degrees(rectangle(item.part.outline)[0]))
            angles = [flat + 360.0 * k / _ANY for k in range(_ANY)]
        else:
            angles = list(item.angles)
        turned = [item.part.turned(np.radians(a)).size for a in angles]
        fits = [
            k for k, (x, y) in enumerate(turned) if x <= room[0] + _TIGHT and y <= room[1] + _TIGHT
        ]
        if not fits:
            x, y = turned[0]
            raise OptionError(
                f"part {item.part.name} is {x:.4g} by {y:.4g} mm, larger than the sheet of "
                f"{room[0]:.4g} by {room[1]:.4g} mm: take larger sheets or more rotations"
            )
        own = [angles[k] for k in fits]
        copies += [(number, own)] * item.part.count
        grown = [(turned[k][0] + spacing, turned[k][1] + spacing) for k in fits]
        sizes += [grown] * item.part.count
    tried = []
    for order in ORDERS:
        placed = packed(sizes, (room[0] + spacing, room[1] + spacing), order)
        found: Sheets = [[] for _ in range(1 + max(place.sheet for place in placed))]
        for place in placed:
            number, angles = copies[place.item]
            part = items[number].part.turned(np.radians(angles[place.choice]))
            part = replace(part.shifted(np.array([place.x, place.y]) - part.low), count=1)
            found[place.sheet].append(part)
        tried.append(found)
    return min(tried, key=_value)


def _sparrow(
    items: Sequence[_Item],
    room: tuple[float, float],
    spacing: float,
    seconds: float,
    seed: int,
    say: Say,
) -> tuple[Sheets | None, str]:
    """Fill sheet after sheet: what goes beyond a sheet is nested again on the next."""
    left = {k: item.part.count for k, item in enumerate(items)}
    out: Sheets = []
    # With the smallest border no part is beyond the sheet; the largest part may need its own.
    border = min(item.border for item in items)
    for item in items:
        if min(item.part.size) + 2.0 * item.border > room[1] + 2.0 * border:
            border = max(item.border for item in items)
    for sheet in range(_MOST):
        if not any(left.values()):
            return (out, "") if _apart(out, spacing) else (None, "distances were not kept")
        say(f"nesting sheet {sheet + 1}: {sum(left.values())} parts left")
        best: list[tuple[int, Part]] = []
        share, height = _TRIED, room[1] + 2.0 * border
        # First more than fits, to see how dense it becomes; then as much as should fit.
        for attempt in range(2):
            asked, chosen = _some(items, left, room, share)
            placed, why = sparrow.solved(asked, height, 0.5 * seconds, seed)
            if placed is None:
                return None, why
            every, inside = _inside(items, chosen, placed, room)
            if sum(part.area for _, part in inside) > sum(part.area for _, part in best):
                best = inside
            if len(inside) == len(every) == sum(left.values()):
                break
            long = max(float(part.low[0] + part.size[0]) for _, part in every)
            share = _FULL * sum(part.area for _, part in every) / (long * room[1])
            if attempt == 0 and len(inside) == len(every):
                break
        if not best:
            return None, "spyrrow placed no part inside the sheet"
        out.append([part for _, part in best])
        for k, _ in best:
            left[k] -= 1
    return None, f"more than {_MOST} sheets"


def _inside(
    items: Sequence[_Item],
    chosen: Sequence[int],
    placed: Sequence[dict[str, float]],
    room: tuple[float, float],
) -> tuple[list[tuple[int, Part]], list[tuple[int, Part]]]:
    """Place parts as they were nested; return all of them, and those inside the sheet."""
    own = []
    for one in placed:
        k = chosen[int(one["item"])]
        part = items[k].part.turned(np.radians(one["angle"]))
        own.append((k, replace(part.shifted(np.array([one["x"], one["y"]])), count=1)))
    low = np.min([part.low for _, part in own], axis=0)
    own = [(k, part.shifted(-low)) for k, part in own]
    limit = np.array(room) + _TIGHT
    inside = [(k, part) for k, part in own if (part.low + part.size <= limit).all()]
    return own, inside


def _some(
    items: Sequence[_Item], left: dict[int, int], room: tuple[float, float], share: float
) -> tuple[list[dict[str, object]], list[int]]:
    """Choose the largest parts that are left, with a share of the area of a sheet."""
    asked: list[dict[str, object]] = []
    chosen: list[int] = []
    area = 0.0
    for k in sorted((k for k, n in left.items() if n), key=lambda k: -items[k].part.area):
        own = signed_area(items[k].shape)
        count = min(left[k], int((share * room[0] * room[1] - area) / own))
        count = max(count, 0 if chosen else 1)
        if count < 1:
            continue
        area += count * own
        chosen.append(k)
        asked.append({"shape": items[k].shape.tolist(), "count": count, "angles": items[k].angles})
    return asked, chosen


def _apart(sheets: Sheets, spacing: float) -> bool:
    """Check that the parts on each sheet are at least a distance apart."""
    import shapely

    for parts in sheets:
        shapes = np.array([shapely.Polygon(part.outline) for part in parts])
        tree = shapely.STRtree(shapes)
        one, two = tree.query(shapes, predicate="dwithin", distance=max(spacing - _TIGHT, 0.0))
        one, two = one[one < two], two[one < two]
        meets = steady(shapely.intersection, shapes[one], shapes[two])
        if spacing > _TIGHT and len(one):
            return False
        if (shapely.area(meets) > _TIGHT).any():
            return False
    return True


def _used(parts: Sequence[Part]) -> float:
    """Return the area of the rectangle about the parts on a sheet."""
    return float(np.max([part.low + part.size for part in parts], axis=0).prod())


def _value(sheets: Sheets) -> tuple[int, float]:
    """Rank nestings, lower is better."""
    return len(sheets), _used(sheets[-1])


def _result(
    placed: Sheets,
    sheet: tuple[float, float],
    margin: float,
    method: str,
    notes: tuple[str, ...],
) -> Nested:
    long, wide = (float(x) for x in sheet)
    sheets, shares = [], []
    for number, parts in enumerate(placed, start=1):
        own = tuple(part.shifted(np.array([margin, margin])) for part in parts)
        sheets.append(Drawing(own, (long, wide), f"sheet {number}"))
        shares.append(sum(part.area for part in own) / (long * wide))
    whole = len(placed) - 1 + _used(placed[-1]) / (long * wide)
    return Nested(tuple(sheets), tuple(shares), sum(shares) / whole, method, notes)

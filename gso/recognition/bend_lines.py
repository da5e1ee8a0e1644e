"""Lines in the plane along which faces are bent or rolled, with their radii and angles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

import numpy as np

from gso.errors import OptionError
from gso.quantities import Length, as_length
from gso.recognition.flat_images import Part, RoundImage
from gso.recognition.round_surface import RoundSurface
from gso.typing import Array, Flags, Ints

#: The angle between bend lines for a radius.
Step: TypeAlias = Callable[[float], float]

#: Chord tolerance by default, relative to the size, and the angles between which it is kept.
_CHORD, _FINEST, _COARSEST = 1e-4, np.radians(2.0), np.radians(15.0)
#: Gap, relative to the size, up to which pieces of a line are one.
_JOINED = 1e-7


@dataclass(frozen=True)
class BendLine:
    """A ruling of a face, in the plane.

    Attributes
    ----------
    start, end : ndarray, (2,)
    radius_start, radius_end : float
        Radius of curvature of the surface at the ends, in the unit of the mesh.
    angle : float
        Angle by which the surface turns between the middles of this line and of its neighbours,
        in radians; half of that at a limiting line. The sum over a zone is its bend angle.
    up : bool
        The sheet beside it bends towards the side from which the flat image is seen.
    limit : bool
        The line is one of the two that limit the zone.
    """

    start: Array
    end: Array
    radius_start: float
    radius_end: float
    angle: float
    up: bool
    limit: bool = False


def bend_step_of(asked: Length | None, size: float, unit: str = "mm") -> Step:
    """Return the function that gives the angle between bend lines, in radians, for a radius.

    Parameters
    ----------
    asked : float or str, optional
        An angle in degrees, 15 or "15deg", or how far chords between bend lines may be from the
        surface, such as "0.5mm" or "0.1%" of the size. By default :func:`default_step`.
    size : float
        Diagonal of the bounding box.
    unit : str
        Unit of the coordinates.

    Raises
    ------
    OptionError
        It is neither, or no angle between 0 and 180 degrees.

    Examples
    --------
    >>> float(np.degrees(bend_step_of("0.5mm", 100.0)(20.0)).round(3))
    25.677
    """
    if asked is None:
        return partial(default_step, size=size)
    word = asked.strip() if isinstance(asked, str) else f"{asked}"
    degrees = word.removesuffix("deg")
    if degrees != word or not isinstance(asked, str):
        try:
            angle = float(degrees)
        except ValueError:
            angle = np.nan
        if not 0.0 < angle < 180.0:
            raise OptionError(
                f"bend_step is {asked!r}; it must be an angle such as 15 or '15deg', or a distance "
                "of chords such as '0.5mm'"
            )
        return lambda radius: float(np.radians(angle))
    chord = as_length(asked, "bend_step", diagonal=size, unit=unit)
    return lambda radius: float(2 * np.arccos(np.clip(1.0 - chord / radius, 0.0, 1.0)))


def default_step(radius: float, size: float) -> float:
    """Return the angle between bend lines for a chord tolerance of 1e-4 of the size, 2 to 15 deg.

    >>> round(float(np.degrees(default_step(1500.0, 6900.0))), 2)
    3.48
    """
    step = 2 * np.arccos(max(1.0 - _CHORD * size / radius, 0.0))
    return float(np.clip(step, _FINEST, _COARSEST))


def lines_of_round(
    part: Part, surface: RoundSurface, image: RoundImage, step: float
) -> tuple[BendLine, ...]:
    """Place bend lines on a cylinder or cone, evenly between its limiting lines.

    Parameters
    ----------
    part : Part
    surface : RoundSurface
    image : RoundImage
    step : float
        Largest angle between neighbouring lines, in radians.
    """
    low, high = float(image.angle.min()), float(image.angle.max())
    count = max(int(np.ceil((high - low) / step - 1e-9)), 1)
    angles = np.linspace(low, high, count + 1)
    turn = (high - low) / count * np.cos(surface.half_angle)
    out = surface.normals(part.points[part.triangles].mean(axis=1))
    corners = part.points[part.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    up = float(np.einsum("td,td->", out, normal)) < 0
    # Along a ruling, both coordinates of the plane are linear in this one.
    along = image.flat[..., 1] if not surface.slope else np.hypot(*np.moveaxis(image.flat, -1, 0))
    scale = float(np.abs(image.flat).max())
    found = []
    for k, angle in enumerate(angles):
        limit = k in (0, count)
        # The outline is met just inside of it.
        shift = (high - low) * 1e-9 * ((k == 0) - (k == count))
        for begin, end in _clipped(image.angle, along, angle + shift, _JOINED * scale):
            if surface.slope:
                turned = (angle - image.angle.mean()) * np.sin(surface.half_angle)
                ray = np.array([np.cos(turned), image.sign * np.sin(turned)])
                ends = (begin * ray, end * ray)
                tangent = np.tan(surface.half_angle)
                radii = (begin * tangent, end * tangent)
            else:
                u = image.sign * surface.radius * angle
                ends = (np.array([u, begin]), np.array([u, end]))
                radii = (surface.radius, surface.radius)
            found.append(BendLine(*ends, *radii, turn / 2 if limit else turn, up, limit))
    return tuple(found)


def _clipped(angle: Array, along: Array, at: float, gap: float) -> list[tuple[float, float]]:
    """Intervals in which a ruling at an angle lies in the triangles of a face."""
    side = angle - at
    hit = (side.min(axis=1) <= 0) & (side.max(axis=1) >= 0) & (np.ptp(side, axis=1) > 0)
    s, v = side[hit], along[hit]
    low, high = np.full(len(s), np.inf), np.full(len(s), -np.inf)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        cross = (np.minimum(s[:, i], s[:, j]) <= 0) & (np.maximum(s[:, i], s[:, j]) >= 0)
        run = s[:, j] - s[:, i]
        level = run == 0
        share = np.where(level, 0.0, -s[:, i] / np.where(level, 1.0, run))
        value = v[:, i] + share * (v[:, j] - v[:, i])
        low = np.where(cross, np.minimum(low, value), low)
        high = np.where(cross, np.maximum(high, value), high)
        other = np.where(cross & level, v[:, j], value)
        low = np.where(cross, np.minimum(low, other), low)
        high = np.where(cross, np.maximum(high, other), high)
    order = np.argsort(low, kind="stable")
    low, high = low[order], high[order]
    if not len(low):
        return []
    reach = np.maximum.accumulate(high)
    new = np.append(True, low[1:] > reach[:-1] + gap)
    ends = np.append(np.flatnonzero(new)[1:], len(low)) - 1
    pieces = zip(low[new], reach[ends], strict=True)
    return [(float(a), float(b)) for a, b in pieces if b - a > gap]


def lines_of_strip(
    part: Part, flat: Array, facet: Ints, fold: Array, together: Flags
) -> tuple[BendLine, ...]:
    """Make a bend line of each fold of a torsal face, with the radius at both ends.

    The radius is the mean distance to the neighbouring folds, divided by the fold angle.

    Parameters
    ----------
    part : Part
    flat : ndarray, (k, 3, 2)
    facet : ndarray of int, (k,)
    fold : ndarray, (e,)
        Fold at each pair's edge, in radians, positive where the surface is convex.
    together : ndarray of bool, (e,)
        Pairs that are joined in the plane.
    """
    pairs = part.pairs
    use = (facet[pairs[:, 0]] != facet[pairs[:, 1]]) & together
    which = np.flatnonzero(use)
    if not len(which):
        return ()
    count = int(facet.max()) + 1
    low, high = np.sort(facet[pairs[which]], axis=1).T
    _, group = np.unique(low * count + high, return_inverse=True)
    group = group.ravel()
    first = np.unique(group, return_index=True)[1]
    triangle = pairs[which, 0]
    ends = []
    for end in (0, 1):
        corner = (part.triangles[triangle] == part.ends[which, end, None]).argmax(axis=1)
        ends.append(flat[triangle, corner])
    a, b = ends
    # The two farthest points of each ruling.
    reach = np.linalg.norm(b - a, axis=1)
    order = np.lexsort((-reach, group))
    lead = order[np.searchsorted(group[order], np.arange(len(first)))]
    origin, along = a[lead], (b - a)[lead] / np.maximum(reach[lead], 1e-300)[:, None]
    at = np.stack([np.einsum("ed,ed->e", p - origin[group], along[group]) for p in ends])
    begin, stop = np.full(len(first), np.inf), np.full(len(first), -np.inf)
    np.minimum.at(begin, group, at.min(axis=0))
    np.maximum.at(stop, group, at.max(axis=0))
    start, end_ = origin + begin[:, None] * along, origin + stop[:, None] * along
    angle = np.zeros(len(first))
    np.maximum.at(angle, group, np.abs(fold[which]))
    outer = [flat[facet == f].reshape(-1, 2) for f in range(count)]
    width = np.stack([_widths(low, high, group, p, start, end_, outer) for p in (start, end_)])
    radius = width / (2 * np.sin(np.maximum(angle, 1e-12) / 2))
    up = np.zeros(len(first))
    np.add.at(up, group, fold[which])
    return tuple(
        BendLine(
            start[k], end_[k], float(radius[0, k]), float(radius[1, k]), float(angle[k]),
            bool(up[k] < 0),
        )
        for k in range(len(first))
    )  # fmt: skip


def _widths(
    low: Ints, high: Ints, group: Ints, at: Array, start: Array, end: Array, outer: list[Array]
) -> Array:
    """Mean width of the two facets beside each ruling, at a point of it.

    To the other ruling of the facet, or to its vertices where it has no other.
    """
    first = np.unique(group, return_index=True)[1]
    facets = np.stack([low[first], high[first]], axis=1)
    rulings: list[list[int]] = [[] for _ in outer]
    for k, pair in enumerate(facets.tolist()):
        for f in pair:
            rulings[f].append(k)
    width = np.zeros(len(first))
    for k, pair in enumerate(facets.tolist()):
        for f in pair:
            others = [line for line in rulings[f] if line != k]
            if others:
                width[k] += min(_distance(at[k], start[j], end[j]) for j in others) / 2
                continue
            along = (end[k] - start[k]) / np.linalg.norm(end[k] - start[k])
            d = outer[f] - at[k]
            off = np.abs(d[:, 0] * along[1] - d[:, 1] * along[0])
            far = off > _JOINED * max(float(off.max()), 1e-300)
            nearest = np.abs(d[far] @ along).argmin()
            width[k] += off[far][nearest] / 2
    return width


def _distance(point: Array, start: Array, end: Array) -> float:
    """Distance of a point from the line through two others."""
    along, d = end - start, point - start
    return float(abs(along[0] * d[1] - along[1] * d[0]) / np.hypot(*along))

"""Gores: bodies of revolution in equal strips along the meridians.

Each gore is a general cylinder. Its rulings are perpendicular to its own meridian plane, and it
ends at the meridian planes half-way to its neighbours, with which it shares its edges exactly. Its
cross-section is the profile with all radii times one factor, so that the body's circles become
polygons that are as far inside of them as outside.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from gso import metrics
from gso.geometry.polygon import arc_lengths, rectangle
from gso.mesh import Mesh
from gso.pattern import Folded
from gso.ruled.fold_lines import bend_radii
from gso.seams.candidates import Candidate
from gso.seams.cutting import cut
from gso.seams.kinds import Edges
from gso.seams.options import PieceSettings
from gso.seams.revolution import Revolution
from gso.seams.search_result import packed
from gso.seams.segmentation import Segmentation
from gso.seams.sheets import Sheet
from gso.typing import Array, Flags, Ints
from gso.unknowns.tangents import tangents

_N = TypeVar("_N", bound=np.generic)

#: Least and largest number of gores.
_FEWEST, _MOST = 3, 400
#: Number of numbers of gores that are measured.
_ROUNDS = 8
#: Least share of the allowed distance that gores may use.
_LITTLE = 0.01
_NO_EDGES = np.empty((0, 2), np.int64)
#: Places across a gore: its two edges, and its meridian in the middle.
_SIDES = np.array([-1.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Gores:
    """A body of revolution in gores.

    Attributes
    ----------
    body : Revolution
    count : int
        Number of gores, at least 3.

    Examples
    --------
    >>> barrel = np.array([[1.0, 1.0], [1.2, 0.0], [1.0, -1.0]])
    >>> gores = Gores(Revolution(np.zeros(3), np.array([0.0, 0.0, 1.0]), barrel, 0.0), 6)
    >>> gores.mesh, len(gores.candidate().pieces)
    (Mesh(36 vertices, 24 faces, quads), 6)
    """

    body: Revolution
    count: int

    @property
    def section(self) -> Array:
        """Radius and height (p, 2) along the middle of a gore."""
        half = np.cos(np.pi / self.count)
        return np.asarray(self.body.profile * [2.0 * half / (1.0 + half), 1.0])

    @property
    def pattern(self) -> Array:
        """Positions (p, 3, 2) along the profile, and across: one edge, the middle, the other."""
        section = self.section
        width = np.tan(np.pi / self.count) * section[:, :1] * _SIDES
        along = np.broadcast_to(arc_lengths(section)[:, None], width.shape)
        return np.stack([along, width], axis=2)

    @cached_property
    def mesh(self) -> Mesh:
        """The gores as one mesh, with planar faces between rulings.

        Its vertices are numbered round the axis, edges and middles of gores in turn, ring by ring.
        """
        section, steps = self.section, 2 * self.count
        turn = np.pi * np.arange(steps) / self.count
        # Edges of gores are farther out than their middles.
        far = np.where(np.arange(steps) % 2 == 0, 1.0 / np.cos(np.pi / self.count), 1.0)
        one, two = tangents(self.body.axis[None])
        round_it = np.cos(turn)[:, None] * one + np.sin(turn)[:, None] * two
        points = section[:, :1, None] * (far[:, None] * round_it)
        points = points + section[:, 1:, None] * self.body.axis + self.body.origin
        first, ids = self._numbers
        faces = _corners(ids, np.roll(ids, -1, axis=1), self._from_axis)
        faces[faces[:, 2] == faces[:, 3], 3] = -1
        return Mesh(points.reshape(-1, 3)[first], faces)

    @property
    def edges(self) -> Ints:
        """The edges (s, 2) of :attr:`mesh` between gores, and at which rings are opened."""
        ids = self._numbers[1]
        seams = np.stack([ids[:-1, ::2], ids[1:, ::2]], axis=2).reshape(-1, 2)
        if not self.body.is_closed:
            return seams
        return np.concatenate([seams, np.stack([ids[0], np.roll(ids[0], -1)], axis=1)])

    @cached_property
    def _numbers(self) -> tuple[Ints, Ints]:
        """First place of each vertex (n,), and the vertex at each place (p, 2 k)."""
        shape = len(self.body.profile), 2 * self.count
        place = np.arange(shape[0] * shape[1]).reshape(shape)
        if self.body.is_closed:
            place[-1] = place[0]
        on_axis = self.body.profile[:, 0] == 0.0
        place[on_axis] = place[on_axis, :1]
        first, ids = np.unique(place, return_inverse=True)
        return first, ids.reshape(shape)

    @property
    def _from_axis(self) -> Flags:
        """Whether each part of the profile (p - 1,) begins on the axis."""
        return np.asarray(self.body.profile[:-1, 0] == 0.0)

    @property
    def bends(self) -> tuple[Array, Array]:
        """Angle and radius (p - 2,) at the rulings between faces, as of a :class:`Folded`."""
        way = np.diff(self.section, axis=0) @ np.array([1.0, 1j])
        # The surface's normals are on the left of the profile.
        angle = -np.angle(way[1:] / way[:-1])
        width = np.repeat(0.5 * (np.abs(way[1:]) + np.abs(way[:-1]))[:, None], 2, axis=1)
        return angle, bend_radii(np.arange(width.size).reshape(-1, 2), width, angle)

    def candidate(self) -> Candidate:
        """Return the pieces with their patterns."""
        pieces, steps = cut(self.mesh, Edges(self.edges)), 2 * self.count
        x, y = np.moveaxis(np.tile(self.pattern[:, [0, 1]], (1, self.count, 1)), 2, 0)
        z = np.tile(self.pattern[:, [1, 2], 1], (1, self.count))
        first = self._from_axis
        places = np.stack([_corners(x, x, first), _corners(y, z, first)], axis=2)
        angle, radius = self.bends
        sheets = []
        for part in pieces.parts:
            own = part.mesh.faces >= 0
            flat = np.zeros((len(part.vertices), 2))
            flat[part.mesh.faces[own]] = places[part.faces][own]
            ring = part.faces // steps - 1
            edges = part.mesh.faces[ring >= 0, :2]
            bent = ring[ring >= 0]
            folded = Folded(edges, angle[bent], radius[bent])
            sheets.append(Sheet(part.mesh, flat, folded))
        return Candidate(pieces, tuple(sheets))


def _corners(values: NDArray[_N], beside: NDArray[_N], first: Flags) -> NDArray[_N]:
    """Return values at the four corners of faces (m, 4), given at places and at the next ones.

    The corners are anticlockwise with the profile to the right. The last two are those at the
    beginning of the first parts of the profile, and at the end of the others; there may be one
    point on the axis.
    """
    lower, upper = [values[:-1], beside[:-1]], [values[1:], beside[1:]]
    some = np.stack([lower[1], lower[0], upper[0], upper[1]], axis=2)
    others = np.stack([upper[0], upper[1], lower[1], lower[0]], axis=2)
    return np.where(first[:, None, None], others, some).reshape(-1, 4)


def in_gores(design: Mesh, body: Revolution, settings: PieceSettings) -> Segmentation | None:
    """Return a body of revolution in the fewest gores that are within the allowed distance.

    Parameters
    ----------
    design : Mesh
    body : Revolution
        The design as a body of revolution.
    settings : PieceSettings
        With a largest distance.

    Returns
    -------
    Segmentation or None
        None if that would be too many, or if the profile is straight, so that one piece may do.
        What does not hold besides is a reason against the result.
    """
    gores = _fewest(design, body, settings) if bent(body, settings.allowed) else None
    if gores is None:
        return None
    out = packed(gores.candidate(), None, design, _NO_EDGES, settings, rebuilt=True)
    return replace(out, notes=(_said(gores), *out.notes))


def is_gored(design: Mesh, distance: float | None) -> bool:
    """Tell whether a design whose seams are to be symmetric is cut into gores within a distance."""
    if distance is None:
        return False
    body = Revolution.of(design, distance)
    return body is not None and bent(body, distance)


def bent(body: Revolution, allowed: float) -> bool:
    """Tell whether a body is farther than allowed from a cone, a cylinder or a disc."""
    return body.straightness() + body.apart > allowed


def _said(gores: Gores) -> str:
    """Return a note on gores."""
    said = f"the design is a body of revolution: {gores.count} gores, all alike"
    if gores.body.poles:
        where = "a pole" if gores.body.poles == 1 else "both poles"
        said += f", which meet at {where}"
    return said


def advised(body: Revolution, allowed: float) -> str:
    """Return a note that a body of revolution could be made of gores."""
    count = estimated(body, max(allowed - body.apart, _LITTLE * allowed))
    return (
        f"the design is a body of revolution: symmetric=True (--symmetric) makes about {count} "
        "gores, all alike"
    )


def _fewest(design: Mesh, body: Revolution, settings: PieceSettings) -> Gores | None:
    """Return the fewest gores within the allowed distance, both ways; None if there are too many.

    Their patterns fit the width of the sheet, if one is given and they fit its length.
    """
    allowed = settings.allowed
    count, known = estimated(body, allowed), {}
    least = _least(body, settings)

    def far(count: int) -> float:
        if count not in known:
            settings.say(f"{count} gores")
            known[count] = metrics.largest_distance(design, Gores(body, count).mesh)
        return known[count]

    for _ in range(_ROUNDS):
        if count > _MOST:
            return None
        if far(count) <= allowed:
            break
        # What comes from the design itself stays.
        extra = max(far(count) - _reach(body, count), 0.0)
        count = max(count + 1, estimated(body, max(allowed - extra, _LITTLE * allowed)))
    else:
        return None
    while count > _FEWEST and far(count - 1) <= allowed:
        count -= 1
    return Gores(body, max(count, least))


def estimated(body: Revolution, distance: float) -> int:
    """Return the fewest gores within a distance of a body, by its radii.

    A circle of radius r in k gores is up to r tan(pi / 2 k)^2 away from them, both ways.

    >>> ball = Revolution(np.zeros(3), np.eye(3)[2], np.array([[0.0, -1], [1, 0], [0, 1]]), 0.0)
    >>> estimated(ball, 0.05)
    7
    """
    half = np.arctan(np.sqrt(distance / max(body.reach, 1e-300)))
    return max(_FEWEST, int(np.ceil(np.pi / (2.0 * half) - 1e-9)))


def _reach(body: Revolution, count: int) -> float:
    """Return the distance of gores from a body, by its radii."""
    return float(body.reach * np.tan(np.pi / (2.0 * count)) ** 2)


def _least(body: Revolution, settings: PieceSettings) -> int:
    """Return the least number of gores that fit the width of a sheet, if they fit its length."""
    if settings.max_size is None:
        return _FEWEST
    wide, long = sorted(settings.max_size)
    for count in range(_FEWEST, _MOST + 1):
        length, width = rectangle(Gores(body, count).pattern.reshape(-1, 2))[1]
        if width <= wide:
            return count if length <= long else _FEWEST
    return _FEWEST

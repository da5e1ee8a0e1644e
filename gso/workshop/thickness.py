"""The thickness of sheets: how much longer or shorter a pattern is than the surface.

A bend of angle a about an inner radius R takes the length ``a (R + k T)`` of a sheet of thickness
T, where k, the K-factor, says where between both faces the neutral surface lies.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import OptionError
from gso.mesh.topology import edge_keys, label_components, pair_keys
from gso.pattern import Zone
from gso.quantities import as_positive
from gso.spelling import choices
from gso.typing import Array, Ints
from gso.workshop.panels import Panel

FACES = ("middle", "outside", "inside")


@dataclass(frozen=True)
class Thickness:
    """A sheet's thickness and how it bends; lengths in the unit of the panels.

    Attributes
    ----------
    sheet : float
        Thickness T.
    k : float
        K-factor: the neutral surface's distance from the inner face of a bend, over T.
    face : {"middle", "outside", "inside"}
        The face of the sheet that the design's surface is.
    radius : float or None
        Inner radius of the tool that folds sharp bends. None: the sheet is rolled, with the radii
        of the surface.
    table : array_like, (k, 2), or None
        Bend deductions of sharp bends: angles of bending in radians (0 is flat), increasing, and
        how much shorter the pattern is than both flanges outside, to the apex. Between them it
        is interpolated, and below the first one it falls to 0 at no bend.

    Examples
    --------
    A quarter of a cylinder, rolled, the design being the outside:

    >>> sheet = Thickness(2.0, k=0.5, face="outside")
    >>> float(sheet.change(np.pi / 2)) / (np.pi / 2)
    -1.0
    """

    sheet: float
    k: float = 0.5
    face: str = "middle"
    radius: float | None = None
    table: ArrayLike | None = None

    def __post_init__(self) -> None:
        as_positive(self.sheet, "the thickness")
        if not 0 <= self.k <= 1:
            raise OptionError(f"the K-factor is {self.k!r}; it must be 0 to 1")
        if self.face not in FACES:
            raise OptionError(f"no face {self.face!r}; {choices(self.face, FACES)}")
        if self.radius is not None:
            as_positive(self.radius, "the bend radius", zero=True)
        if self.table is not None:
            rows = np.asarray(self.table, float)
            good = bool(rows.ndim == 2 and rows.shape[1:] == (2,) and len(rows) >= 1)
            good = good and bool(np.isfinite(rows).all() and (np.diff(rows[:, 0]) > 0).all())
            if not (good and rows[0, 0] >= 0 and rows[-1, 0] < np.pi):
                raise OptionError(
                    "the bend table must have rows of an angle of bending, 0 to 180 degrees and "
                    "increasing, and a deduction"
                )
            if self.radius is not None:
                raise OptionError(
                    "a bend radius and a bend table exclude each other; leave one of them out"
                )

    def change(self, angle: ArrayLike, radius: ArrayLike = 0.0) -> Array:
        """Return how much longer the pattern is across bends of some angles than the surface.

        Parameters
        ----------
        angle : array_like
            In radians, positive for mountain folds.
        radius : array_like
            Radii of the surface's bends where the pattern has their arcs; 0 where it has the
            tangents to the apex.

        Examples
        --------
        A solid of thickness 2, bent by 90 degrees about an inner radius of 3, seen from outside:

        >>> sheet = Thickness(2.0, k=0.4, face="outside")
        >>> arc = 5.0 * np.pi / 2
        >>> round(float(arc + sheet.change(np.pi / 2, 5.0)) / (np.pi / 2), 9)
        3.8
        """
        turn = np.asarray(angle, float)
        size, thick, design = np.abs(turn), self.sheet, self.depth(turn)
        arc = np.asarray(radius, float)
        if self.table is not None:
            rows = np.asarray(self.table, float)
            deduction = np.interp(size, *np.pad(rows, ((int(rows[0, 0] > 0), 0), (0, 0))).T)
            apex = 2.0 * (arc + thick - design) * np.tan(0.5 * size)
            return np.asarray(apex - deduction - size * arc)
        if self.radius is None:
            return np.asarray(size * (self.k * thick - design))
        around = size * (self.radius + self.k * thick)
        apex = 2.0 * (self.radius + design - arc) * np.tan(0.5 * size)
        return np.asarray(around - apex - size * arc)

    def depth(self, angle: ArrayLike) -> Array:
        """Return how far the design's surface is from the inner face of bends of some angles."""
        outside = {"middle": 0.5, "outside": 1.0, "inside": 0.0}[self.face]
        return np.asarray(
            self.sheet * np.where(np.asarray(angle, float) >= 0, outside, 1.0 - outside)
        )

    def inner(self, angle: ArrayLike, radius: ArrayLike) -> Array:
        """Return the inner radii of bends, infinite where a bend table leaves them to the tool.

        They are 0 where the sheet is too thick for the radius of the surface.

        Parameters
        ----------
        angle, radius : array_like
            Of the bends of the design's surface.
        """
        angles, radii = np.broadcast_arrays(np.asarray(angle, float), np.asarray(radius, float))
        if self.table is not None:
            return np.full(angles.shape, np.inf)
        if self.radius is not None:
            return np.full(angles.shape, float(self.radius))
        return np.asarray(np.maximum(radii - self.depth(angles), 0.0))

    def strain(self, curvature: float) -> float:
        """Return how far the neutral surface of a rolled sheet is strained against the design's.

        >>> Thickness(2.0, k=0.5).strain(0.01), Thickness(2.0, k=0.5, face="inside").strain(0.01)
        (0.0, 0.01)
        """
        away = np.abs(self.k * self.sheet - self.depth([1.0, -1.0])).max()
        return float(away * curvature)

    @property
    def rolled(self) -> Thickness:
        """The same sheet, rolled to the radii of the surface."""
        return replace(self, radius=None, table=None)

    @property
    def pressed(self) -> Thickness:
        """The same sheet, bent by a press to the radii of the surface."""
        return replace(self, radius=None)


def thickened(panel: Panel, thickness: Thickness) -> Panel:
    """Return a panel with the pattern of a sheet of some thickness, and inner radii of bends.

    Plates between bends are moved apart or together along the normals of the bends. Bends in zones
    have the radius of the surface, and sharp ones that of the tool.
    """
    if not len(panel.bends):
        return panel
    rolled, pressed, angles = panel.rolled, panel.pressed, panel.angles
    radii = np.where(
        rolled | pressed,
        thickness.rolled.inner(angles, panel.radii),
        thickness.inner(angles, panel.radii),
    )
    plate, pairs, ends = _plates(panel)
    p, q = panel.flat[ends].transpose(1, 0, 2)
    way = q - p
    normal = np.stack([-way[:, 1], way[:, 0]], axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    count = int(plate.max()) + 1
    # The normal points from the first plate of each pair to the second.
    change = np.where(rolled, thickness.rolled.change(angles), thickness.change(angles))
    arcs = thickness.pressed.change(angles, np.where(pressed, panel.radii, 0.0))
    change = np.where(pressed, arcs, change)
    step = change[:, None] * normal
    shift = _solved(count, pairs, step)
    total, often = np.zeros((len(panel.flat), 2)), np.zeros(len(panel.flat))
    faces = panel.surface.faces
    rows, corner = np.nonzero(faces >= 0)
    # A vertex on a bend belongs to both plates, each of which counts once.
    both = np.unique(np.stack([faces[rows, corner], plate[rows]], axis=1), axis=0)
    np.add.at(total, both[:, 0], shift[both[:, 1]])
    np.add.at(often, both[:, 0], 1.0)
    move = total / np.maximum(often, 1.0)[:, None]
    _stretch(panel, plate, pairs, normal, shift, move)
    zones = tuple(_inner_zone(zone, thickness) for zone in panel.zones)
    return replace(panel, flat=panel.flat + move, radii=radii, zones=zones)


def _inner_zone(zone: Zone, thickness: Thickness) -> Zone:
    """Return a zone with inner radii, which at the apex of a cone are those of the tool."""
    radii = thickness.rolled.inner(zone.angle, [zone.least, zone.most])
    least, most = np.maximum(radii, thickness.radius or 0.0).tolist()
    return zone._replace(least=least, most=most)


def _stretch(
    panel: Panel, plate: Ints, pairs: Ints, normal: Array, shift: Array, move: Array
) -> None:
    """Spread the step between two plates evenly over the arc of their bend; change `move`."""
    faces = panel.surface.faces
    arc = np.where(panel.pressed, np.abs(panel.angles) * panel.radii, 0.0)
    # How far a vertex lies beyond the ends of the bend that it was last counted to.
    closest = np.full(len(move), np.inf)
    for pair in np.unique(pairs[arc > 0], axis=0):
        own = np.flatnonzero((pairs == pair).all(axis=1) & (arc > 0))
        ends, half = panel.flat[panel.bends[own]].reshape(-1, 2), 0.5 * float(arc[own[0]])
        across = normal[own[0]]
        vertices = np.unique(faces[np.isin(plate, pair)])
        vertices = vertices[vertices >= 0]
        points = panel.flat[vertices]
        level = np.clip((points - ends[0]) @ across / half, -1.0, 1.0)
        way = np.array([-across[1], across[0]])
        along, reach = points @ way, ends @ way
        beyond = np.maximum(np.maximum(reach.min() - along, along - reach.max()), 0.0)
        # Zones may become wider towards their limits.
        zone = (np.abs(level) < 1.0) & (beyond < half) & (beyond < closest[vertices])
        closest[vertices[zone]] = beyond[zone]
        one, two = shift[pair]
        inside = 0.5 * (one + two) + 0.5 * level[zone, None] * (two - one)
        move[vertices[zone]] = inside


def _plates(panel: Panel) -> tuple[Ints, Ints, Ints]:
    """Return the plate of each face, and for each bend its two plates and its ends.

    Seen along a bend from its first end, the second plate lies to the left.
    """
    he, n = panel.surface.half_edges, len(panel.flat)
    k = he.interior
    keys, wanted = edge_keys(he.origin[k], he.dest[k], n), pair_keys(panel.bends, n)
    order = np.argsort(keys)
    bent = k[order[np.searchsorted(keys[order], wanted)]]
    keep = k[~np.isin(k, bent)]
    count = len(panel.surface.faces)
    plate = label_components(count, he.face[keep], he.face[he.twin[keep]])
    # The faces of a half-edge lie to its left.
    pairs = np.stack([plate[he.face[he.twin[bent]]], plate[he.face[bent]]], axis=1)
    return plate, pairs, np.stack([he.origin[bent], he.dest[bent]], axis=1)


def _solved(count: int, pairs: Ints, step: Array) -> Array:
    """Return the shift of each plate (count, 2) from the steps between pairs; the first stays."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import lsqr

    rows = np.arange(len(pairs))
    matrix = coo_matrix(
        (
            np.r_[-np.ones(len(pairs)), np.ones(len(pairs))],
            (np.r_[rows, rows], np.r_[pairs[:, 0], pairs[:, 1]]),
        ),
        shape=(len(pairs), count),
    ).tocsr()
    out = [lsqr(matrix, step[:, d], atol=1e-14, btol=1e-14, iter_lim=20 * count)[0] for d in (0, 1)]
    shift = np.stack(out, axis=1)
    return np.asarray(shift - shift[0])

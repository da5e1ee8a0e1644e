"""Flat panels of a made surface, and the seams along which they meet; in the mesh's unit."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from gso.errors import MeshError
from gso.geometry.polygon import arc_lengths
from gso.mesh import Mesh
from gso.pattern import Bend, Folded, Zone
from gso.typing import Array, Flags, Ints, Json
from gso.verdict import Places, Reason

_ARRAYS = ("points", "faces", "flat", "bends", "angles", "radii", "zone")


@dataclass(frozen=True, eq=False)
class Panel:
    """One flat panel: a surface in space and its pattern, with the same numbering.

    Attributes
    ----------
    name : str
    surface : Mesh
        The panel in space, a disk or a disk with holes.
    flat : ndarray, (n, 2)
        Its pattern, outside face up; not a number for a panel that is only shown, in space.
    bends : ndarray of int, (b, 2)
        Edges to bend along.
    angles, radii : ndarray, (b,)
        Their angles in radians, positive for mountain folds, and the radii of the bends.
    zone : ndarray of int, (b,)
        Number of the zone that each bend is a line of; -1 for those of none, which are folded.
    zones : tuple of Zone
        Round faces, which are bent as a whole.
    faces : tuple of str
        Names of the faces of a CAD file that it is made of.
    is_kept : bool
        Whether it is developable as it is: its folds and bends are those of the design.
    """

    name: str
    surface: Mesh
    flat: Array
    bends: Ints = field(default_factory=lambda: np.empty((0, 2), np.int64))
    angles: Array = field(default_factory=lambda: np.empty(0))
    radii: Array = field(default_factory=lambda: np.empty(0))
    zone: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    zones: tuple[Zone, ...] = ()
    faces: tuple[str, ...] = ()
    is_kept: bool = False

    def __post_init__(self) -> None:
        if not len(self.zone):
            object.__setattr__(self, "zone", np.full(len(self.bends), -1))

    @property
    def has_pattern(self) -> bool:
        """Whether it has a pattern."""
        return bool(np.isfinite(self.flat).all())

    @property
    def rolled(self) -> Flags:
        """Bends that are rulings of a zone to be rolled to its radius, (b,)."""
        return self._in_zone(pressed=False)

    @property
    def pressed(self) -> Flags:
        """Bends that are a zone each, whose arc the pattern has, (b,)."""
        return self._in_zone(pressed=True)

    def _in_zone(self, *, pressed: bool) -> Flags:
        which = np.array([*(zone.pressed == pressed for zone in self.zones), False])
        return np.asarray(which[self.zone])

    @property
    def lines(self) -> list[Bend]:
        """The bends as lines of the pattern."""
        return Folded(self.bends, self.angles, self.radii, self.zone).lines(self.flat)

    @cached_property
    def loops(self) -> list[Ints]:
        """Boundary loops, the outer one first, as indices of vertices."""
        loops = self.surface.boundary_loops
        size = [float(np.ptp(self.flat[loop], axis=0).prod()) for loop in loops]
        return [loops[k] for k in np.argsort([-s for s in size], kind="stable")]

    @property
    def rim(self) -> Ints:
        """Edges of the boundary loops, (e, 2)."""
        none = np.empty((0, 2), np.int64)
        return np.concatenate([none, *(np.stack([x, np.roll(x, -1)], axis=1) for x in self.loops)])


@dataclass(frozen=True, eq=False)
class Side:
    """One side of a seam: points on edges of a panel.

    Attributes
    ----------
    panel : int
    edges : ndarray of int, (k, 2)
        The edge of each point.
    shares : ndarray, (k,)
        Its place between both ends, 0 to 1.
    """

    panel: int
    edges: Ints
    shares: Array

    @classmethod
    def of(cls, panel: int, vertices: Ints) -> Side:
        """Make a side of a chain of vertices."""
        return cls(panel, np.stack([vertices, vertices], axis=1), np.zeros(len(vertices)))

    def on(self, points: Array) -> Array:
        """Return the places (k, d) for positions (n, d) of the panel's vertices."""
        a, b = points[self.edges].transpose(1, 0, 2)
        # Exact at both ends.
        share = self.shares[:, None]
        return np.asarray((1.0 - share) * a + share * b)


@dataclass(frozen=True, eq=False)
class Mating:
    """A seam: corresponding points on the outlines of two panels, or twice of the same.

    Attributes
    ----------
    number : int
        The number that both sides are marked with.
    along : ndarray, (k,)
        Arc length of the seam in space up to each point.
    one, two : Side
        The same points on both sides.
    common : bool
        Whether both sides are one curve in space; else they follow it within a distance.
    angle : float
        Angle between the faces on both sides in radians, positive for mountain folds, 0 where the
        surface is smooth; infinite where it changes along the seam, and NaN where it is not known.
    kind : int
        Number on its notches, where parts are alike and every seam of a kind fits every other; 0
        where notches have the number of the seam.
    """

    number: int
    along: Array
    one: Side
    two: Side
    common: bool = True
    angle: float = np.nan
    kind: int = 0

    @property
    def length(self) -> float:
        """Length of the seam in space."""
        return float(self.along[-1])

    def other(self, panel: int) -> int:
        """Return the panel on the other side, which may be the same."""
        return self.two.panel if self.one.panel == panel else self.one.panel

    def mismatch(self, panels: tuple[Panel, ...]) -> float:
        """Return how much the lengths of both sides in the patterns differ at most."""
        one, two = (arc_lengths(s.on(panels[s.panel].flat)) for s in (self.one, self.two))
        return float(np.ptp(one - two))


@dataclass(frozen=True, eq=False)
class Made:
    """What was made of one design.

    Attributes
    ----------
    name : str
    panels : tuple of Panel
    matings : tuple of Mating
    record : dict
        What was measured, JSON-compatible: lengths in the mesh's unit.
    reasons : tuple of Reason
        Why it cannot be used as what was asked for; lengths in the mesh's unit.
    """

    name: str
    panels: tuple[Panel, ...]
    matings: tuple[Mating, ...]
    record: Json
    reasons: tuple[Reason, ...] = ()

    def named(self, names: Sequence[str]) -> Made:
        """Return it with other names of its panels."""
        panels = tuple(replace(p, name=name) for p, name in zip(self.panels, names, strict=True))
        new: dict[int | str, str] = {p.name: n for p, n in zip(self.panels, names, strict=True)}
        reasons = (
            replace(r, places=Places(r.places.kind, tuple(new.get(x, x) for x in r.places.ids)))
            for r in self.reasons
        )
        return replace(self, panels=panels, reasons=tuple(reasons))

    def mates(self, panel: int) -> list[tuple[Mating, int]]:
        """Return the seams of a panel, each with the panel on its other side.

        Both sides of a seam may be of the same panel.
        """
        return [
            (seam, seam.other(panel))
            for seam in self.matings
            if panel in (seam.one.panel, seam.two.panel)
        ]

    def arrays(self) -> dict[str, np.ndarray]:
        """Return panels and seams as arrays by name."""
        said = json.dumps(
            [[panel.name, panel.zones, panel.faces, panel.is_kept] for panel in self.panels]
        ).encode()
        out: dict[str, np.ndarray] = {"names": np.frombuffer(said, np.uint8)}
        for k, panel in enumerate(self.panels):
            parts = (panel.surface.vertices, panel.surface.faces, panel.flat)
            every = (*parts, panel.bends, panel.angles, panel.radii, panel.zone)
            out |= {f"panel{k}_{name}": x for name, x in zip(_ARRAYS, every, strict=True)}
        # Few arrays for many seams: a file takes time for each.
        seams = self.matings
        sides = [(seam.one, seam.two) for seam in seams]
        out["seam_count"] = np.array([len(seam.along) for seam in seams], np.int64)
        out["seam_along"] = np.concatenate([np.empty(0), *(seam.along for seam in seams)])
        out["seam_number"] = np.array([seam.number for seam in seams], np.int64)
        out["seam_common"] = np.array([int(seam.common) for seam in seams], np.int64)
        out["seam_kind"] = np.array([seam.kind for seam in seams], np.int64)
        out["seam_angle"] = np.array([seam.angle for seam in seams], float)
        for k, name in enumerate(("one", "two")):
            own = [pair[k] for pair in sides]
            none = np.empty((0, 2), np.int64)
            out[f"seam_{name}_edges"] = np.concatenate([none, *(side.edges for side in own)])
            out[f"seam_{name}_shares"] = np.concatenate([none[:, 0], *(x.shares for x in own)])
            out[f"seam_{name}_panel"] = np.array([side.panel for side in own], np.int64)
        return out

    @classmethod
    def from_arrays(cls, name: str, data: Mapping[str, np.ndarray], record: Json) -> Made:
        """Return what :meth:`arrays` describes.

        Raises
        ------
        MeshError
            The arrays do not fit each other.
        """
        try:
            panels = []
            for k, (own, zones, faces, is_kept) in enumerate(json.loads(data["names"].tobytes())):
                points, table, flat, bends, turns, radii, zone = (
                    data[f"panel{k}_{part}"] for part in _ARRAYS
                )
                surface = Mesh(points, table)
                known = tuple(Zone(*row) for row in zones)
                lines = (bends, turns, radii, zone, known)
                panels.append(Panel(str(own), surface, flat, *lines, tuple(faces), is_kept))
            stops = np.cumsum(data["seam_count"])[:-1]
            numbers, common, angles, kinds = (
                data[f"seam_{part}"].tolist() for part in ("number", "common", "angle", "kind")
            )
            both = [
                map(
                    Side,
                    data[f"seam_{side}_panel"].tolist(),
                    np.split(data[f"seam_{side}_edges"], stops),
                    np.split(data[f"seam_{side}_shares"], stops),
                )
                for side in ("one", "two")
            ]
            matings = [
                Mating(number, along, one, two, bool(is_common), angle, kind)
                for number, along, one, two, is_common, angle, kind in zip(
                    numbers,
                    np.split(data["seam_along"], stops),
                    *both,
                    common,
                    angles,
                    kinds,
                    strict=False,
                )
            ]
        except (KeyError, ValueError, TypeError) as error:
            raise MeshError(f"the arrays of {name} do not fit each other: {error}") from None
        return cls(name, tuple(panels), tuple(matings), record)

"""A flat part as the cutter sees it, in millimetres, with its outside face up."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gso.geometry.polygon import signed_area
from gso.pattern import Bend, Zone
from gso.typing import Array
from gso.wording import listed


@dataclass(frozen=True, eq=False)
class Label:
    """A text on a part.

    Attributes
    ----------
    text : str
    at : ndarray, (2,)
        The middle of the text.
    height : float
        Height of capital letters, in millimetres.
    angle : float
        Direction of the line of text, in radians.
    """

    text: str
    at: Array
    height: float
    angle: float = 0.0

    @property
    def start(self) -> Array:
        """The middle of its base line, (2,)."""
        up = np.array([-np.sin(self.angle), np.cos(self.angle)])
        return np.asarray(self.at - 0.5 * self.height * up)


@dataclass(frozen=True, eq=False)
class Notch:
    """A mark on an outline, where it meets the same mark of another part.

    Attributes
    ----------
    at : ndarray, (2,)
        Its place on the outline.
    inward : ndarray, (2,)
        Unit vector across the outline, into the part.
    text : str
        What stands beside it, the same on both parts.
    """

    at: Array
    inward: Array
    text: str


class GuideLine(NamedTuple):
    """A line along which a curved part without bend lines is bent least.

    Attributes
    ----------
    line : ndarray, (k, 2)
        Its points.
    angle : float
        Angle in radians by which it is not straight: that between its chord and a circular arc
        of the same chord and height, at their ends.
    """

    line: Array
    angle: float

    def in_words(self) -> str:
        """Say what it is.

        >>> GuideLine(np.zeros((2, 2)), np.radians(3.2)).in_words()
        'guide line, 3.2 degrees from straight'
        """
        return f"guide line, {np.degrees(self.angle):.2g} degrees from straight"


@dataclass(frozen=True, eq=False)
class Part:
    """A flat part.

    Attributes
    ----------
    name : str
    outline : ndarray, (k, 2)
        What is cut: a closed polygon, anticlockwise, the first point not repeated.
    holes : tuple of ndarray, (h, 2)
        Closed polygons, clockwise.
    bends : tuple of Bend
        Straight lines to bend along: angles in radians, positive for mountain folds.
    zones : tuple of Zone
        Round faces that are bent as a whole, by the numbers that bends have.
    guides : tuple of GuideLine
        Lines along which it is bent least, if it is curved and has no bends.
    creases : tuple of ndarray, (k, 2)
        Lines to fold along that are not bends of the sheet, such as those of tabs.
    marks : tuple of ndarray, (k, 2)
        Lines to engrave.
    seams : tuple of ndarray, (k, 2)
        Lines to sew, glue or weld along, inside an allowance or an overlap; closed if the first
        point is repeated.
    notches : tuple of Notch
    labels : tuple of Label
    grain : ndarray, (2,), or None
        Direction of the grain, a unit vector; None if any will do.
    count : int
        How many of it are needed.
    faces : tuple of str
        Names of the faces of a CAD file that it is made of.
    """

    name: str
    outline: Array
    holes: tuple[Array, ...] = ()
    bends: tuple[Bend, ...] = ()
    creases: tuple[Array, ...] = ()
    marks: tuple[Array, ...] = ()
    seams: tuple[Array, ...] = ()
    notches: tuple[Notch, ...] = ()
    labels: tuple[Label, ...] = ()
    grain: Array | None = None
    count: int = 1
    zones: tuple[Zone, ...] = ()
    faces: tuple[str, ...] = ()
    guides: tuple[GuideLine, ...] = ()

    @cached_property
    def area(self) -> float:
        """Area in square millimetres, without holes."""
        return signed_area(self.outline) + sum(signed_area(hole) for hole in self.holes)

    @property
    def made_of(self) -> str:
        """The faces of a CAD file that it is made of, in words; empty if there are none."""
        return listed(self.faces)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height as it lies."""
        wide, high = np.ptp(self.outline, axis=0).tolist()
        return wide, high

    @property
    def low(self) -> Array:
        """The lower left corner of its bounding rectangle, (2,)."""
        return np.asarray(self.outline.min(axis=0))

    def turned(self, angle: float) -> Part:
        """Return the part turned about the origin by an angle in radians, anticlockwise.

        >>> square = Part("a", np.array([[0.0, 0], [2, 0], [2, 1], [0, 1]]))
        >>> [round(x, 9) for x in square.turned(np.pi / 2).size]
        [1.0, 2.0]
        """
        c, s = np.cos(angle), np.sin(angle)
        return self._mapped(np.array([[c, s], [-s, c]]), np.zeros(2), lambda old: old + angle)

    def shifted(self, by: Array) -> Part:
        """Return the part moved by a vector (2,)."""
        return self._mapped(np.eye(2), by, lambda old: old)

    def mirrored(self) -> Part:
        """Return the part turned over: what was up is down, and mountains are valley folds."""
        over = self._mapped(np.diag([-1.0, 1.0]), np.zeros(2), lambda old: -old)
        return replace(
            over,
            outline=over.outline[::-1],
            holes=tuple(hole[::-1] for hole in over.holes),
            seams=tuple(line[::-1] for line in over.seams),
            bends=tuple(bend._replace(angle=-bend.angle) for bend in over.bends),
            zones=tuple(zone._replace(angle=-zone.angle) for zone in over.zones),
        )

    def _mapped(self, turn: Array, shift: Array, spin: Callable[[float], float]) -> Part:
        """Return the part with points ``p @ turn + shift``; `spin` maps the angles of labels."""

        def each(lines: Sequence[Array]) -> tuple[Array, ...]:
            return tuple(line @ turn + shift for line in lines)

        (outline,) = each([self.outline])
        return replace(
            self,
            outline=outline,
            holes=each(self.holes),
            bends=tuple(b._replace(line=b.line @ turn + shift) for b in self.bends),
            guides=tuple(g._replace(line=g.line @ turn + shift) for g in self.guides),
            creases=each(self.creases),
            marks=each(self.marks),
            seams=each(self.seams),
            notches=tuple(
                replace(n, at=n.at @ turn + shift, inward=n.inward @ turn) for n in self.notches
            ),
            labels=tuple(
                replace(label, at=label.at @ turn + shift, angle=spin(label.angle))
                for label in self.labels
            ),
            grain=None if self.grain is None else self.grain @ turn,
        )


@dataclass(frozen=True, eq=False)
class Drawing:
    """Parts on a sheet, or side by side, to be written to a file.

    Attributes
    ----------
    parts : tuple of Part
        In their places.
    sheet : (float, float) or None
        Length and width of the sheet, whose lower left corner is the origin; None if the parts
        are on no sheet.
    title : str
    """

    parts: tuple[Part, ...]
    sheet: tuple[float, float] | None = None
    title: str = ""

    @property
    def bounds(self) -> tuple[Array, Array]:
        """The lower left and the upper right corner, (2,) each."""
        points = [part.outline for part in self.parts]
        if self.sheet is not None:
            points.append(np.array([[0.0, 0.0], self.sheet]))
        every = np.concatenate(points)
        return every.min(axis=0), every.max(axis=0)

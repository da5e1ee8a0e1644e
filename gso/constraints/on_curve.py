"""Constraints by which vertices slide along a given curve, or along the boundary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.constraints.base import Constraint, Subject
from gso.constraints.equations import OnLines, Part, Pins
from gso.mesh import Polylines
from gso.mesh.polyline import CORNER, turns
from gso.short_repr import short_repr
from gso.typing import Array, Ints


@dataclass(frozen=True, eq=False)
class OnCurve(Constraint):
    """Vertices that lie on a polyline, and may slide along it.

    They do not slide beyond the ends of an open polyline, nor round a corner of more than
    45 degrees.

    Parameters
    ----------
    ids : array_like of int, (k,)
        Vertex indices.
    points : array_like, (m, 3)
        The polyline, in the unit of the mesh; (m, 2) for a flat image.
    closed : bool
        Whether its last point is joined to the first.
    weight : float, optional
        Weight of a soft constraint, of the order of 1; the constraint is hard when not given.

    Examples
    --------
    A straight edge for the pattern of a curved sheet:

    >>> import numpy as np, gso
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9), indexing="ij")
    >>> sheet = np.stack([u, v, 0.2 * u * v], axis=-1)
    >>> edge = gso.OnCurve(np.arange(9), [[0, -5], [0, 5]])
    >>> flat = gso.tno.optimize(sheet, task="flatten", constraints=[edge]).flat
    >>> bool(abs(flat[:9, 0]).max() < 1e-6)
    True
    """

    ids: ArrayLike
    points: ArrayLike
    closed: bool = False
    weight: float | None = None

    __repr__ = short_repr

    def parts(self, subject: Subject) -> list[Part]:
        if not isinstance(self.closed, bool | np.bool_):
            raise subject.refuse(f"has closed {self.closed!r}; it must be True or False")
        ids = subject.ids(self.ids)
        points = subject.points(self.points, "the points of a polyline")
        size = float(np.ptp(points, axis=0).max(initial=0.0))
        step = np.abs(points - np.roll(points, 1, axis=0)).max(axis=1, initial=0.0)
        new = step > 1e-12 * size
        new[0] |= not self.closed
        points = points[new]
        if len(points) < (3 if self.closed else 2):
            what = "3 points for a closed" if self.closed else "2 points for a"
            raise subject.refuse(f"needs {what} polyline, no two of them the same")
        lines = Polylines.of(points, closed=bool(self.closed))
        return [OnLines(subject.number, ids, lines, subject.weight(self.weight))]


@dataclass(frozen=True)
class SlidingBoundary(Constraint):
    """Boundary vertices that slide along the boundary curve; not for flat images.

    Corners, where the boundary turns by more than `corner`, stay fixed: the four corners of a
    grid over a rectangle, none on a round hole.

    Parameters
    ----------
    corner : float
        Turning angle above which a vertex is a corner, in degrees between 0 and 180.
    weight : float, optional
        Weight of a soft constraint, of the order of 1; the constraint is hard when not given.
    """

    corner: float = CORNER
    weight: float | None = None

    def parts(self, subject: Subject) -> list[Part]:
        subject.in_space("give OnCurve(ids, points) with points (m, 2)")
        corner, weight = subject.positive(self.corner, "corner"), subject.weight(self.weight)
        if corner > 180:
            raise subject.refuse(f"has corner {self.corner!r}; it is at most 180 degrees")
        mesh = subject.mesh
        found: list[Part] = []
        # Vertices slide only along the boundary of their own component.
        for number in dict.fromkeys(int(mesh.components[loop[0]]) for loop in mesh.boundary_loops):
            loops = [loop for loop in mesh.boundary_loops if mesh.components[loop[0]] == number]
            found += _along(subject.number, mesh.vertices, loops, corner, weight)
        return found


def _along(
    owner: int, vertices: Array, loops: list[Ints], corner: float, weight: float | None
) -> list[Part]:
    """Constrain the vertices of boundary loops to the loops' curves, and fix the corners."""
    lines, held, sliding = [], [], []
    for loop in loops:
        points = vertices[loop]
        way = np.roll(points, -1, axis=0) - points
        length = np.linalg.norm(way, axis=1, keepdims=True)
        # A vertex with an edge of zero length has no direction, so it is fixed.
        sharp = turns(way / np.maximum(length, 1e-300)) > corner
        sharp |= (np.minimum(length, np.roll(length, 1, axis=0)) == 0)[:, 0]
        held.append(loop[sharp])
        sliding.append(loop[~sharp])
        lines.append(Polylines.of(points[length[:, 0] > 0], closed=True, corner=corner))
    fixed, free = np.concatenate(held), np.concatenate(sliding)
    return [
        Pins(owner, fixed, vertices[fixed], weight),
        OnLines(owner, free, Polylines.join(lines), weight),
    ]

"""Patches in the plane, joined along edges to parts."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from gso.geometry.polygon import rectangle
from gso.mesh.topology import label_components
from gso.typing import Array, Flags, Ints
from gso.unfolding.contact import Corners, around, boxes, crossing, overlapping


@dataclass(frozen=True, eq=False)
class Links:
    """The graph of the patches.

    Attributes
    ----------
    patch : ndarray of int, (t,)
        The patch of each triangle.
    patches : ndarray of int, (e, 2)
        The patches of both sides of each edge.
    one, other : ndarray of int, (e, 2)
        The places 3 t + k of both ends of each edge in the triangles of either side.
    weights : ndarray, (e,)
        How long the seam between both patches is.
    areas : ndarray, (p,)
        Areas of the patches, as shares of the whole.
    sheet : (float, float), optional
        Length and width that a part may have.
    """

    patch: Ints
    patches: Ints
    one: Ints
    other: Ints
    weights: Array
    areas: Array
    sheet: tuple[float, float] | None = None

    @property
    def count(self) -> int:
        """Number of patches."""
        return len(self.areas)

    @cached_property
    def least(self) -> int:
        """Number of parts if nothing overlapped."""
        return int(label_components(self.count, *self.patches.T).max()) + 1

    def around(self) -> list[list[tuple[int, int]]]:
        """Return the edges of each patch, and the patches behind them."""
        out: list[list[tuple[int, int]]] = [[] for _ in range(self.count)]
        for edge, (a, b) in enumerate(self.patches.tolist()):
            out[a].append((edge, b))
            out[b].append((edge, a))
        return out


@dataclass(eq=False)
class Layout:
    """Places of all triangles in the plane, and what is joined.

    Attributes
    ----------
    links : Links
    corners : ndarray of complex, (t, 3)
    boxes : ndarray, (4, t)
        Bounding boxes of the triangles.
    part : ndarray of int, (p,)
        Part of each patch.
    joined : ndarray of bool, (e,)
        The edges along which patches were joined: a tree in each part.
    work : list of float, (1,)
        Work that was done on this layout and its copies, in microseconds about: a number that does
        not depend on the machine.
    """

    links: Links
    corners: Corners
    boxes: Array
    part: Ints
    joined: Flags
    work: list[float] = field(default_factory=lambda: [0.0])

    @classmethod
    def apart(cls, links: Links, corners: Corners) -> Layout:
        """Make the layout in which nothing is joined."""
        part = np.arange(links.count)
        return cls(links, corners, boxes(corners), part, np.zeros(len(links.patches), bool))

    def copy(self) -> Layout:
        """Copy what joining and cutting change."""
        self.work[0] += 50.0 + 0.1 * len(self.corners)
        return replace(
            self,
            corners=self.corners.copy(),
            boxes=self.boxes.copy(),
            part=self.part.copy(),
            joined=self.joined.copy(),
        )

    def triangles(self, part: int) -> Ints:
        """Return the triangles of a part."""
        return np.flatnonzero((self.part == part)[self.links.patch])

    def motion(self, edge: int, side: int) -> tuple[complex, complex]:
        """Return how one side of an edge moves onto the other: z -> turn z + shift."""
        here, there = self.links.one[edge], self.links.other[edge]
        if side == 0:
            here, there = there, here
        flat = self.corners.reshape(-1)
        (a, b), (p, q) = flat[here].tolist(), flat[there].tolist()
        turn = (b - a) / (q - p)
        turn /= abs(turn)
        return turn, 0.5 * (a + b) - turn * 0.5 * (p + q)

    def moved(self, which: Ints, motion: tuple[complex, complex]) -> tuple[Corners, Array]:
        """Return the corners and boxes of moved triangles."""
        corners = motion[0] * self.corners[which] + motion[1]
        return corners, boxes(corners)

    def clashes(self, part: int, corners: Corners, own: Array, every: bool = True) -> Ints:
        """Find the triangles of a part that overlap moved ones: pairs (p, 2) of both.

        All of them, or some if there are any.
        """
        self.work[0] += 100.0 + 0.1 * len(self.corners) + 2.0 * len(corners)
        near = np.flatnonzero(
            crossing(self.boxes, around(own)) & (self.part == part)[self.links.patch]
        )
        if not len(near):
            return np.empty((0, 2), np.int64)
        boxed = self.boxes[:, near]
        far = np.flatnonzero(crossing(own, around(boxed)))
        pairs = overlapping(self.corners[near], corners[far], boxed, own[:, far], every)
        return np.stack([near[pairs[:, 0]], far[pairs[:, 1]]], axis=1)

    def fits(self, fixed: Ints, corners: Corners) -> bool:
        """Tell whether triangles and moved ones together fit the sheet."""
        if self.links.sheet is None:
            return True
        every = np.concatenate([self.corners[fixed].ravel(), corners.ravel()])
        return within(every, self.links.sheet)

    def join(self, edge: int) -> bool:
        """Join the parts on both sides of an edge, where nothing overlaps; tell whether."""
        a, b = self.part[self.links.patches[edge]].tolist()
        first, second = self.triangles(a), self.triangles(b)
        side = int(len(second) <= len(first))
        if side == 0:
            a, b, first, second = b, a, second, first
        corners, own = self.moved(second, self.motion(edge, side))
        if len(self.clashes(a, corners, own, every=False)) or not self.fits(first, corners):
            return False
        self.place(second, corners, own)
        self.part[self.part == b] = a
        self.joined[edge] = True
        return True

    def place(self, which: Ints, corners: Corners, own: Array) -> None:
        """Put triangles to their new places."""
        self.corners[which], self.boxes[:, which] = corners, own

    @property
    def number(self) -> int:
        """Number of parts."""
        return len(np.unique(self.part))

    @property
    def cut(self) -> float:
        """Length of all edges that are not joined."""
        return float(self.links.weights[~self.joined].sum())

    @property
    def spread(self) -> float:
        """How evenly the area is divided: 0 for one part."""
        shares = np.bincount(self.part, self.links.areas)
        return 1.0 - float((shares * shares).sum())


def within(points: Corners, sheet: tuple[float, float]) -> bool:
    """Tell whether a rectangle about points is no larger than a sheet."""
    most = max(sheet) * (1 + 1e-12), min(sheet) * (1 + 1e-12)
    long, wide = rectangle(np.stack([points.real, points.imag], axis=1), most)[1]
    return long <= most[0] and wide <= most[1]

"""The weights of the energy of strips, and what it depends on."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gso.typing import Array, Ints


@dataclass(frozen=True)
class Weights:
    """Weights of the energy, for designs whose diagonal is one.

    Attributes
    ----------
    back : float
        Mean squared distance of the strips from the design, beside that of the design from the
        strips.
    moved, bent : float
        Second differences along the strip, of the displacement and of the position.
    crease : float
        Second differences along creases, for each of them: without it they zigzag.
    fold : float
        Bending: squared changes of the normal at rulings, times length over mean width.
    even : float
        Second differences along the rulings, times the squared number of strips.
    ends : float
        Distance of the border curves from the continued outline.
    inside : float
        Squared depth of the ends of rulings inside the design.
    gap : float
        Missing distance between successive rulings.
    least : float
        The distance that they keep, relative to the mean.
    hold : float
        Squared distances of points that the strips have to pass through.
    radius : float
        Squared angles by which folds are too sharp for the smallest radius.
    planar : float
        Squared distance between the diagonals of a quad; 0 where quads are planar exactly.
    power : float
        Power of the distances.
    """

    back: float = 1.0
    moved: float = 1e-4
    bent: float = 1e-7
    crease: float = 5e-5
    fold: float = 1e-6
    even: float = 1e-2
    ends: float = 1e-3
    inside: float = 10.0
    gap: float = 5.0
    least: float = 0.1
    hold: float = 1e3
    radius: float = 1e-2
    planar: float = 0.0
    power: float = 2.0

    def scaled(self, share: float) -> Weights:
        """Return other weights for all terms that a design which is ruled does not minimise."""
        names = ("bent", "crease", "fold", "even", "ends")
        return replace(self, **{name: share * getattr(self, name) for name in names})


@dataclass(frozen=True)
class Measured:
    """What the energy depends on, at given vertices.

    Attributes
    ----------
    triangle : ndarray of int, (p,)
        Triangles of the strips nearest to the points of the design.
    shares : ndarray, (p, 3)
        Shares of their corners in the nearest points.
    height : ndarray, (p,)
        Distances of the points, signed by the triangles' normals where they are along these.
    normal : ndarray, (t, 3)
        Normals of all triangles.
    beyond : ndarray of int, (b,)
        Points whose nearest points are on the border of the strips, or on a ridge.
    way : ndarray, (b, 3)
        Vectors from these points to the nearest points.
    back, back_normal, back_weight : ndarray, (f, s), (f, s, 3), (f, s)
        Signed distances of samples of the faces from the design, its normals, and weights.
    up : ndarray, (f, 3)
        Mean normals of the design at the faces.
    gap, side : ndarray, (f, 2), (f, 3)
        Signed distances between both ends of a face's rulings, and their direction.
    off, across : ndarray, (o, 3), (o, 3, 3)
        Offsets of the border curves from the continued outline, and projections across it.
    deep, out : ndarray, (o,), (o, 3)
        Depths of the ends of rulings inside the design, and the directions out of it.
    turn, stiff : ndarray, (h, 3), (h,)
        Changes of the normal at rulings, and the length of the rulings over the mean width.
    """

    triangle: Ints
    shares: Array
    height: Array
    normal: Array
    beyond: Ints
    way: Array
    back: Array
    back_normal: Array
    back_weight: Array
    up: Array
    gap: Array
    side: Array
    off: Array
    across: Array
    deep: Array
    out: Array
    turn: Array
    stiff: Array

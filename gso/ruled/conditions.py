"""Conditions on strips: points, straight lines, symmetry, and the smallest radius of bends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.geometry.vectors import lengths, unit
from gso.ruled.strip_layout import Strips
from gso.ruled.strip_mirror import Mirror
from gso.typing import Array, Ints


@dataclass(frozen=True)
class Conditions:
    """What strips have to satisfy; lengths relative to the design's diagonal.

    Attributes
    ----------
    points : ndarray, (h, 3), or None
        Points that the surface passes through.
    lines : ndarray, (m, 2, 3), or None
        Ends of straight lines that are parts of rulings.
    chords : ndarray, (m, 2, 2), or None
        The same on the design's flat image, for the first rulings.
    mirror : Mirror or None
        The plane of symmetry.
    radius : float or None
        The smallest radius of a bend.
    """

    points: Array | None = None
    lines: Array | None = None
    chords: Array | None = None
    mirror: Mirror | None = None
    radius: float | None = None

    @property
    def closing(self) -> bool:
        """Whether there are conditions whose weights rise in the end."""
        return any(x is not None for x in (self.points, self.lines, self.radius))


def on_lines(conditions: Conditions, strips: Strips, vertices: Array) -> tuple[Ints, Array, Array]:
    """Return the vertices (k,) of the rulings nearest to the lines, and the lines of each.

    Returns
    -------
    ids : ndarray of int, (k,)
    through, across : ndarray, (k, 3), (k, 3, 3)
        A point of the line, and the projection across it.
    """
    ids: list[Ints] = []
    through, across = [], []
    for a, b in conditions.lines if conditions.lines is not None else ():
        way = unit(b - a)
        off = np.eye(3) - np.outer(way, way)
        best: tuple[float, Ints] | None = None
        for index in strips.index:
            far = np.square((vertices[index] - a) @ off).sum(axis=(1, 2))
            row = int(far.argmin())
            if best is None or far[row] < best[0]:
                best = float(far[row]), np.unique(index[row])
        if best is not None:
            ids.append(best[1])
            through += [a] * len(best[1])
            across += [off] * len(best[1])
    if not ids:
        return np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3, 3))
    return np.concatenate(ids), np.array(through), np.array(across)


#: Place on rulings where widths are measured, as a share of the continuation's width.
_DEPTH = 0.3


class Radius:
    """The bound on the radius of bends, as an energy of the hinges of strips.

    The angle of a fold must not exceed the width of the faces beside it over the radius. Widths
    are those at two places of the ruling, close to its ends.

    Parameters
    ----------
    hinge : ndarray of int, (h, 2)
        Pairs of faces.
    ends : ndarray of int, (h, 2)
        Ends of their common rulings.
    margin : float
        Width of the continuation of the design.
    radius : float
    """

    def __init__(self, hinge: Ints, ends: Ints, margin: float, radius: float):
        self._hinge, self._ends = hinge, ends
        self._margin, self._radius = margin, radius

    def excess(self, vertices: Array, turn: Array, gap: Array) -> tuple[Array, Array]:
        """Return by how much angles (h, 2) are too large, and the places (h, 2) on the rulings.

        Parameters
        ----------
        turn : ndarray, (h, 3)
            Changes of the normal.
        gap : ndarray, (f, 2)
            Distances of the ends of the faces' rulings; infinite where they are one vertex.
        """
        a, b = vertices[self._ends].transpose(1, 0, 2)
        share = np.minimum(_DEPTH * self._margin / np.maximum(lengths(b - a), 1e-300), 0.4)
        places = np.stack([share, 1.0 - share], axis=1)
        width = np.where(np.isfinite(gap), np.maximum(gap, 0.0), 0.0)[self._hinge].mean(axis=1)
        at = (1.0 - places) * width[:, :1] + places * width[:, 1:]
        return np.maximum(lengths(turn)[:, None] - at / self._radius, 0.0), places

    def parts(
        self, excess: Array, places: Array, turn: Array, side: Array, row: Array
    ) -> tuple[Array, Array]:
        """Return the gradient (h, 24) and second derivatives (h, 24, 24) of the squared excess.

        Parameters
        ----------
        side : ndarray, (f, 3)
            Directions across the rulings.
        row : ndarray, (h, 3, 24)
            Derivatives of the changes of the normal by the corners of both faces.
        """
        angle = np.einsum("hi,hik->hk", unit(turn), row)
        gradient, second = np.zeros(angle.shape), np.zeros((*angle.shape, angle.shape[1]))
        across = side[self._hinge]
        for k in (0, 1):
            v = places[:, k, None]
            weight = np.concatenate([v - 1.0, -v, 1.0 - v, v], axis=1) / (2.0 * self._radius)
            width = (weight[:, None, :, None] * across[:, :, None]).reshape(len(v), -1)
            slope = (excess[:, k] > 0)[:, None] * (angle - width)
            gradient += 2.0 * excess[:, k, None] * slope
            second += 2.0 * slope[:, :, None] * slope[:, None]
        return gradient, second

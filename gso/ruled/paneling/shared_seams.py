"""Pieces as ruled surfaces that share the points of their seams: both sides of a seam are equal.

All points are on seams and on the design's outline. Whatever their places are, the pieces are
exactly developable: they consist of triangles and planar quads without vertices inside.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from gso.cut_pieces import Pieces
from gso.mesh import Mesh
from gso.mesh.topology import pair_keys
from gso.ruled.domain import Domain
from gso.ruled.lines.line_fit import LineFitter
from gso.ruled.lines.line_surface import line_surface
from gso.ruled.lines.polygons import Polygons
from gso.ruled.outline_polygons import outline_polygons
from gso.ruled.paneling.seam_points import seam_points
from gso.ruled.ruled_surface import RuledSurface
from gso.seams.sheets import Sheet
from gso.typing import Array, Ints

#: Factor on tangential displacements.
_TANGENTIAL = 0.1
#: Share of the allowed distance that seams may be from the chords between their points.
_CHORD = 0.1


class SharedSeams:
    """Ruled surfaces of pieces with shared seams; rulings may branch at flat triangles.

    Parameters
    ----------
    design : Mesh
        What the surfaces are near, with the vertices of the pieces' design.
    shape : Pieces
        Pieces that are nearly developable, all of them disks.
    sheets : sequence of Sheet
        The flat patterns of the pieces.
    allowed : float
        Distance from the design.
    """

    def __init__(self, design: Mesh, shape: Pieces, sheets: Sequence[Sheet], allowed: float):
        self._shape, self._allowed = shape, allowed
        self._size, self._centre = design.diagonal, design.frame.centre
        self._start = self._scaled(shape.design.vertices)
        self._target = design.replaced(self._scaled(design.vertices))
        self._fitter = LineFitter(self._target)
        self._pieces = list(shape)
        self._domains = [
            Domain(piece.mesh.replaced(self._start[piece.vertices]), sheet.flat / self._size)
            for piece, sheet in zip(self._pieces, sheets, strict=True)
        ]
        self._tried: set[bytes] = set()

    def _scaled(self, points: Array) -> Array:
        return (points - self._centre) / self._size

    def surface(self, side: int, tell: Callable[[int], bool]) -> RuledSurface | None:
        """Make a ruled surface of each piece, between points that were not tried before.

        Parameters
        ----------
        side : int
            Number of points on the sides of a square of the pieces' mean area.
        tell : callable
            Told the number of each piece; returning False ends the search for rulings.

        Returns
        -------
        RuledSurface or None
            None where a piece meets itself at a seam, or cannot be divided by rulings, where the
            points are those of another number, and where `tell` ended it.
        """
        chosen, smooth = seam_points(self._shape, _CHORD * self._allowed, side)
        if chosen.tobytes() in self._tried:
            return None
        self._tried.add(chosen.tobytes())
        rings: list[Ints] = []
        strip: list[int] = []
        borders: list[Ints] = []
        for k, (piece, domain) in enumerate(zip(self._pieces, self._domains, strict=True)):
            if not tell(k):
                return None
            loop = domain.outline
            corners = loop[chosen[piece.vertices[loop]]]
            points = domain.mesh.vertices[corners]
            around = piece.vertices[corners]
            own = outline_polygons(domain, corners, points, self._allowed / self._size)
            own = [around[ring] for ring in own]
            if not own or any(len(np.unique(ring)) < len(ring) for ring in own):
                return None
            rings += own
            borders.append(np.stack([around, np.roll(around, -1)], axis=1))
            strip += [k] * len(own)
        polygons = _polygons(rings, np.array(strip), np.concatenate(borders), smooth)
        points = self._fitter.fit(polygons, self._start, tangential=_TANGENTIAL)
        surface = line_surface(self._target, polygons, points)
        return surface.transformed(
            lambda x: self._size * x + self._centre, self._size, lambda rows: rows
        )


def _polygons(rings: list[Ints], strip: Ints, borders: Ints, smooth: Ints) -> Polygons:
    """Join the polygons of pieces; edges on the outlines of pieces (b, 2) are no rulings."""
    ends = np.concatenate([np.stack([ring, np.roll(ring, -1)], axis=1) for ring in rings])
    edges, count = np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)
    n = int(edges.max()) + 1
    border = np.isin(pair_keys(edges, n), pair_keys(borders, n))
    none = np.empty((0, 3), np.int64)
    return Polygons(rings, strip, edges[~border], edges[border & (count == 2)], smooth, none)

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
from gso.typing import Ints

#: Factor on tangential displacements.
_TANGENTIAL = 0.1
#: Share of the allowed distance that seams may be from the chords between their points.
_CHORD = 0.1


def of_shared_seams(
    design: Mesh,
    shape: Pieces,
    sheets: Sequence[Sheet | None],
    allowed: float,
    side: int,
    *,
    tell: Callable[[int], bool] = lambda number: True,
) -> RuledSurface | None:
    """Make a ruled surface of each piece, with shared seams; rulings may branch at flat triangles.

    Parameters
    ----------
    design : Mesh
        What the surface is near, with the vertices of the pieces' design.
    shape : Pieces
        Pieces that are nearly developable, all of them disks.
    sheets : sequence of Sheet or None
        The flat patterns of the pieces.
    allowed : float
        Distance from the design.
    side : int
        Number of points on the sides of a square of the pieces' mean area.
    tell : callable
        Told the number of each piece; returning False ends the search for rulings.

    Returns
    -------
    RuledSurface or None
        None where a piece has no pattern, meets itself at a seam, or cannot be divided by rulings,
        and where `tell` ended it.
    """
    size, centre = design.diagonal, design.frame.centre
    scaled = shape.design.replaced((shape.design.vertices - centre) / size)
    chosen, smooth = seam_points(shape, _CHORD * allowed, side)
    rings: list[Ints] = []
    strip: list[int] = []
    borders: list[Ints] = []
    for k, piece in enumerate(shape):
        mesh = piece.mesh.replaced(scaled.vertices[piece.vertices])
        sheet = sheets[k]
        if sheet is None or not tell(k):
            return None
        domain = Domain(mesh, sheet.flat / size)
        loop = domain.outline
        corners = loop[chosen[piece.vertices[loop]]]
        own = outline_polygons(domain, corners, mesh.vertices[corners], allowed / size)
        if not own:
            return None
        own = [piece.vertices[corners[ring]] for ring in own]
        if any(len(np.unique(ring)) < len(ring) for ring in own):
            return None
        rings += own
        around = piece.vertices[corners]
        borders.append(np.stack([around, np.roll(around, -1)], axis=1))
        strip += [k] * len(own)
    polygons = _polygons(rings, np.array(strip), np.concatenate(borders), smooth)
    target = design.replaced((design.vertices - centre) / size)
    points = LineFitter(target).fit(polygons, scaled.vertices, tangential=_TANGENTIAL)
    surface = line_surface(target, polygons, points)
    return surface.transformed(lambda x: size * x + centre, size, lambda rows: rows)


def _polygons(rings: list[Ints], strip: Ints, borders: Ints, smooth: Ints) -> Polygons:
    """Join the polygons of pieces; edges on the outlines of pieces (b, 2) are no rulings."""
    ends = np.concatenate([np.stack([ring, np.roll(ring, -1)], axis=1) for ring in rings])
    edges, count = np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)
    n = int(edges.max()) + 1
    border = np.isin(pair_keys(edges, n), pair_keys(borders, n))
    none = np.empty((0, 3), np.int64)
    return Polygons(rings, strip, edges[~border], edges[border & (count == 2)], smooth, none)

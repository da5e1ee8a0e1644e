"""Folded parts as solids of the sheet's thickness."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.geometry import area_vectors
from gso.geometry.vectors import unit
from gso.io import Solid, Turned
from gso.mesh import Mesh
from gso.mesh.topology import half_edges
from gso.recognition import RoundSurface, recognise
from gso.typing import Array, Flags, Ints
from gso.workshop.panels import Panel
from gso.workshop.thickness import Thickness

#: Share of the largest singular value below which normals count as equal.
_FLAT = 1e-6
#: Distance, relative to the size, within which vertices are at the limits of a round face, and
#: angle in radians that a round face leaves open at least.
_SAME, _OPEN = 1e-7, np.radians(20.0)


def folded_solids(panels: Sequence[Panel], scale: float, thickness: Thickness) -> list[Solid]:
    """Return the folded panels of a design as solids, in millimetres, with their names.

    Bends that are cylinders or cones between two rulings and two circles are exact; others have
    flat facets.

    Parameters
    ----------
    panels : sequence of Panel
        In the design's unit.
    scale : float
        Millimetres per unit of length of the design.
    thickness : Thickness
        In millimetres; it says on which side of the surface the sheet is, too.
    """
    below = {"middle": 0.5, "outside": 1.0, "inside": 0.0}[thickness.face] * thickness.sheet
    return [
        thick(
            panel.surface.replaced(scale * panel.surface.vertices),
            below,
            thickness.sheet,
            panel.name,
        )
        for panel in panels
    ]


def thick(surface: Mesh, below: float, sheet: float, name: str = "part") -> Solid:
    """Return a solid between two surfaces that are parallel to a surface.

    Each face is moved along its normal, so that all are as thick as the sheet; at folds the sheet
    is mitred.

    Parameters
    ----------
    surface : Mesh
    below : float
        Distance of the lower surface.
    sheet : float
        Distance of both.
    name : str

    Examples
    --------
    >>> flat = Mesh([[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]], [[0, 1, 2, 3]])
    >>> float(np.ptp(thick(flat, 1.0, 2.0).mesh.vertices[:, 2]))
    2.0
    """
    points, triangles = surface.vertices, surface.triangles
    above = sheet - below
    normals = np.repeat(unit(area_vectors(points, triangles))[:, None], 3, axis=1)
    he = half_edges(triangles, len(points))
    edges, outline = np.stack([he.origin, he.dest], axis=1), np.flatnonzero(he.twin < 0)
    flat, straight = np.ones(len(triangles), bool), np.ones(len(outline), bool)
    turned: list[Turned] = []
    bends, faceted = _bends(surface)
    for bend, ids in bends:
        exact = bend.normals(points[triangles[ids]].reshape(-1, 3)).reshape(-1, 3, 3)
        side = float(np.sign(np.einsum("tcd,tcd->", exact, normals[ids])))
        mine = np.isin(np.arange(len(triangles)), ids)
        limit = mine[he.face] & ((he.twin < 0) | ~mine[he.face[he.twin]])
        offsets = side * above, -side * below
        found = _turned(bend, points, edges[limit], he.twin[limit] < 0, offsets)
        if found:
            normals[ids], flat[ids] = side * exact, False
            # Its outlines that are circles; those along rulings stay straight, but for a seam.
            rise = np.abs(np.diff(bend.coordinates(points)[2][edges[outline]], axis=1)).ravel()
            most = np.inf if found[0].angle == 2 * np.pi else _SAME * surface.diagonal
            straight &= ~mine[he.face[outline]] | (rise > most)
            turned += found
        faceted |= not found
    way = _mitres(triangles, normals, len(points))
    n = len(points)
    a, b = he.origin[outline], he.dest[outline]
    walls = np.concatenate([np.stack([b, a, a + n], axis=1), np.stack([b, a + n, b + n], axis=1)])
    solid = Mesh(
        np.concatenate([points + above * way, points - below * way]),
        np.concatenate([triangles, triangles[:, ::-1] + n, walls]),
    )
    kept = np.flatnonzero(np.concatenate([flat, flat, straight, straight]))
    return Solid(name, solid, tuple(turned), kept if turned else None, faceted)


def _bends(surface: Mesh) -> tuple[list[tuple[RoundSurface, Ints]], bool]:
    """Return the cylinders and cones of a surface with their triangles, and if others are round."""
    shape = recognise(surface)
    if len(shape.triangles) != len(surface.triangles):
        # A closed face was opened.
        return [], True
    bends = [(face.surface, face.triangles) for face in shape.faces if face.surface is not None]
    others = (face for face in shape.faces if face.surface is None)
    return bends, any(face.kind in ("cone", "torsal") for face in others)


def _turned(
    bend: RoundSurface, points: Array, edges: Ints, outer: Flags, offsets: tuple[float, float]
) -> list[Turned]:
    """Return the round faces of a bend's solid; none if it is not limited by rulings and circles.

    Parameters
    ----------
    bend : RoundSurface
    points : ndarray, (n, 3)
    edges : ndarray of int, (e, 2)
        The edges that limit it.
    outer : ndarray of bool, (e,)
        Which of them are outlines of the part.
    offsets : (float, float)
        Distances of both sides of the sheet from the surface, outwards.
    """
    ids = np.unique(edges)
    near = _SAME * float(np.linalg.norm(np.ptp(points, axis=0)))
    angle, rho, height = bend.coordinates(points)
    around = np.sort(angle[ids])
    gaps = np.diff(around, append=around[0] + 2 * np.pi)
    widest = int(gaps.argmax())
    low, high = height[ids].min(), height[ids].max()
    level = [np.abs(height[edges] - at).max(axis=1) < near for at in (low, high)]
    start, turn = around[(widest + 1) % len(around)], 2 * np.pi - gaps[widest]
    if gaps[widest] < _OPEN:
        # It closes around the axis, but for a seam.
        sides = edges[~np.any(level, axis=0)]
        start, turn = (angle[sides[0, 0]] if len(sides) else start), 2 * np.pi
    # A little before the start is not almost a whole turn.
    past = np.mod(angle - start + _SAME, 2 * np.pi) - _SAME
    ruling = [(np.abs(past - at) * rho)[edges].max(axis=1) < near for at in (0.0, turn)]
    least = rho[ids].min() + min(offsets) / np.cos(bend.half_angle)
    if least <= near or not np.any([*level, *ruling], axis=0).all():
        return []
    corners = bend.point(np.array([start, start]), np.array([low, high]))
    way = bend.normals(corners)
    top, bottom = (corners + d * way for d in offsets)
    lines = [top, bottom]
    for k in (0, 1):
        if outer[level[k]].all():
            lines.append(np.stack([top[k], bottom[k]]))
        elif outer[level[k]].any():
            return []
    return [Turned(line, bend.centre, bend.axis, float(turn)) for line in lines]


def _mitres(triangles: Ints, normals: Array, count: int) -> Array:
    """Return how vertices move when all their faces move by one along their normals.

    It is the shortest vector x with n x = 1 for the normals n (t, 3, 3) of triangles at a vertex.
    """
    squares = np.zeros((count, 3, 3))
    sums = np.zeros((count, 3))
    n = normals.reshape(-1, 3)
    np.add.at(squares, triangles.ravel(), n[:, :, None] * n[:, None, :])
    np.add.at(sums, triangles.ravel(), n)
    inverse = np.linalg.pinv(squares, rcond=_FLAT, hermitian=True)
    return np.asarray(np.einsum("nij,nj->ni", inverse, sums))

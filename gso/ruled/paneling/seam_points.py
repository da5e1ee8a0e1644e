"""Points of seams and outlines, between which the parts of a design are straight."""

from __future__ import annotations

import numpy as np

from gso.cut_pieces import Pieces
from gso.geometry.polygon import arc_lengths, points_at
from gso.geometry.vectors import lengths, unit
from gso.mesh import vertex_normals
from gso.mesh.polyline import turns
from gso.seams.chains import chains
from gso.typing import Array, Flags, Ints

#: Turning of a curve at a corner, in degrees.
_SHARP = 35.0
#: Least number of points on a curve that closes.
_CLOSED = 6
#: Ratio of the distance between points to how far a seam may be from its chords on the surface.
_SIDEWAYS = 2.0
#: Ratio of successive numbers of points of a curve.
_MORE = 1.25


def seam_points(pieces: Pieces, within: float, side: int) -> tuple[Flags, Ints]:
    """Choose vertices of seams and outlines, evenly spaced between corners and junctions.

    Parameters
    ----------
    pieces : Pieces
    within : float
        Distance of seams from the chords between successive points.
    side : int
        Least number of points on the sides of a square of the pieces' mean area.

    Returns
    -------
    chosen : ndarray of bool, (n,)
        Mask over the design's vertices.
    smooth : ndarray of int, (t, 3)
        Chosen vertices that follow each other on a seam or an outline, but for its corners.
    """
    mesh, he = pieces.design, pieces.design.half_edges
    rim = np.flatnonzero(he.twin < 0)
    around = np.stack([np.full(len(rim), -1), pieces.of_face[he.face[rim]]], axis=1)
    edges = np.concatenate([pieces.edges, np.stack([he.origin[rim], he.dest[rim]], axis=1)])
    sides = np.concatenate([pieces.sides, around])
    step = float(np.sqrt(sum(part.area for part in pieces.parts) / len(pieces))) / side
    chosen = np.zeros(len(mesh.vertices), bool)
    smooth = [np.empty((0, 3), np.int64)]
    normals = vertex_normals(mesh)
    degree = np.bincount(edges.ravel(), minlength=len(mesh.vertices))
    for (first, _), chain in chains(edges, sides):
        # Where a seam runs on the surface is free, where the outline runs is not.
        outer = first < 0
        for curve in _smooth_curves(chain, mesh.vertices) if outer else [chain]:
            ways = None if outer else normals[curve]
            kept = curve[_spaced(mesh.vertices[curve], ways, step, within)]
            chosen[kept] = True
            if kept[0] == kept[-1] and degree[kept[0]] == 2 and _is_smooth(mesh.vertices[kept]):
                kept = np.r_[kept, kept[1]]
            smooth.append(np.stack([kept[:-2], kept[1:-1], kept[2:]], axis=1))
    return chosen, np.concatenate(smooth)


def _smooth_curves(chain: Ints, vertices: Array) -> list[Ints]:
    """Divide a chain at its corners; the first is one of these if it closes around."""
    way = unit(np.diff(vertices[chain], axis=0))
    sharp = turns(way) > _SHARP
    if chain[0] == chain[-1]:
        if not sharp.any():
            return [chain]
        first = int(sharp.argmax())
        chain, sharp = np.roll(chain[:-1], -first), np.roll(sharp, -first)
        chain = np.r_[chain, chain[0]]
    sharp[0] = False
    return [np.asarray(c) for c in _divided(chain, np.flatnonzero(sharp))]


def _is_smooth(points: Array) -> bool:
    """Return whether a closed curve has no corner where it begins."""
    way = unit(np.stack([points[-1] - points[-2], points[1] - points[0]]))
    return float(turns(way)[1]) <= _SHARP


def _divided(chain: Ints, corners: Ints) -> list[Ints]:
    at = np.r_[0, corners, len(chain) - 1]
    return [chain[a : b + 1] for a, b in zip(at[:-1].tolist(), at[1:].tolist(), strict=True)]


def _spaced(points: Array, normals: Array | None, step: float, within: float) -> Ints:
    """Return the numbers of evenly spaced points of a curve, from the first to the last.

    With normals of the surface the curve may be farther from the chords along the surface.
    """
    at = arc_lengths(points)
    closed = bool((points[0] == points[-1]).all())
    count = max(int(np.ceil(at[-1] / step)), _CLOSED if closed else 1)
    while True:
        places = np.linspace(0.0, at[-1], count + 1)
        chosen = np.unique(np.abs(at[:, None] - places).argmin(axis=0))
        chord = points_at(at, at[chosen], points[chosen])
        off = chord - points
        far = lengths(off)
        if normals is not None:
            upright = np.abs(np.einsum("kd,kd->k", off, normals))
            far = np.maximum(upright, _SIDEWAYS * within / step * far)
        if len(chosen) == len(at) or far.max() <= within:
            return chosen
        count = int(np.ceil(_MORE * count))

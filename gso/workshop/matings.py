"""Seams between panels: chains of corresponding points on both sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from gso.cut_pieces import Pieces
from gso.geometry.polygon import arc_lengths
from gso.mesh.polyline import Polylines
from gso.mesh.topology import half_edges
from gso.pattern import Pattern
from gso.seams.chains import chains
from gso.typing import Array, Ints
from gso.workshop.panels import Mating, Panel, Side

#: Turn of a seam's side in the plane, in radians, that is a corner of a part with folds.
_CORNER = np.radians(30.0)
#: Difference of angles, in radians, up to which a seam has one angle.
_SAME = np.radians(1.0)


def of_pattern(
    points: Array,
    pattern: Pattern,
    label: Ints,
    local: Ints,
    corners: bool = False,
    angles: Array | None = None,
) -> list[Mating]:
    """Find the seams of a pattern that is cut.

    Parameters
    ----------
    points : ndarray, (n, 3)
        Vertices of the surface.
    pattern : Pattern
    label, local : ndarray of int, (p,)
        The panel of each vertex of the pattern, and its number in it.
    corners : bool
        Whether seams end at corners of the panels, as those of nets, whose edges are glued or
        welded one by one.
    angles : ndarray, (s,), optional
        Angle between the faces at each seam edge.
    """
    seams = pattern.seams
    if not len(seams):
        return []
    edges = pattern.vertex[seams[:, 0]]
    sides = label[seams[:, :, 0]]
    ahead = _directed(pattern, seams)
    known: dict[tuple[int, int], tuple[Ints, bool]] = {}
    turn: dict[tuple[int, int], float] = {}
    for k, (a, b) in enumerate(edges.tolist()):
        known[a, b], known[b, a] = (seams[k], ahead[k]), (seams[k][:, ::-1], not ahead[k])
        turn[a, b] = turn[b, a] = np.nan if angles is None else float(angles[k])
    out = []
    for _, line in chains(edges, sides):
        both: list[list[int]] = [[], []]
        for a, b in pairwise(line.tolist()):
            copies, first = known[a, b]
            # The first side is the one whose faces lie to the left of the chain.
            for side, ends in zip(both, copies if first else copies[::-1], strict=True):
                side += ends.tolist() if not side else [int(ends[1])]
        table = np.array(both)
        turned = np.zeros(len(line), bool)
        if corners:
            turned[1:-1] = (_turns(pattern.flat[table]) > _CORNER).any(axis=0)
        for a, b in pairwise([0, *np.flatnonzero(turned).tolist(), len(line) - 1]):
            one, two = (_side(side, label, local) for side in table[:, a : b + 1])
            own = [turn[ends] for ends in pairwise(line[a : b + 1].tolist())]
            angle = np.inf if np.ptp(own) > _SAME else float(np.mean(own))
            along = arc_lengths(points[line[a : b + 1]])
            out.append(Mating(0, along, one, two, angle=angle))
    return out


def across(
    pieces: Pieces, owner: Sequence[int], panels: Sequence[Panel], rims: list[Ints]
) -> list[Mating]:
    """Find the seams between pieces whose panels follow them within a distance.

    Parameters
    ----------
    pieces : Pieces
        The surface that the panels follow.
    owner : sequence of int
        The piece of each panel.
    panels : sequence of Panel
    rims : list of ndarray of int, (e, 2)
        The edges of each panel's outline that are no seam within its piece.
    """
    opened, points = pieces.opened, pieces.opened.mesh.vertices
    label = np.full(len(opened.vertex), -1)
    for number, part in enumerate(pieces.parts):
        label[part.vertices] = number
    flat = Pattern(opened.mesh.vertices[:, :2], opened.mesh.faces, opened.vertex, opened.seams)
    out = []
    for seam in of_pattern(pieces.design.vertices, flat, label, np.arange(len(label))):
        feet = []
        for side in (seam.one, seam.two):
            own = [k for k, piece in enumerate(owner) if piece == side.panel]
            feet.append(_nearest(points[side.edges[:, 0]], own, panels, rims))
        change = np.flatnonzero(np.diff(feet[0][0]) | np.diff(feet[1][0])) + 1
        for a, b in pairwise([0, *change.tolist(), len(seam.along)]):
            if b - a > 1:
                one, two = (
                    Side(int(panel[a]), edges[a:b], share[a:b]) for panel, edges, share in feet
                )
                out.append(Mating(0, seam.along[a:b] - seam.along[a], one, two, common=False))
    return out


def numbered(matings: Sequence[Mating]) -> tuple[Mating, ...]:
    """Number seams from 1 on, the longest first."""
    order = np.argsort([-seam.length for seam in matings], kind="stable").tolist()
    return tuple(replace(matings[k], number=number) for number, k in enumerate(order, start=1))


def alike(matings: Sequence[Mating]) -> tuple[Mating, ...]:
    """Mark the seams of parts that are all alike: between two of them, or of one with itself.

    The mark is the number of the first seam of the kind.
    """
    first: dict[bool, int] = {}
    kinds = [first.setdefault(m.one.panel == m.two.panel, m.number) for m in matings]
    return tuple(replace(one, kind=kind) for one, kind in zip(matings, kinds, strict=True))


def _directed(pattern: Pattern, seams: Ints) -> list[bool]:
    """Tell whether the faces of the first copy of each seam edge lie to its left."""
    # The faces of a flat image may have no area there.
    n = len(pattern.flat)
    he = half_edges(pattern.faces, n)
    keys = he.origin * n + he.dest
    first = seams[:, 0]
    left: list[bool] = np.isin(first[:, 0] * n + first[:, 1], keys[he.face >= 0]).tolist()
    return left


def _turns(lines: Array) -> Array:
    """Return the angles (l, k - 2) by which lines of points (l, k, 2) turn."""
    way = np.diff(lines, axis=1) @ np.array([1.0, 1j])
    return np.asarray(np.abs(np.angle(way[:, 1:] * way[:, :-1].conj())))


def _side(vertices: Ints, label: Ints, local: Ints) -> Side:
    return Side.of(int(label[vertices[0]]), local[vertices])


def _nearest(
    points: Array, own: Sequence[int], panels: Sequence[Panel], rims: list[Ints]
) -> tuple[Ints, Ints, Array]:
    """Find the nearest places on the outlines of some panels: panel, edge, share of each point."""
    edges = np.concatenate([rims[k] for k in own])
    which = np.repeat(list(own), [len(rims[k]) for k in own])
    ends = np.concatenate([panels[k].surface.vertices[rims[k]] for k in own])
    unused = np.zeros((len(ends), 2), bool), np.zeros((len(ends), 2, 3))
    feet = Polylines(ends[:, 0], ends[:, 1], *unused).nearest(points)
    share = np.clip(feet.along, 0.0, 1.0)
    return which[feet.segment], edges[feet.segment], share

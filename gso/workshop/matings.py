"""Seams between panels: chains of corresponding points on both sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gso.cut_pieces import Pieces
from gso.geometry.polygon import arc_lengths, points_at
from gso.geometry.vectors import lengths
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
#: Way along an outline between neighbouring points of a seam, relative to their distance and those
#: from the outline, from which on a cut lies between; and number of parts of a step there.
_JUMP, _FINER = 3.0, 32


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
    for _, chain in chains(edges, sides):
        copies = []
        for a, b in pairwise(chain.tolist()):
            pair, first = known[a, b]
            # The first side is the one whose faces lie to the left of the chain.
            copies.append(pair if first else pair[::-1])
        for line, table in _unbroken(chain, np.array(copies)):
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
        line, along = points[seam.one.edges[:, 0]], seam.along
        both = [
            [k for k, piece in enumerate(owner) if piece == side.panel]
            for side in (seam.one, seam.two)
        ]
        feet = [_feet(line, own, panels, rims) for own in both]
        ends = _ends(feet, line, panels)
        if len(ends):
            # A side goes on elsewhere between two points: nearly all of that belongs to one of it.
            line, along = _refined(ends, line, along)
            feet = [_feet(line, own, panels, rims) for own in both]
            ends = _ends(feet, line, panels)
        for a, b in pairwise([0, *ends.tolist(), len(along)]):
            if b - a > 1:
                one, two = (
                    Side(int(foot.panel[a]), foot.edges[a:b], foot.shares[a:b]) for foot in feet
                )
                out.append(Mating(0, along[a:b] - along[a], one, two, common=False))
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


def _unbroken(chain: Ints, copies: Ints) -> list[tuple[Ints, Ints]]:
    """Divide a chain where a side goes on at another copy of a vertex, as where cuts meet a rim.

    Parameters
    ----------
    chain : ndarray of int, (k,)
        Vertices along it.
    copies : ndarray of int, (k - 1, 2, 2)
        Copies of both ends of each edge, on both sides.

    Returns
    -------
    list of (ndarray of int (n,), ndarray of int (2, n))
        Vertices of each part, and their copies on both sides.
    """
    ends = np.flatnonzero((copies[1:, :, 0] != copies[:-1, :, 1]).any(axis=1)) + 1
    return [
        (chain[a : b + 1], np.concatenate([copies[a : a + 1, :, 0], copies[a:b, :, 1]]).T)
        for a, b in pairwise([0, *ends.tolist(), len(copies)])
    ]


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


class _Feet(NamedTuple):
    """Nearest places on the outlines of panels: panel, edge and share of each point."""

    panel: Ints
    edges: Ints
    shares: Array


def _feet(points: Array, own: Sequence[int], panels: Sequence[Panel], rims: list[Ints]) -> _Feet:
    """Find the nearest places on the outlines of some panels."""
    edges = np.concatenate([rims[k] for k in own])
    which = np.repeat(list(own), [len(rims[k]) for k in own])
    ends = np.concatenate([panels[k].surface.vertices[rims[k]] for k in own])
    # In one direction on both sides of a seam, so that places on a common edge are equal.
    off = ends[:, 1] - ends[:, 0]
    first = np.take_along_axis(off, (off != 0).argmax(axis=1)[:, None], axis=1)[:, 0]
    back = first < 0
    edges[back], ends[back] = edges[back, ::-1], ends[back, ::-1]
    unused = np.zeros((len(ends), 2), bool), np.zeros((len(ends), 2, 3))
    feet = Polylines(ends[:, 0], ends[:, 1], *unused).nearest(points)
    share = np.clip(feet.along, 0.0, 1.0)
    return _Feet(which[feet.segment], edges[feet.segment], share)


def _ends(feet: Sequence[_Feet], line: Array, panels: Sequence[Panel]) -> Ints:
    """Return the points of a seam before which a side goes on elsewhere.

    That is on another panel, or on the other side of a cut in the same one.
    """
    out = np.zeros(len(line) - 1, bool)
    step = lengths(np.diff(line, axis=0))
    for foot in feet:
        place, off = np.empty((len(line), 3)), np.empty(len(line))
        for k in np.unique(foot.panel).tolist():
            on = foot.panel == k
            side = Side(k, foot.edges[on], foot.shares[on])
            place[on] = _places(panels[k], side)
            off[on] = lengths(side.on(panels[k].surface.vertices) - line[on])
        loop, at, around = place.T
        way = np.abs(np.diff(at))
        way = np.minimum(way, around[1:] - way)
        out |= np.diff(foot.panel) != 0
        out |= (np.diff(loop) != 0) | (way > _JUMP * (step + off[1:] + off[:-1]))
    return np.flatnonzero(out) + 1


def _places(panel: Panel, side: Side) -> Array:
    """Return the boundary loop of points on a panel's outline, the place on it, and its length."""
    flat = panel.flat
    start, loop, around = np.zeros((3, len(flat)))
    after = np.zeros(len(flat), np.int64)
    for number, ids in enumerate(panel.loops):
        along = arc_lengths(flat[np.r_[ids, ids[:1]]])
        start[ids], loop[ids], around[ids] = along[:-1], number, along[-1]
        after[ids] = np.roll(ids, -1)
    a, b = side.edges.T
    size, ahead = lengths(flat[b] - flat[a]), after[a] == b
    at = np.where(ahead, start[a] + side.shares * size, start[b] + (1.0 - side.shares) * size)
    return np.stack([loop[a], at, around[a]], axis=1)


def _refined(ends: Ints, line: Array, along: Array) -> tuple[Array, Array]:
    """Insert points into a seam before some of its points; its points and arc lengths."""
    share = np.linspace(0.0, 1.0, _FINER + 1)[1:-1]
    more = (along[ends - 1, None] + share * (along[ends] - along[ends - 1])[:, None]).ravel()
    every = np.sort(np.concatenate([along, more]))
    return points_at(every, along, line), every

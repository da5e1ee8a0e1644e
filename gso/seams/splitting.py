"""Cuts through a piece that overlaps itself when it is laid flat, or is too large."""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import dijkstra

from gso.geometry.polygon import rectangle
from gso.mesh import between
from gso.mesh.separation import spans
from gso.mesh.topology import edge_graph
from gso.seams.sheets import Sheet
from gso.typing import Array, Ints

#: Radius of the two parts that an overlap is cut between, relative to their distance.
_BALL = 0.3


def apart(sheet: Sheet, factor: Array | None = None) -> Ints:
    """Choose the edges (e, 2) of a shortest cut between two faces that overlap.

    Of all pairs that overlap, the one that is farthest apart on the surface. The factor (k,) is on
    the cost of each edge of the piece.
    """
    mesh = sheet.mesh
    pairs = sheet.overlaps
    he, (distance, _, h) = mesh.half_edges, spans(mesh)
    graph = edge_graph(len(mesh.faces), he.face[h], he.face[he.twin[h]], distance)
    firsts = np.unique(pairs[:, 0])
    some = firsts[:: max(len(firsts) // 20, 1)]
    away = dijkstra(graph, directed=False, indices=some)
    row = np.searchsorted(some, pairs[:, 0])
    known = (row < len(some)) & (some[np.minimum(row, len(some) - 1)] == pairs[:, 0])
    pairs, row = pairs[known], row[known]
    apart = away[row, pairs[:, 1]]
    k = int(apart.argmax())
    from_one = away[row[k]]
    from_two = dijkstra(graph, directed=False, indices=int(pairs[k, 1]))
    reach = _BALL * float(apart[k])
    return between(mesh, from_one <= reach, from_two <= reach, factor=factor)


def halves(sheet: Sheet, most: tuple[float, float], factor: Array | None = None) -> Ints:
    """Choose the edges (e, 2) of a shortest cut across a pattern that is larger than a sheet.

    The parts are as few as the sheet allows, and about equal.
    """
    mesh = sheet.mesh
    angle, size = rectangle(sheet.flat)
    limits = max(most), min(most)
    axis = int(size[1] / limits[1] > size[0] / limits[0])
    length, longest = size[axis], limits[axis]
    turn = angle + axis * 0.5 * np.pi
    along = sheet.flat @ np.array([np.cos(turn), np.sin(turn)])
    along = (along - along.min()) / length
    corners = np.where(mesh.faces < 0, mesh.faces[:, :1], mesh.faces)
    middle = along[corners].mean(axis=1)
    parts = max(int(np.ceil(length / longest)), 2)
    place = (parts // 2) / parts
    room = float(np.clip(0.5 * (longest / length - 1.0 / parts), 0.01, 0.1))
    price = 1.0 + 0.1 * np.abs(along - place) / room
    return between(mesh, middle < place - room, middle > place + room, price, factor)

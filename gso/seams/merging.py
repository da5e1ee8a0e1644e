"""Merging of pieces across their common seams, while the estimated strain stays low."""

from __future__ import annotations

import heapq
from collections.abc import Callable

import numpy as np

from gso.mesh.topology import pair_keys
from gso.seams.tree import Ground
from gso.typing import Ints


class Merging:
    """Pieces by label of each face, merged one pair after the other.

    Parameters
    ----------
    ground : Ground
    label : ndarray of int, (m,)
        Piece of each face; every piece a disk.
    strain : float
        Bound on the estimated strain of a piece.
    compact : float
        How much more a merge counts that removes much of a boundary.
    estimate : callable, optional
        What the bound is on instead of the strain: it takes faces, and returns None where they are
        no disk.
    """

    def __init__(
        self,
        ground: Ground,
        label: Ints,
        strain: float,
        compact: float,
        estimate: Callable[[Ints], float | None] | None = None,
    ):
        mesh = ground.mesh
        #: Estimates the strain of some faces together; None where they are no disk.
        self.estimate = estimate or ground.estimates
        self.ground, self.strain, self.compact = ground, strain, compact
        self.label: Ints = label.astype(np.int64).copy()
        he = mesh.half_edges
        k = he.interior
        self._ends = np.stack([he.origin[k], he.dest[k]], axis=1)
        self._sides = np.stack([he.face[k], he.face[he.twin[k]]], axis=1)
        self._length = np.linalg.norm(
            mesh.vertices[self._ends[:, 0]] - mesh.vertices[self._ends[:, 1]], axis=1
        )
        factor = ground.factor_of(self._ends)
        #: What an edge costs as a part of a seam.
        self._cost = self._length if factor is None else self._length * factor
        n = len(mesh.vertices)
        kept = pair_keys(ground.kept, n)
        self._kept = np.isin(pair_keys(self._ends, n), kept)
        rim = np.flatnonzero(he.twin < 0)
        self._rim = np.bincount(
            he.face[rim],
            np.linalg.norm(mesh.vertices[he.origin[rim]] - mesh.vertices[he.dest[rim]], axis=1),
            len(mesh.faces),
        )

    def run(self) -> Ints:
        """Merge until no merge is allowed; return the piece of each face (m,)."""
        members = {int(k): np.flatnonzero(self.label == k) for k in np.unique(self.label)}
        stamp = dict.fromkeys(members, 0)
        beside: dict[int, dict[int, float]] = {k: {} for k in members}
        forbidden: set[tuple[int, int]] = set()
        sides = self.label[self._sides]
        for k in np.flatnonzero(sides[:, 0] != sides[:, 1]).tolist():
            a, b = sides[k].tolist()
            beside[a][b] = beside[a].get(b, 0.0) + self._cost[k]
            beside[b][a] = beside[b].get(a, 0.0) + self._cost[k]
            if self._kept[k]:
                forbidden.add((min(a, b), max(a, b)))
        round_ = {k: sum(beside[k].values()) + float(self._rim[members[k]].sum()) for k in members}
        strain = dict.fromkeys(members, 0.0)
        heap: list[tuple[float, int, int, int, int, float]] = []

        def offer(a: int, b: int, found: float | None = None) -> None:
            """Add a merge, with the larger of both strains until its own is known."""
            a, b = min(a, b), max(a, b)
            if (a, b) in forbidden:
                return
            known = max(strain[a], strain[b]) if found is None else found
            share = beside[a][b] / min(round_[a], round_[b])
            value = known / self.strain - self.compact * share
            heapq.heappush(
                heap, (value, a, b, stamp[a], stamp[b], -1.0 if found is None else found)
            )

        for a, others in beside.items():
            for b in others:
                if a < b:
                    offer(a, b)
        while heap:
            _, a, b, seen_a, seen_b, known = heapq.heappop(heap)
            if a not in members or b not in members or (stamp[a], stamp[b]) != (seen_a, seen_b):
                continue
            if known < 0.0:
                found = self.estimate(np.concatenate([members[a], members[b]]))
                if found is not None and found <= self.strain:
                    offer(a, b, found)
                continue
            strain[a] = known
            members[a] = np.concatenate([members[a], members.pop(b)])
            round_[a] += round_.pop(b) - 2.0 * beside[a].pop(b)
            stamp[a] += 1
            for c, length in beside.pop(b).items():
                if c == a:
                    continue
                beside[c].pop(b)
                beside[a][c] = beside[a].get(c, 0.0) + length
                beside[c][a] = beside[a][c]
                if (min(b, c), max(b, c)) in forbidden:
                    forbidden.add((min(a, c), max(a, c)))
            for c in beside[a]:
                offer(a, c)
        for number, faces in enumerate(members.values()):
            self.label[faces] = number
        return self.label

    @property
    def cost(self) -> float:
        """Length of the seams between pieces, times the factors of their edges."""
        sides = self.label[self._sides]
        return float(self._cost[sides[:, 0] != sides[:, 1]].sum())

    def between(self, label: Ints) -> tuple[Ints, Ints]:
        """Return the edges (e, 2) between pieces, and the pieces (e, 2) on both sides."""
        sides = label[self._sides]
        cut = sides[:, 0] != sides[:, 1]
        return self._ends[cut], sides[cut]

    def edges(self, label: Ints | None = None) -> Ints:
        """Return the edges (e, 2) between pieces, with those that are cut in any case."""
        sides = (self.label if label is None else label)[self._sides]
        cut = self._ends[(sides[:, 0] != sides[:, 1]) | self._kept]
        return np.unique(np.sort(cut, axis=1), axis=0)

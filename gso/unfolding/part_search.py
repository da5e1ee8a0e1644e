"""Parts of patches: joining along the longest edges first, then local search."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso.geometry.polygon import rectangle
from gso.mesh.topology import edge_graph
from gso.typing import Array, Ints
from gso.unfolding.canonical_order import classes
from gso.unfolding.layout import Layout

#: How many times orders of the edges are varied, and by how much their lengths.
_STARTS, _VARIED = 4, 0.3
#: Temperatures at the start and at the end of the search; a part counts 1.
_HOT, _COLD = 0.15, 0.003
#: Weight of the lengths of cut edges, in mean edges.
_CUT = 0.02
#: Largest number of edges along which a subtree is tried to be joined again.
_TRIES = 8
#: Work of the search in microseconds about, more of it for each patch, and for each pair of patches
#: up to a bound.
_WORK, _WORK_EACH, _WORK_PAIR, _WORK_PAIRS = 3e5, 1e3, 0.3, 7.5e6
#: Largest number of passes that shorten cuts, and that make outlines compact.
_PASSES = 3
#: Work of measuring a rectangle, and by what share of it one must be smaller.
_BOXED, _SMALLER = 200.0, 1e-4


def merged(layout: Layout, order: Ints) -> Layout:
    """Join along edges in an order, wherever nothing overlaps."""
    for edge in order.tolist():
        a, b = layout.links.patches[edge]
        if layout.part[a] != layout.part[b]:
            layout.join(edge)
    return layout


def searched(start: Layout, seed: int, effort: float) -> Layout:
    """Join patches to as few parts as are found, with short cuts, then compact outlines.

    Parameters
    ----------
    start : Layout
        Nothing is joined. The order of the edges decides between equal ones, so it should not
        depend on the numbering of the design.
    seed : int
    effort : float
        Factor of the number of trials; with 0 the longest edges are joined first, and that is all.
    """
    links = start.links
    edges = np.arange(len(links.patches))
    best = merged(start.copy(), _longest(edges, links.weights))
    if effort <= 0:
        return best
    least = links.least
    random = np.random.default_rng(seed)
    pairs = min(_WORK_PAIR * links.count**2, _WORK_PAIRS)
    end = effort * (_WORK + _WORK_EACH * links.count + pairs)
    for _ in range(_STARTS):
        if best.number == least or best.work[0] > 0.3 * end:
            break
        noise = 1.0 + _VARIED * random.standard_normal(len(edges))
        varied = replace(start.copy(), work=best.work)
        other = merged(varied, edges[np.argsort(-links.weights[edges] * noise)])
        best = min(best, other, key=_value)
    if best.number > least:
        best = _Search(best, random).run(least, end)
    best = _shortened(best, best.work[0] + 0.3 * end)
    return _compacted(best, best.work[0] + 0.2 * end)


def _longest(edges: Ints, weights: Array) -> Ints:
    """Return edges in the order of their weights, the largest first; equal ones stay in order."""
    return edges[np.argsort(-classes(weights[edges]), kind="stable")]


def _value(layout: Layout) -> tuple[int, float]:
    """Return what the search makes small: the number of parts, then the length of the cuts."""
    return layout.number, round(layout.cut / max(float(layout.links.weights.sum()), 1e-300), 9)


class _Search:
    """Simulated annealing on layouts without overlaps."""

    def __init__(self, layout: Layout, random: np.random.Generator):
        self.now, self.best = layout, layout
        self.random = random
        self.tree: _Tree | None = None
        self.around = layout.links.around()
        self.mean = float(layout.links.weights.mean())

    def run(self, least: int, end: float) -> Layout:
        """Change the layout until so much work is done, or there are as few parts as can be."""
        energy = self._energy(self.now)
        work = self.now.work
        begin = work[0]
        while work[0] < end:
            work[0] += 100.0
            heat = _HOT * (_COLD / _HOT) ** ((work[0] - begin) / max(end - begin, 1.0))
            new = self._changed()
            if new is None:
                continue
            other = self._energy(new)
            rise = round(other - energy, 9)
            if rise <= 0 or self.random.random() < np.exp(-rise / heat):
                self.now, energy = new, other
                if _value(new) < _value(self.best):
                    self.best = new
                    if new.number == least:
                        break
        return self.best

    def _energy(self, layout: Layout) -> float:
        cut = layout.cut / (self.mean * np.sqrt(layout.links.count))
        return float(layout.number + 2.0 * layout.spread + _CUT * cut)

    def _changed(self) -> Layout | None:
        """Return a changed copy; None where nothing could be changed."""
        links, now = self.now.links, self.now
        # Edges of small parts more often: these are to vanish.
        open_ = np.flatnonzero(~now.joined)
        a, b = now.part[links.patches[open_]].T
        apart = a != b
        if apart.any() and self.random.random() < 0.7:
            some = open_[apart]
            size = np.bincount(now.part, links.areas)
            rank = np.minimum(size[a[apart]], size[b[apart]])
            chance = np.cumsum(1.0 / np.sqrt(rank + 1e-3))
            edge = int(some[np.searchsorted(chance, self.random.random() * chance[-1])])
            return self._united(edge)
        inside = open_[~apart]
        if not len(inside):
            return None
        return self._turned(int(inside[self.random.integers(len(inside))]))

    def _united(self, edge: int) -> Layout | None:
        """Join two parts; subtrees that are in the way are joined elsewhere."""
        new = self.now.copy()
        links = new.links
        i, j = links.patches[edge].tolist()
        first, second = new.triangles(new.part[i]), new.triangles(new.part[j])
        side = 1
        if len(second) > len(first):
            i, j, first, second, side = j, i, second, first, 0
        corners, own = new.moved(second, new.motion(edge, side))
        if not new.fits(first, corners):
            return None
        pairs = new.clashes(int(new.part[i]), corners, own)
        loose: list[list[int]] = []
        if len(pairs):
            ways: list[tuple[float, int, list[list[int]]]] = []
            for root, which in ((j, second[pairs[:, 1]]), (i, pairs[:, 0])):
                blocked = np.unique(links.patch[which])
                if root not in blocked:
                    subtrees = self._below(new, root, blocked)
                    ways.append(
                        (float(sum(links.areas[x].sum() for x in subtrees)), len(ways), subtrees)
                    )
            if not ways:
                return None
            loose = min(ways)[2]
        new.place(second, corners, own)
        new.part[new.part == new.part[j]] = new.part[i]
        new.joined[edge] = True
        # All subtrees leave their part before the first of them is joined again.
        for subtree in loose:
            self._loosen(new, subtree)
        for subtree in loose:
            self._attach(new, subtree)
        return new

    def _turned(self, edge: int) -> Layout | None:
        """Join a part along another edge; it is cut along one between both sides of it."""
        self.tree = _Tree.of(self.now, self.tree)
        path = self.tree.path(edge)
        return exchanged(self.now, self.around, edge, path[int(self.random.integers(len(path)))])

    def _below(self, layout: Layout, root: int, blocked: Ints) -> list[list[int]]:
        """Return the subtrees that begin at blocked patches, seen from a root."""
        order, above = [root], {root: -1}
        for here in order:
            for edge, there in self.around[here]:
                if layout.joined[edge] and there not in above:
                    above[there] = here
                    order.append(there)
        stop = set(blocked.tolist())
        inside: dict[int, int] = {}
        out: list[list[int]] = []
        for patch in order[1:]:
            if above[patch] in inside:
                inside[patch] = inside[above[patch]]
                out[inside[patch]].append(patch)
            elif patch in stop:
                inside[patch] = len(out)
                out.append([patch])
        return out

    def _loosen(self, layout: Layout, subtree: list[int]) -> None:
        """Make a subtree a part of its own."""
        own = set(subtree)
        for patch in subtree:
            for edge, there in self.around[patch]:
                if layout.joined[edge] and there not in own:
                    layout.joined[edge] = False
        layout.part[subtree] = int(layout.part.max()) + 1

    def _attach(self, layout: Layout, subtree: list[int]) -> None:
        """Join a subtree that is a part to another part, if there is an edge for it."""
        part = layout.part[subtree[0]]
        edges = [
            edge
            for patch in subtree
            for edge, there in self.around[patch]
            if layout.part[there] != part
        ]
        for edge in self.random.permutation(np.array(edges, np.int64))[:_TRIES].tolist():
            if layout.join(edge):
                return


class _Tree:
    """Paths along joined edges; patches are ordered so that those above others come first."""

    def __init__(self, layout: Layout):
        from scipy.sparse.csgraph import breadth_first_order

        self.layout, count = layout, layout.links.count
        joined = np.flatnonzero(layout.joined)
        a, b = layout.links.patches[joined].T
        # One patch of each part is below a common root.
        first = np.unique(layout.part, return_index=True)[1]
        root = np.full(len(first), count)
        graph = edge_graph(count + 1, np.r_[a, b, root], np.r_[b, a, first])
        order, above = breadth_first_order(graph, count)
        place = np.empty(count + 1, np.int64)
        place[order] = np.arange(len(order))
        by = np.full(count + 1, -1)
        by[np.where(above[a] == b, a, b)] = joined
        self.above, self.place, self.by = above.tolist(), place.tolist(), by.tolist()

    @classmethod
    def of(cls, layout: Layout, known: _Tree | None) -> _Tree:
        """Return the tree of a layout, which may be known."""
        return known if known is not None and known.layout is layout else cls(layout)

    def path(self, edge: int) -> list[int]:
        """Return the joined edges between both sides of an edge of one part."""
        start, end = self.layout.links.patches[edge].tolist()
        back: list[int] = []
        path: list[int] = []
        while start != end:
            if self.place[end] > self.place[start]:
                path.append(self.by[end])
                end = self.above[end]
            else:
                back.append(self.by[start])
                start = self.above[start]
        return path + back[::-1]


def exchanged(
    layout: Layout, around: list[list[tuple[int, int]]], edge: int, cut: int
) -> Layout | None:
    """Return a layout that is cut along one edge and joined along another; None if it overlaps."""
    links = layout.links
    new = layout.copy()
    new.joined[cut] = False
    joined, start = new.joined.tolist(), int(links.patches[edge, 1])
    own, order = {start}, [start]
    for here in order:
        for step, there in around[here]:
            if joined[step] and there not in own:
                own.add(there)
                order.append(there)
    if int(links.patches[edge, 0]) in own:
        return None
    new.part[order] = int(new.part.max()) + 1
    return new if new.join(edge) else None


def _shortened(layout: Layout, end: float) -> Layout:
    """Exchange long cuts for shorter ones, as far as nothing overlaps."""
    links = layout.links
    around = links.around()
    order = _longest(np.arange(len(links.weights)), links.weights)
    least = 1e-7 * float(links.weights.max(initial=0.0))
    weights, tree = links.weights.tolist(), None
    for _ in range(_PASSES):
        before = layout
        shortest = float(links.weights[layout.joined].min(initial=np.inf))
        for edge in order[links.weights[order] > shortest + least].tolist():
            a, b = layout.part[links.patches[edge]]
            if layout.joined[edge] or a != b:
                continue
            if layout.work[0] > end:
                return layout
            tree = _Tree.of(layout, tree)
            cut = min(tree.path(edge), key=weights.__getitem__)
            if links.weights[cut] < links.weights[edge] - least:
                layout = exchanged(layout, around, edge, cut) or layout
        if layout is before:
            break
    return layout


def _compacted(layout: Layout, end: float) -> Layout:
    """Exchange cuts for others as long, where that makes the rectangle about a part smaller."""
    links = layout.links
    around = links.around()
    size = [_rectangle(layout, part) for part in range(int(layout.part.max()) + 1)]
    kind = classes(links.weights)
    order = _longest(np.flatnonzero(np.bincount(kind)[kind] > 1), links.weights)
    tree = None
    for _ in range(_PASSES):
        before = layout
        for edge in order.tolist():
            a, b = layout.part[links.patches[edge]].tolist()
            if layout.joined[edge] or a != b:
                continue
            tree = _Tree.of(layout, tree)
            path = np.array(tree.path(edge), np.int64)
            for cut in path[kind[path] == kind[edge]].tolist():
                layout.work[0] += _BOXED
                if layout.work[0] > end:
                    return layout
                new = exchanged(layout, around, edge, cut)
                if new is None:
                    continue
                new.part[new.part == new.part[links.patches[edge, 0]]] = a
                smaller = _rectangle(new, a)
                if smaller < (1.0 - _SMALLER) * size[a]:
                    layout, size[a] = new, smaller
                    break
        if layout is before:
            break
    return layout


def _rectangle(layout: Layout, part: int) -> float:
    """Return the area of the smallest rectangle about a part; 0 for none."""
    z = layout.corners[layout.triangles(part)].ravel()
    return float(np.prod(rectangle(np.stack([z.real, z.imag], axis=1))[1])) if len(z) else 0.0

"""An order of the edges of patches that depends on the surface only, not on its numbering."""

from __future__ import annotations

from collections import deque

import numpy as np

from gso.typing import Array, Flags, Ints

#: Difference, relative to the largest value, below which lengths, areas and angles are equal.
_EQUAL = 1e-7
#: Number of rounds in which classes are divided by those around them.
_ROUNDS = 24


def classes(values: Array) -> Ints:
    """Number values in ascending order, equal ones alike, whatever the noise of rounding.

    >>> classes(np.array([2.0, 1.0, 2.0 + 1e-12, 5.0])).tolist()
    [1, 0, 1, 2]
    """
    order = np.argsort(values, kind="stable")
    step = np.diff(values[order]) > _EQUAL * float(np.abs(values).max(initial=0.0))
    out = np.empty(len(values), np.int64)
    out[order] = np.r_[0, np.cumsum(step)][: len(values)]
    return out


def canonical_order(triangles: Ints, twin: Ints, inner: Flags, kinds: list[Ints]) -> Ints:
    """Order the half-edges on the outlines of patches.

    The half-edges are divided into classes by their kind, and by those of their neighbours, until
    nothing changes: then equal ones lie, as a rule, symmetrically on the surface. From the first of
    the smallest class on, the others follow in the order in which a walk along outlines and across
    edges reaches them. So the order is the same for every numbering, but for symmetries.

    Parameters
    ----------
    triangles : ndarray of int, (t, 3)
    twin : ndarray of int, (3 t,)
        The opposite half-edge, or -1.
    inner : ndarray of bool, (3 t,)
        The half-edges inside patches.
    kinds : list of ndarray of int, (3 t,)
        Numbers that tell half-edges apart.

    Returns
    -------
    ndarray of int, (k,)
        The half-edges that are not inner ones.
    """
    own = np.flatnonzero(~inner)
    place = np.full(len(twin), -1)
    place[own] = np.arange(len(own))
    after = own - own % 3 + (own + 1) % 3
    while (within := inner[after]).any():
        across = twin[after[within]]
        after[within] = across - across % 3 + (across + 1) % 3
    following = place[after]
    before = np.empty_like(following)
    before[following] = np.arange(len(own))
    across = np.where(twin[own] >= 0, place[twin[own]], -1)
    colour = np.zeros(len(own), np.int64)
    for kind in kinds:
        colour = _pairs(colour, kind[own])
    count = 0
    for _ in range(_ROUNDS):
        if count == (count := int(colour.max(initial=-1)) + 1) or count == len(own):
            break
        other = np.where(across >= 0, colour[across], -1) + 1
        colour = _pairs(_pairs(colour, colour[following]), _pairs(colour[before], other))
    return own[_walked(np.argsort(colour, kind="stable"), following, across)]


def _pairs(one: Ints, other: Ints) -> Ints:
    """Number pairs of numbers in ascending order."""
    key = one * (int(other.max(initial=0)) + 1) + other
    return np.asarray(np.unique(key, return_inverse=True)[1].ravel(), np.int64)


def _walked(seeds: Ints, following: Ints, across: Ints) -> Ints:
    """Return the half-edges in the order of walks that begin at seeds not reached before."""
    ways = (following.tolist(), across.tolist())
    seen = [False] * len(seeds)
    out: list[int] = []
    for seed in seeds.tolist():
        if seen[seed]:
            continue
        seen[seed] = True
        queue = deque([seed])
        while queue:
            here = queue.popleft()
            out.append(here)
            for way in ways:
                there = way[here]
                if there >= 0 and not seen[there]:
                    seen[there] = True
                    queue.append(there)
    return np.array(out, np.int64)

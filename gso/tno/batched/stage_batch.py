"""One stage of many surfaces as arrays, which any process can make and another one solve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gso.energy.base import Residual, Vectors, Weighted
from gso.energy.losses import Loss
from gso.parametrization.orientation import Orientation
from gso.solver import Timings
from gso.solver.elements import kind
from gso.tasks.base import Stage
from gso.typing import Array, Ints
from gso.unknowns import Layout, Variables

#: Codes of the reasons to stop.
MAX_ITERATIONS, CONVERGED, STALLED = 0, 1, 2


class Unbatchable(Exception):
    """Surfaces cannot be solved together: their problems differ in structure."""


class TooLarge(Exception):
    """The device has too little memory for so many surfaces."""


@dataclass(frozen=True)
class TermBatch:
    """One weighted term of many surfaces, with equal stencils.

    Attributes
    ----------
    name : str
    residual, vectors, shape
        As in :class:`gso.energy.Term`; the shape is that of :func:`gso.solver.elements.kind`.
    quadratic : bool
    gather : ndarray of int, (k, e)
        Coordinates of each element.
    constants : ndarray, (B, c, e)
    factor : ndarray, (B, e)
        Weight of the term times those of its elements.
    losses : tuple of Loss
        Of each surface.
    """

    name: str
    residual: Residual
    vectors: Vectors | None
    shape: tuple[int, ...]
    quadratic: bool
    gather: Ints
    constants: Array
    factor: Array
    losses: tuple[Loss, ...]


@dataclass(frozen=True)
class StageBatch:
    """One stage of many surfaces with equal stencils.

    Attributes
    ----------
    key : bytes
        Stages of the same key can be solved together, with the unknowns that they have.
    terms : tuple of TermBatch
    coordinates, size : int
        Number of coordinates N and of unknowns n.
    of : ndarray of int, (N,), or None
        Unknown of each coordinate; None if the coordinates are the unknowns.
    share, offset : ndarray, (B, N), or None
        Coordinates are ``offset + share * x[of]``.
    start : ndarray, (B, n)
        Unknowns at the beginning.
    corners : tuple of ndarray of int, (3, t)
        First coordinates of the corners of triangles that must not be inverted.
    continuation : tuple of tuples of Loss
        By iteration, for each surface.
    continued, iterations, tolerance
        As in the stage.
    method : str
        Of the options.
    others : ndarray, (B, N), or None
        Coordinates whose energy is wanted, too.
    """

    key: bytes
    terms: tuple[TermBatch, ...]
    coordinates: int
    size: int
    of: Ints | None
    share: Array | None
    offset: Array | None
    start: Array
    corners: tuple[Ints, ...]
    continuation: tuple[tuple[Loss, ...], ...]
    continued: str
    iterations: int
    tolerance: float
    method: str
    others: Array | None

    def __len__(self) -> int:
        """Return the number of surfaces."""
        return len(self.start)


@dataclass(frozen=True)
class StageMinima:
    """The minima of a stage of many surfaces.

    Attributes
    ----------
    x, points : ndarray, (B, n) and (B, N)
        Best unknowns, and their coordinates.
    energy : ndarray, (B,)
    code, iterations : ndarray of int, (B,)
        Why each surface ended, one of the codes of this module, and after how many iterations.
    energies, steps : ndarray, (B, iterations + 1)
        After each iteration, the start included; NaN after the end.
    timings : Timings
        Seconds, in sum over the surfaces.
    by_term : tuple of dict of str to ndarray, (B,)
        The objective by term, without continuation, at the minima and at `others`.
    """

    x: Array
    points: Array
    energy: Array
    code: Ints
    iterations: Ints
    energies: Array
    steps: Array
    timings: Timings
    by_term: tuple[dict[str, Array], ...]


def gather(
    stages: Sequence[Stage],
    coordinates: Sequence[Array],
    method: str,
    key: bytes = b"",
    others: Sequence[Array] | None = None,
) -> StageBatch:
    """Gather one stage of each surface, from its coordinates at the beginning.

    Raises
    ------
    Unbatchable
        The surfaces cannot be solved together.
    """
    variables = [s.unknowns(c) for s, c in zip(stages, coordinates, strict=True)]
    own = zip(*([item for item in s.own_items if item.active] for s in stages), strict=True)
    first = stages[0]
    of, share, offset = _single(variables)
    corners = []
    for limit in first.limits:
        if not isinstance(limit, Orientation):
            raise Unbatchable
        corners.append(limit.start + 2 * limit.corners)
    return StageBatch(
        key,
        tuple(_term(items, first.layout) for items in own),
        first.layout.size,
        variables[0].size,
        of,
        share,
        offset,
        np.stack([v.project(c) for v, c in zip(variables, coordinates, strict=True)]),
        tuple(corners),
        tuple(zip(*(s.continuation for s in stages), strict=True)),
        first.continued,
        first.iterations,
        first.tolerance,
        method,
        None if others is None else np.stack(others),
    )


def _term(items: Sequence[Weighted], layout: Layout) -> TermBatch:
    """Gather a term of each surface."""
    term = items[0].term
    return TermBatch(
        term.name,
        term.residual,
        term.vectors,
        kind(term, layout)[1],
        items[0].quadratic,
        np.concatenate([layout.rows(block, index) for block, index in term.stencil]),
        np.stack([i.term.by_element for i in items]),
        np.stack([i.weight * i.term.weights for i in items]),
        tuple(i.loss for i in items),
    )


def _single(each: Sequence[Variables]) -> tuple[Ints | None, Array | None, Array | None]:
    """Return the unknown of each coordinate, and the shares and offsets of each surface."""
    first = each[0]
    if first.basis is None:
        return None, None, None
    shares = []
    for variables in each:
        if first.single is None or variables.single is None or variables.size != first.size:
            raise Unbatchable
        of, share = variables.single
        if not np.array_equal(of, first.single[0]):
            raise Unbatchable
        shares.append(share)
    if (of >= first.size).any():
        raise Unbatchable
    return of, np.stack(shares), np.stack([v.offset for v in each])

"""Terms of one component, built in its own unit ball, as terms of the whole mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from gso.energy.base import Residual, Term, Vectors
from gso.mesh import Frame
from gso.typing import Array, Ints, S, Vec

#: Number of constants of a component's frame: its centre, and one over its scale.
_FRAME = 4


def placed(term: Term, frame: Frame, vertices: Ints, faces: Ints, *, share: float) -> Term:
    """Convert a term of a component into a term of the whole mesh.

    Parameters
    ----------
    term : Term
        Built on the component in its own unit ball; without multipliers.
    frame : Frame
        Transform between that unit ball and the whole mesh's coordinates.
    vertices, faces : ndarray of int
        Indices of the component's vertices and faces in the whole mesh.
    share : float
        Factor on the weights: the component's share of the whole.
    """
    kinds = tuple(block for block, index in term.stencil for _ in range(index.shape[1]))
    own = np.append(frame.centre, 1.0 / frame.scale)[:, None]
    own = np.repeat(own, term.count, axis=1)
    numbers = {"surface": vertices, "flat": vertices, "scale": faces}
    stencil = tuple((block, numbers[block][index]) for block, index in term.stencil)
    refresh = None
    if term.refresh is not None:
        renew = term.refresh

        def refresh(blocks: Mapping[str, Array]) -> Array:
            mine = {block: points[numbers[block]] for block, points in blocks.items()}
            if "surface" in mine:
                mine["surface"] = frame.to_unit(mine["surface"])
            if "flat" in mine:
                mine["flat"] = mine["flat"] / frame.scale
            return np.concatenate([own, renew(mine)])

    constants = term.by_element
    return replace(
        term,
        residual=_residual(term.residual, kinds),
        vectors=None if term.vectors is None else _vectors(term.vectors, kinds),
        stencil=stencil,
        weights=share * term.weights,
        constants=np.concatenate([own, constants]),
        refresh=refresh,
    )


@lru_cache(maxsize=256)
def _residual(residual: Residual, kinds: tuple[str, ...]) -> Residual:
    """Wrap a residual so that it takes points in the coordinates of the whole mesh."""

    def within(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
        return residual(_own(points, constants, kinds), constants[_FRAME:])

    return within


@lru_cache(maxsize=256)
def _vectors(vectors: Vectors, kinds: tuple[str, ...]) -> Vectors:
    """Wrap the vectors of a residual as :func:`_residual`."""

    def within(points: Sequence[Vec[S]], constants: Sequence[S]) -> tuple[Vec[S], ...]:
        return vectors(_own(points, constants, kinds), constants[_FRAME:])

    return within


def _own(points: Sequence[Vec[S]], constants: Sequence[S], kinds: tuple[str, ...]) -> list[Vec[S]]:
    """Convert points of the whole mesh to the component's unit ball."""
    centre, factor = constants[: _FRAME - 1], constants[_FRAME - 1]
    own = []
    for kind, point in zip(kinds, points, strict=True):
        if kind == "surface":
            own.append(tuple((x - c) * factor for x, c in zip(point, centre, strict=True)))
        else:
            own.append(tuple(x * factor for x in point) if kind == "flat" else point)
    return own

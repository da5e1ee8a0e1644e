"""Regulariser of isometric maps: equal tangential second differences on both meshes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso import geometry
from gso.energy.base import Term
from gso.mesh import Mesh, topology
from gso.typing import Array, Ints, S, Vec

#: Rigid motions change no inner product.
INVARIANT = ("translation", "rotation")

#: Lower bound of the chords that are divided by, relative to the mean chord, so that small cells
#: do not get larger weights.
_SHORTEST = 1.0


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return differences of d.(c - a), d.(p - b) and d.(q - b) of a mesh and its counterpart.

    Here d is the second difference of the points a, b, c of a polyline, and p, q are the
    neighbours of b across it. These inner products of second differences with edges are
    discrete Christoffel symbols of the first kind; on isometric surfaces they agree up to
    higher-order terms (the regulariser of Jiang et al. 2020). They couple the two checkerboard
    sub-lattices, which the faces' diagonals leave uncoupled.

    Points: a, b, c, p, q; then those of the counterpart, unless it is constant. Constants: a
    factor along and one across; then the counterpart's products, if constant.
    """
    along, across = constants[:2]
    here = _products(*points[:5])
    there = constants[2:] if len(constants) == 5 else _products(*points[5:])
    factors = (along, across, across)
    return tuple(s * (x - y) for s, x, y in zip(factors, here, there, strict=True))


def _products(a: Vec[S], b: Vec[S], c: Vec[S], p: Vec[S], q: Vec[S]) -> Vec[S]:
    d = geometry.second_difference(a, b, c)
    edges = (geometry.sub(c, a), geometry.sub(p, b), geometry.sub(q, b))
    return tuple(geometry.dot(d, e) for e in edges)


def build(mesh: Mesh, block: str, *, counterpart: str | None = None) -> list[Term]:
    """Build the regulariser on the polylines of a mesh; an empty list for meshes with triangles.

    Parameters
    ----------
    mesh : Mesh
        Connectivity and spacing. Its vertices are the counterpart when no block is named.
    block : str
        Block of the polylines.
    counterpart : str, optional
        Block of the polylines to compare with.

    Residuals are 1/length in the mesh's unit; the energy sums both directions of the polylines.
    """
    if mesh.has_triangles:
        return []
    v = mesh.vertices
    stencil = topology.polyline_crosses(mesh.half_edges, mesh.faces)
    if not len(stencil):
        return []
    a, b, c, p, q = (v[stencil[:, k]] for k in range(5))
    spacing = 0.5 * (_lengths(b - a) + _lengths(c - b))
    chords = 0.5 * np.stack([_lengths(c - a), _lengths(p - q)])
    constants = spacing**-2 / chords
    blocks: tuple[tuple[str, Ints], ...] = ((block, stencil),)
    if counterpart is not None:
        blocks += ((counterpart, stencil),)
    else:
        corners = [tuple(v[stencil[:, k]].T) for k in range(5)]
        constants = np.concatenate([constants, np.stack(_products(*corners))])
    return [
        Term(
            "mapping",
            residual,
            blocks,
            weights=np.full(len(stencil), 2.0 / len(stencil)),
            constants=constants,
        )
    ]


def _lengths(chords: Array) -> Array:
    """Measure chords (t, 3), bounded below by :data:`_SHORTEST` times their mean length."""
    length: Array = np.linalg.norm(chords, axis=1)
    return length.clip(_SHORTEST * length.mean())

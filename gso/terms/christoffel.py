"""Regulariser of isometric maps: second differences look alike on both meshes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gso import geometry, topology
from gso.mesh import Mesh
from gso.terms.base import Array, Term

#: Turning or moving a mesh changes no inner product.
INVARIANT = ("translation", "rotation")

#: Shortest chord, as a share of the mean one, that is divided by: small cells count no more.
_SHORTEST = 1.0


def residual(points: Sequence[tuple[Any, ...]], constants: Sequence[Any]) -> tuple[Any, ...]:
    """Differences of d.(c - a), d.(p - b) and d.(q - b) between a mesh and its counterpart.

    With d the second difference of the points a, b, c of a polyline, and p, q the neighbours
    of b across it: the inner products of second differences with edges, which isometric
    surfaces share but for higher orders (the regulariser of Jiang et al. 2020). They are
    Christoffel symbols of the first kind, and tie the two checkerboard lattices together that
    the faces' diagonals leave loose.

    Points: a, b, c, p, q; then those of the counterpart, unless it is constant. Constants: a
    factor along and one across; then the counterpart's products, if constant.
    """
    along, across = constants[:2]
    here = _products(*points[:5])
    there = constants[2:] if len(constants) == 5 else _products(*points[5:])
    factors = (along, across, across)
    return tuple(s * (x - y) for s, x, y in zip(factors, here, there, strict=True))


def _products(a: Any, b: Any, c: Any, p: Any, q: Any) -> tuple[Any, Any, Any]:
    d = geometry.second_difference(a, b, c)
    edges = (geometry.sub(c, a), geometry.sub(p, b), geometry.sub(q, b))
    return tuple(geometry.dot(d, e) for e in edges)


def build(mesh: Mesh, block: str, *, counterpart: str | None = None) -> list[Term]:
    """The regulariser on the polylines of a mesh; none on meshes with triangles.

    Parameters
    ----------
    mesh : Mesh
        Its vertices are the counterpart when none is named, and give the spacing.
    block : str
        Whose polylines are compared.
    counterpart : str, optional
        Block with the other polylines.

    Residuals are one over the mesh's unit of length; both directions of the polylines add up.
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
    blocks: tuple[Any, ...] = ((block, stencil),)
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
    """Lengths (t,) of chords (t, 3), at least the mean one."""
    length = np.linalg.norm(chords, axis=1)
    return np.maximum(length, _SHORTEST * length.mean())


def examples(mesh: Mesh) -> list[Term]:
    """Terms for the conformance tests."""
    return [*build(mesh, "surface", counterpart="flat"), *build(mesh, "flat")]

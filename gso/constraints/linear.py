"""Elimination of the hard linear constraints: constrained vertices as functions of free ones.

Glue and symmetry make a vertex the image of another under a rigid motion or reflection; pins
and planes restrict its position. The images form a spanning forest, in which every vertex is
the image of a root. All constraints then become equations on the roots alone, with at most
three unknowns each, whatever the size of the mesh and the length of the chains.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gso.constraints.equations import OnPlane, Part, Pins, Relations
from gso.mesh.topology import edge_graph, edge_keys, label_components
from gso.typing import Array, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


#: Squared singular value of the equations of a root below which a direction is free.
_FREE = 1e-8


class _Equations(NamedTuple):
    """Rows ``a . p[root] = b``, with the constraint and the vertex that they come from."""

    root: Ints
    a: Array
    b: Array
    owner: Ints
    vertex: Ints


@dataclass(frozen=True)
class Reduction:
    """Constrained vertices as affine functions of free ones.

    ``p[ids] = shift + turn p[root]``, and ``p[root] = point + axes y`` with y free.

    Attributes
    ----------
    ids, root : ndarray of int, (k,)
        Constrained vertices, and for each the place of its root in `ids`.
    turn, shift : ndarray, (k, d, d) and (k, d)
        The motion that maps the root to the vertex.
    point : ndarray, (k, d)
        Position of a root for y = 0.
    axes : ndarray, (k, d, d)
        Free directions of a root as orthonormal columns, the others zero.
    equations : _Equations
        Equations on the roots.
    """

    ids: Ints
    root: Ints
    turn: Array
    shift: Array
    point: Array
    axes: Array
    equations: _Equations

    def residuals(self) -> Array:
        """Return the residual of each equation: zero up to rounding, unless some contradict."""
        e = self.equations
        return np.asarray(np.abs((e.a * self.point[e.root]).sum(axis=1) - e.b))

    def maps(self, start: int, size: int) -> tuple[csr_matrix, csr_matrix, Array]:
        """Return the constraints as affine maps of a coordinate vector.

        Parameters
        ----------
        start, size : int
            Index of the vertices' first coordinate, and total number of coordinates.

        Returns
        -------
        projection : csr_matrix, (size, size)
            ``projection @ x + offset`` satisfies the constraints, for any coordinates x.
        basis : csr_matrix, (size, size)
            ``basis @ y + offset`` does for any y; only non-zero columns are unknowns.
        offset : ndarray, (size,)
        """
        axes = self.axes[self.root]
        along = self.turn @ axes
        point = self.shift + np.einsum("kab,kb->ka", self.turn, self.point[self.root])
        offset = np.zeros(size)
        offset[start + self._rows(self.ids)] = point
        projection = self._matrix(along @ axes.transpose(0, 2, 1), start, size)
        return projection, self._matrix(along, start, size), offset

    def _rows(self, ids: Ints) -> Ints:
        dim = self.turn.shape[1]
        return np.asarray(ids[:, None] * dim + np.arange(dim))

    def _matrix(self, blocks: Array, start: int, size: int) -> csr_matrix:
        """Return the identity with the rows of `ids` replaced by blocks on their roots."""
        from scipy.sparse import coo_matrix

        here, there = start + self._rows(self.ids), start + self._rows(self.ids[self.root])
        rows = np.broadcast_to(here[:, :, None], blocks.shape)
        columns = np.broadcast_to(there[:, None, :], blocks.shape)
        keep = np.abs(blocks) > 0
        others = np.ones(size, bool)
        others[here] = False
        (same,) = np.nonzero(others)
        return coo_matrix(
            (
                np.r_[blocks[keep], np.ones(len(same))],
                (np.r_[rows[keep], same], np.r_[columns[keep], same]),
            ),
            shape=(size, size),
        ).tocsr()


def reduce(parts: Sequence[Part]) -> Reduction | None:
    """Eliminate the hard linear parts; return None when there are none.

    Contradicting equations are solved in the least-squares sense.
    """
    linear = [q for p in parts for q in p.linear]
    relations = [p for p in linear if isinstance(p, Relations) and len(p.first)]
    places = [p for p in linear if isinstance(p, Pins | OnPlane) and len(p.ids)]
    if not relations and not places:
        return None
    every = [p.ids for p in places] + [x for p in relations for x in (p.first, p.second)]
    ids = np.unique(np.concatenate(every))
    dim = _dim((*places, *relations)[0])
    joints = _joints(relations, ids, dim)
    root, turn, shift = _follow(len(ids), joints, dim)
    equations = _equations(places, ids, joints, (root, turn, shift), dim)
    point, axes = _solve(equations, len(ids), dim)
    return Reduction(ids, root, turn, shift, point, axes, equations)


def _dim(part: Part) -> int:
    """Return the number of components of a position."""
    return part.positions.shape[1] if isinstance(part, Pins) else len(part.anchor)  # type: ignore[attr-defined]


class _Joints(NamedTuple):
    """Relations ``p[second] = shift + turn p[first]``; vertices by their place in `ids`."""

    first: Ints
    second: Ints
    turn: Array
    shift: Array
    owner: Ints


def _joints(relations: list[Relations], ids: Ints, dim: int) -> _Joints:
    if not relations:
        none = np.zeros(0, np.int64)
        return _Joints(none, none, np.zeros((0, dim, dim)), np.zeros((0, dim)), none)
    count = [len(p.first) for p in relations]
    return _Joints(
        np.searchsorted(ids, np.concatenate([p.first for p in relations])),
        np.searchsorted(ids, np.concatenate([p.second for p in relations])),
        np.repeat([p.matrix for p in relations], count, axis=0),
        np.repeat([p.anchor - p.matrix @ p.anchor for p in relations], count, axis=0),
        np.repeat([p.owner for p in relations], count),
    )


def _follow(count: int, joints: _Joints, dim: int) -> tuple[Ints, Array, Array]:
    """Return the root of every vertex, and the motion that maps the root to the vertex."""
    parent = np.arange(count)
    turn = np.broadcast_to(np.eye(dim), (count, dim, dim)).copy()
    shift = np.zeros((count, dim))
    if not len(joints.first):
        return parent, turn, shift
    child, above, which = _forest(count, joints)
    forward = joints.second[which] == child
    there = joints.turn[which]
    back = there.transpose(0, 2, 1)
    parent[child] = above
    turn[child] = np.where(forward[:, None, None], there, back)
    away = np.einsum("kab,kb->ka", back, joints.shift[which])
    shift[child] = np.where(forward[:, None], joints.shift[which], -away)
    # Pointer jumping: every pass doubles the number of tree edges that a motion spans.
    while (parent != parent[parent]).any():
        shift = shift + np.einsum("kab,kb->ka", turn, shift[parent])
        turn = turn @ turn[parent]
        parent = parent[parent]
    return parent, turn, shift


def _forest(count: int, joints: _Joints) -> tuple[Ints, Ints, Ints]:
    """Return the children, parents and joints of a spanning forest."""
    from scipy.sparse.csgraph import breadth_first_order

    a, b = joints.first, joints.second
    roots = np.unique(label_components(count, a, b), return_index=True)[1]
    # An extra vertex, linked to one vertex of every component, makes the forest a tree.
    tied = edge_graph(count + 1, np.r_[a, np.full(len(roots), count)], np.r_[b, roots])
    order, before = breadth_first_order(tied, count, directed=False)
    child = order[1:][before[order[1:]] != count].astype(np.int64)
    above = before[child].astype(np.int64)
    key, at = np.unique(edge_keys(a, b, count), return_index=True)
    return child, above, at[np.searchsorted(key, edge_keys(child, above, count))]


def _equations(
    places: list[Pins | OnPlane],
    ids: Ints,
    joints: _Joints,
    motion: tuple[Ints, Array, Array],
    dim: int,
) -> _Equations:
    """Express every constraint as equations on the roots."""
    root, turn, shift = motion
    rows = []
    for p in places:
        at = np.searchsorted(ids, p.ids)
        if isinstance(p, Pins):
            a = turn[at].reshape(-1, dim)
            b = (p.positions - shift[at]).ravel()
            at = np.repeat(at, dim)
        else:
            a = np.einsum("a,kab->kb", p.normal, turn[at])
            b = p.normal @ p.anchor - shift[at] @ p.normal
        rows.append(_Equations(root[at], a, b, np.full(len(b), p.owner), ids[at]))
    first, second = joints.first, joints.second
    loop = turn[second] - joints.turn @ turn[first]
    left = np.einsum("kab,kb->ka", joints.turn, shift[first]) + joints.shift - shift[second]
    rows.append(
        _Equations(
            np.repeat(root[second], dim),
            loop.reshape(-1, dim),
            left.ravel(),
            np.repeat(joints.owner, dim),
            np.repeat(ids[second], dim),
        )
    )
    return _Equations(*(np.concatenate(column) for column in zip(*rows, strict=True)))


def _solve(equations: _Equations, count: int, dim: int) -> tuple[Array, Array]:
    """Return the least-squares position and the free axes of every root."""
    normal = np.zeros((count, dim, dim))
    right = np.zeros((count, dim))
    np.add.at(normal, equations.root, equations.a[:, :, None] * equations.a[:, None, :])
    np.add.at(right, equations.root, equations.a * equations.b[:, None])
    value, axes = np.linalg.eigh(normal)
    free = value < _FREE
    inverse = np.where(free, 0.0, 1.0 / np.where(free, 1.0, value))
    point = np.einsum("kab,kb,kcb,kc->ka", axes, inverse, axes, right)
    return point, np.where(free[:, None, :], axes, 0.0)

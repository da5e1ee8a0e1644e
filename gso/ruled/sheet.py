"""The pattern of trimmed strips: their faces in the plane, cut along creases."""

from __future__ import annotations

import numpy as np

from gso.mesh import Mesh
from gso.parametrization import beside, upright
from gso.pattern import Pattern
from gso.ruled.copies import copies
from gso.ruled.unroll import Unrolled
from gso.typing import Ints


def unrolled_pattern(mesh: Mesh, owner: Ints, part: Ints, unrolled: Unrolled) -> Pattern:
    """Return the pattern of a mesh whose faces have `owner` in the untrimmed strips."""
    vertex, table = copies(mesh.faces, part)
    face = np.empty(len(vertex), np.int64)
    rows, corner = np.nonzero(table >= 0)
    face[table[rows, corner]] = rows
    flat = unrolled.flat(owner[face], mesh.vertices[vertex])
    label = part[face]
    pieces = [upright(flat[label == k])[:, ::-1] * [1.0, -1.0] for k in range(int(part.max()) + 1)]
    for k, piece in enumerate(beside(pieces)):
        flat[label == k] = piece
    return Pattern(flat, table, vertex, seam_pairs(mesh, table))


def seam_pairs(mesh: Mesh, table: Ints) -> Ints:
    """Return the pairs of pattern edges that are one edge of the surface."""
    he = mesh.half_edges
    k = np.flatnonzero((he.twin >= 0) & (he.origin < he.dest))
    ends = []
    for half in (k, he.twin[k]):
        rows, own = mesh.faces[he.face[half]], table[he.face[half]]
        ends.append(
            [
                np.take_along_axis(own, (rows == v[:, None]).argmax(axis=1)[:, None], 1)[:, 0]
                for v in (he.origin[k], he.dest[k])
            ]
        )
    both = np.stack([np.stack(e, axis=1) for e in ends], axis=1)
    pairs: Ints = both[(both[:, 0] != both[:, 1]).any(axis=1)]
    return pairs

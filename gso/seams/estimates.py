"""Estimated strains of sets of faces, each computed once."""

from __future__ import annotations

import numpy as np

from gso.mesh import Mesh
from gso.mesh.topology import edge_keys
from gso.seams.potential import Potential
from gso.typing import Flags, Ints


class Estimates:
    """Estimates the strain of sets of faces, and remembers what it found.

    Searches with other bounds and from other patches ask for many of the same sets again.

    Parameters
    ----------
    mesh : Mesh
    potential : Potential
        Of the mesh.
    fixed : ndarray of bool, (n,)
        Vertices on the boundary, and on edges that are cut in any case.
    """

    def __init__(self, mesh: Mesh, potential: Potential, fixed: Flags):
        self._faces, self._potential, self._fixed = mesh.faces, potential, fixed
        self._known: dict[tuple[int, int], float | None] = {}
        # The exclusive or of random numbers of 128 bits is the key of a set, in any order.
        numbers = np.random.default_rng(0).integers(0, 2**63, (2, len(mesh.faces)))
        self._numbers = numbers.astype(np.int64)

    def __call__(self, faces: Ints) -> float | None:
        """Estimate the strain of some faces together; None where they are no disk."""
        first, second = np.bitwise_xor.reduce(self._numbers[:, faces], axis=1).tolist()
        if (first, second) not in self._known:
            self._known[first, second] = self._estimated(faces)
        return self._known[first, second]

    def _estimated(self, faces: Ints) -> float | None:
        corners = self._faces[faces]
        ids, local = np.unique(corners, return_inverse=True)
        own = corners.reshape(-1)
        local = local.reshape(corners.shape)
        if corners.shape[1] == 4 and (own < 0).any():
            local = np.where(corners < 0, -1, local - 1)
            ids = ids[1:]
        rim, disk = _rim(local, len(ids))
        if not disk:
            return None
        inner = ids[~rim & ~self._fixed[ids]]
        if not inner.size:
            return 0.0
        fixed = np.ones(len(self._fixed), bool)
        fixed[inner] = False
        return self._potential.strain(self._potential.solve(fixed, inner), ids)


def _rim(faces: Ints, count: int) -> tuple[Flags, bool]:
    """Mark the vertices on the boundary of faces (m, 3 or 4), and tell whether they are a disk."""
    size = (faces >= 0).sum(axis=1)
    place = np.arange(faces.shape[1])
    after = np.where(place + 1 < size[:, None], np.roll(faces, -1, axis=1), faces[:, :1])
    real = faces >= 0
    a, b = faces[real], after[real]
    edges, often = np.unique(edge_keys(a, b, count), return_counts=True)
    rim_edges = edges[often == 1]
    rim = np.zeros(count, bool)
    rim[rim_edges // count] = True
    rim[rim_edges % count] = True
    # A boundary vertex with more than two boundary edges is a pinch.
    touched = np.bincount(np.r_[rim_edges // count, rim_edges % count], minlength=count)
    plain = bool((touched <= 2).all())
    return rim, plain and count - len(edges) + len(faces) == 1 and rim_edges.size > 0

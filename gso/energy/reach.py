"""Distance from a reference surface over how far each vertex may be away.

Before every linearisation a vertex gets the closest point of the surface and the tangent plane
there (iterated closest points, as in :func:`gso.energy.proximity.closest`), as long as that is near
the vertex's own point of reference. Held vertices keep theirs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gso.energy import proximity
from gso.energy.base import Term
from gso.mesh import Mesh, Nearest
from gso.typing import Array, Flags, S, Vec

#: How far a closest point may be from the vertex's own point of reference, over its limit, and the
#: least cosine between normals; otherwise it may be on another part of the surface.
_SLIDE, _ALIKE = 1.5, 0.5
#: Factor on the tangential part of the displacement of those.
_BACK = 0.3
#: The reference does not move with the surface.
INVARIANT = ()


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return the displacement of :mod:`gso.energy.proximity` over the last constant."""
    moved = proximity.residual(points, constants[:7])
    return tuple(x / constants[7] for x in moved)


def build(mesh: Mesh, normals: Array, limits: Array, held: Flags) -> Term:
    """Build the distance of every vertex from a surface, over its limit.

    Weights are times the squared limit, so that the energy is of the distance itself.

    Parameters
    ----------
    mesh : Mesh
        Reference surface.
    normals : ndarray, (n, 3)
        Unit normals at its vertices.
    limits : ndarray, (n,)
        How far each may be away, above 0.
    held : ndarray of bool, (n,)
        Vertices for which the whole displacement counts.
    """
    near = Nearest(mesh, normals)
    own = proximity.build(mesh, normals, tangential=held.astype(float))
    constants = np.concatenate([own.constants, limits[None]])

    def refresh(blocks: Mapping[str, Array]) -> Array:
        feet = near.feet(blocks["surface"])
        slid: Flags = np.linalg.norm(feet.points - mesh.vertices, axis=1) <= _SLIDE * limits
        slid &= np.einsum("nd,nd->n", feet.normals, normals) > _ALIKE
        slid &= ~held
        out: Array = constants.copy()
        # Whatever slid farther is drawn back.
        out[6, ~slid & ~held] = _BACK
        out[:3, slid], out[3:6, slid] = feet.points[slid].T, feet.normals[slid].T
        return out

    return replace(
        own,
        name="reach",
        residual=residual,
        weights=own.weights * limits**2,
        constants=constants,
        linear=False,
        refresh=refresh,
    )

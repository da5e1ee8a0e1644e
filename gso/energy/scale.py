"""Deviation of the faces' scale factors from one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.energy.base import Term, mean_weights
from gso.mesh import Mesh
from gso.typing import S, Vec

#: Scale factors are not coordinates, so rigid motions do not apply to them.
INVARIANT = ()


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return ``s - 1``, which selects one of the conformal maps (Jiang et al. 2020)."""
    return (points[0][0] - 1.0,)


def build(mesh: Mesh) -> Term:
    """Build the deviation of the block "scale", one number per face, averaged over the faces."""
    count = len(mesh.faces)
    return Term(
        "scale", residual, (("scale", np.arange(count)[:, None]),), mean_weights(count), linear=True
    )

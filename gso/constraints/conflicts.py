"""Detection of hard linear constraints that contradict each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.constraints.equations import Part
from gso.constraints.linear import reduce
from gso.errors import OptionError
from gso.mesh import Mesh
from gso.typing import Ints

#: Residuals below these shares of the mesh diagonal, or of the largest coordinate, are rounding.
_ROUNDING = 1e-9
_DIGITS = 1e-13


def check(parts: Sequence[Part], names: Sequence[str], mesh: Mesh) -> None:
    """Refuse parts that contradict each other.

    Raises
    ------
    OptionError
        Parts contradict each other; the message names a minimal set of constraints and a vertex.
    """
    reach = float(np.abs(mesh.vertices[mesh.used]).max())
    tolerance = max(_ROUNDING * mesh.diagonal, _DIGITS * reach)
    found = _worst(parts, tolerance)
    if found is None:
        return
    parts = _within(parts, found[2])
    for owner in sorted({p.owner for p in parts}):
        fewer = [p for p in parts if p.owner != owner]
        if _worst(fewer, tolerance) is not None:
            parts = fewer
    miss, vertex, _ = _worst(parts, tolerance) or found
    culprits = [names[k] for k in sorted({p.owner for p in parts})]
    if len(culprits) == 1:
        raise OptionError(f"{culprits[0]} contradicts itself at vertex {vertex} (by {miss:.3g})")
    raise OptionError(
        f"{', '.join(culprits[:-1])} and {culprits[-1]} contradict each other at vertex {vertex} "
        f"(by {miss:.3g}); remove one, or give it a weight where it takes one"
    )


def _worst(parts: Sequence[Part], tolerance: float) -> tuple[float, int, Ints] | None:
    """Find the most violated equation: residual, vertex, and all vertices coupled to that one."""
    reduction = reduce(parts)
    if reduction is None:
        return None
    missed = reduction.residuals()
    at = int(missed.argmax())
    if missed[at] <= tolerance:
        return None
    equations = reduction.equations
    tied = reduction.ids[reduction.root == equations.root[at]]
    return float(missed[at]), int(equations.vertex[at]), tied


def _within(parts: Sequence[Part], ids: Ints) -> list[Part]:
    """Return the linear parts on some vertices."""
    linear = (q for p in parts for q in p.linear)
    out = [p.kept(np.isin(p.vertices[:, 0], ids)) for p in linear]
    return [p for p in out if p.count]

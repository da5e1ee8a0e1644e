"""Results of strips that were made without a solve for another shape."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from gso.mesh import Mesh
from gso.result import StripsResult
from gso.ruled.paneling.options import RULED
from gso.ruled.ruled_surface import RuledSurface
from gso.status import Status


def made_strips(
    design: Mesh,
    surface: RuledSurface,
    status: Status,
    source: str,
    *,
    begun: float,
    mean: float = 0.0,
    notes: Sequence[str] = (),
    **details: Any,
) -> StripsResult:
    """Return a surface near a design as a result, without a verdict.

    Parameters
    ----------
    design : Mesh
    surface : RuledSurface
    status : Status
    source : str
        What its rulings are from, for the details.
    begun : float
        Time at which it was begun, of :func:`time.perf_counter`.
    mean : float
        Mean distance from the design, in any unit.
    notes : sequence of str
        More than those of the design.
    **details
        More than the number of strips and the source of their rulings.
    """
    return StripsResult(
        task="developable",
        formulation=RULED,
        design=design,
        status=status,
        energy={"distance": mean},
        seconds={"strips": time.perf_counter() - begun},
        notes=(*design.notes, *notes),
        details={"strips": surface.strips, "rulings_from": source} | details,
        **StripsResult.attributes(surface),
    )

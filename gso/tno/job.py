"""What one solve is for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gso.constraints import Compiled
from gso.mesh import Mesh
from gso.tno.start import Start


@dataclass(frozen=True)
class Job:
    """What is solved for by itself: a mesh or the part of one that nothing ties to the rest.

    Attributes
    ----------
    design : Mesh
        The input.
    constraints : Compiled
        What its vertices must keep, in the user's frame.
    start : Start
        Where to start.
    names : ndarray of int, (n,), optional
        What messages call its vertices, where it is a part.
    """

    design: Mesh
    constraints: Compiled
    start: Start
    names: NDArray[np.int64] | None = None

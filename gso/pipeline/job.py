"""The input of one solve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gso.constraints import Compiled
from gso.mesh import Mesh
from gso.pipeline.start import Start


@dataclass(frozen=True)
class Job:
    """Input of one solve: a mesh, or a part of one that no constraint joins to the rest.

    Attributes
    ----------
    design : Mesh
        The input.
    constraints : Compiled
        Constraints on its vertices, in the user's frame.
    start : Start
        The warm start, if any.
    names : ndarray of int, (n,), optional
        Vertex indices for messages, where the design is a part of the user's mesh.
    """

    design: Mesh
    constraints: Compiled
    start: Start
    names: NDArray[np.int64] | None = None

"""The strain that is left in a surface: that of its flat pattern."""

from __future__ import annotations

from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from gso import metrics, tasks
from gso.constraints import compile_constraints
from gso.mesh import Mesh
from gso.tasks.base import Request
from gso.tno.run import Run

Array = NDArray[np.float64]


def lay_out(mesh: Mesh, points: Array) -> tuple[Mesh, Array]:
    """A surface on the faces of a mesh in the unit ball, and its flat pattern (n, 2).

    Raises
    ------
    MeshError
        A component is closed or has handles.
    """
    module: ModuleType = tasks.get("flatten")
    surface = mesh.replaced(points)
    none = compile_constraints((), surface, flat=True)
    request = Request(surface, module.Options.preset("fast"), "strain", none)
    return surface, Run(module, None)(request).points


def largest_strain(mesh: Mesh, points: Array) -> float:
    """Largest principal strain of the flat pattern of a surface (n, 3).

    Raises
    ------
    MeshError
        A component is closed or has handles.
    """
    return float(metrics.principal_strains(*lay_out(mesh, points)).values.max())

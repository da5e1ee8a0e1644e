"""The pattern of a surface: how much it must be strained to lie in the plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gso import metrics
from gso.constraints import Compiled
from gso.mesh import Mesh
from gso.status import MeshError
from gso.tasks.base import Request
from gso.tno.canonical import Canonical
from gso.tno.run import Run

Array = NDArray[np.float64]

#: Mean strain of a surface with several boundary loops above which it is a tube, laid out uncut.
_CLOSES = 0.1


def lay_out(surface: Mesh, given: Array | None = None, *, options: str = "fast") -> Array | None:
    """Plane image (n, 2) of a surface with little strain, by the flatten task's ``strain``.

    Parameters
    ----------
    surface : Mesh
        In any frame.
    given : ndarray, (n, 2), optional
        An image of it that is there already: the better one by the largest strain is returned.
    options : str
        Preset of the flatten task.

    Returns
    -------
    ndarray, (n, 2), or None
        In the unit of the surface, components side by side; None where a component is closed,
        has handles, or is a tube, and would have to be cut open first.

    Examples
    --------
    >>> t = np.linspace(0, 3, 20)
    >>> arch = np.stack(np.broadcast_arrays(np.cos(t), np.sin(t), t[:, None]), axis=-1)
    >>> mesh = Mesh.from_grid(arch)
    >>> metrics.strains(mesh, lay_out(mesh))["strain_max"] < 1e-3
    True
    """
    # Scipy comes with it.
    from gso.tasks import flatten

    if not _opens(surface):
        return given
    frame = Canonical(surface)
    request = Request(frame.mesh, flatten.Options.preset(options), "strain", Compiled(flat=True))
    try:
        outcome = Run(flatten, None)(request)
    except MeshError:
        return given
    flat = frame.back("flat", outcome.points) * frame.frame.scale
    found = metrics.principal_strains(surface, flat)
    if len(surface.boundary_loops) > _parts(surface) and found.mean > _CLOSES:
        return given
    if given is not None and largest_strain(surface, given) <= found.values.max():
        return given
    return flat


def largest_strain(surface: Mesh, flat: Array) -> float:
    """Largest principal strain max |s - 1| of an image (n, 2)."""
    return float(metrics.principal_strains(surface, flat).values.max())


def _parts(surface: Mesh) -> int:
    return np.unique(surface.components[surface.used]).size


def _opens(surface: Mesh) -> bool:
    """Whether every component has a boundary and no handle."""
    # A disk with h holes has Euler characteristic 1 - h and 1 + h loops.
    count, label = _parts(surface), surface.components
    rims = {int(label[loop[0]]) for loop in surface.boundary_loops}
    loops = len(surface.boundary_loops)
    return len(rims) == count and surface.euler_characteristic == 2 * count - loops

"""The flat pattern of a surface, and the strain that flattening takes."""

from __future__ import annotations

from gso import metrics, parametrization
from gso.constraints import Compiled
from gso.errors import MeshError
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.tasks.base import Analysis, Request
from gso.tasks.evaluation import largest_strain
from gso.tno.normalise import Canonical
from gso.tno.run import Run


def lay_out(
    surface: Mesh,
    given: Pattern | None = None,
    *,
    options: str = "fast",
    formulation: str = "strain",
) -> Pattern | None:
    """Flatten a surface with little strain, by the flatten task.

    A surface that closes around itself is cut open.

    Parameters
    ----------
    surface : Mesh
        In any frame.
    given : Pattern, optional
        An existing pattern of the surface; the one with the smaller maximal strain is returned.
    options : str
        Preset of the flatten task.
    formulation : str
        Formulation of the flatten task.

    Returns
    -------
    Pattern or None
        In the unit of the surface, components side by side. Where the surface cannot be
        flattened, `given` or None: components that are closed or have handles would have to
        be cut open first.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.linspace(0, 3, 20)
    >>> arch = np.stack(np.broadcast_arrays(np.cos(t), np.sin(t), t[:, None]), axis=-1)
    >>> mesh = Mesh.from_grid(arch)
    >>> largest_strain(mesh, lay_out(mesh)) < 1e-3
    True
    """
    # Imported here because it imports SciPy.
    from gso.tasks import flatten

    if not parametrization.flattens(surface):
        return given
    frame = Canonical(surface)
    analysis = Analysis(frame.mesh, Compiled(flat=True))
    try:
        outcome = Run(flatten, analysis)(Request(flatten.Options.preset(options), formulation))
    except MeshError:
        return given
    flat = outcome.points * frame.frame.scale
    if outcome.cut is None:
        found = Pattern.whole(surface, frame.back("flat", flat))
    elif surface.grid_index is None:
        found = Pattern(flat, outcome.cut.mesh.faces, outcome.cut.vertex, outcome.cut.seams)
    else:
        return given
    if given is not None and largest_strain(surface, given) <= largest_strain(surface, found):
        return given
    return found


def strains_of(surface: Mesh) -> dict[str, float]:
    """Return mean, 99th percentile and largest strain of a surface's pattern; empty without."""
    pattern = lay_out(surface)
    return {} if pattern is None else metrics.strains(pattern.surface(surface), pattern.flat)

"""The flat pattern of a surface, and the strain that flattening takes."""

from __future__ import annotations

import numpy as np

from gso import components, metrics, parametrization
from gso.constraints import Compiled
from gso.errors import MeshError
from gso.executors import SERIAL, Executor
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.pipeline.case import Case
from gso.pipeline.run import Run
from gso.pipeline.user_result import in_user_frame, pattern_of
from gso.tasks.evaluation import largest_strain
from gso.tasks.request import Request

#: Number of groups of components that are laid out apart, and of vertices from which on.
_GROUPS, _LARGE = 4, 2000


def lay_out(
    surface: Mesh, given: Pattern | None = None, *, formulation: str = "strain"
) -> Pattern | None:
    """Flatten a surface with little strain.

    A surface that closes around itself is cut open.

    Parameters
    ----------
    surface : Mesh
        In any frame.
    given : Pattern, optional
        An existing pattern of the surface; the one with the smaller maximal strain is returned.
    formulation : str
        Formulation of the flatten task. By "strain" the task solves only what is far from flat.

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
    if not parametrization.flattens(surface):
        return given
    # Imported here because it imports SciPy.
    from gso.tasks import flatten

    request = Request("flatten", formulation, flatten.Options.preset("fast"), verdict=False)
    case = Case(request, surface, Compiled(flat=True))
    try:
        found = _low_strain(case) or _solved(case)
    except MeshError:
        return given
    if found is None or (found.is_cut and surface.grid_index is not None):
        return given
    if given is not None and largest_strain(surface, given) <= largest_strain(surface, found):
        return given
    return found


def _low_strain(case: Case) -> Pattern | None:
    """Return the pattern by the direct method; None where the surface is too far from flat."""
    from gso.tasks import flatten

    opened = case.analysis.opened
    if case.request.formulation != "strain":
        return None
    image = parametrization.low_strain(opened.mesh, doubtful=opened.doubtful)
    if image.level > flatten.FAR_FROM_FLAT:
        return None
    flat = opened.back(parametrization.place(opened.mesh, image.flat))
    return in_user_frame(case, flat, opened.cut)


def _solved(case: Case) -> Pattern | None:
    """Return the pattern that the flatten task finds."""
    return pattern_of(case, Run(case).solve(case.solver_request))


def strains_of(surface: Mesh, executor: Executor = SERIAL) -> dict[str, float]:
    """Return mean, 99th percentile and largest strain of a surface's pattern; empty without.

    Parameters
    ----------
    surface : Mesh
    executor : Executor
        Lays out components; the result does not depend on it.
    """
    label = components.labels(surface)
    count = min(_GROUPS if len(label) >= _LARGE else 1, int(label.max()) + 1)
    if count <= 1:
        return _strains(surface, lay_out(surface))
    # Groups do not depend on the number of processes, so that neither does the result.
    # The largest component first, each to the group with the fewest vertices so far.
    sizes, group = np.bincount(label), np.zeros(label.max() + 1, np.int64)
    filled = np.zeros(count)
    for k in np.argsort(-sizes, kind="stable").tolist():
        group[k] = filled.argmin()
        filled[group[k]] += sizes[k]
    parts = components.split(surface, group[label])
    patterns = executor.map(lay_out, [part.mesh for part in parts])
    flat = np.zeros((len(surface.vertices), 2))
    for part, pattern in zip(parts, patterns, strict=True):
        if pattern is None:
            return {}
        if len(pattern.seams):
            # A component that closes around itself was cut open.
            return _strains(surface, lay_out(surface))
        flat[part.vertices] = pattern.flat
    return metrics.strains(surface, flat)


def _strains(surface: Mesh, pattern: Pattern | None) -> dict[str, float]:
    return {} if pattern is None else metrics.strains(pattern.surface(surface), pattern.flat)

"""Criterion for whether a net's warm start saves more time than it costs."""

from __future__ import annotations

from gso.mesh import Mesh
from gso.tno import check
from gso.typing import Keywords

#: Number of vertices from which a net saves time, by the unknowns of the last stage: for one
#: design, including the time to load PyTorch, and for one of many.
#: ``python bench/run_all.py --only hybrid.sizes`` prints the times.
_FREE = (10_000, 2_500)
_OFFSETS = (40_000, 10_000)


def net_saves_time(design: Mesh, task: str, keywords: Keywords, *, many: bool = False) -> bool:
    """Return whether the task's net is expected to save time, at the same quality.

    It was found to only for developable solves of grids by curvature. Solves with bounds or
    constraints were not measured, and return False.

    Parameters
    ----------
    design : Mesh
    task, keywords
        As for :func:`gso.hybrid.solve`.
    many : bool
        Whether it is one of many designs.
    """
    request = check(task, keywords.get("formulation"), keywords.get("options"))
    by_curvature = (task, request.formulation) == ("developable", "curvature")
    if not by_curvature or design.grid_index is None:
        return False
    bounds = ("max_deviation", "max_strain", "target_curvature")
    if any(keywords.get(name) is not None for name in bounds):
        return False
    if keywords.get("constraints"):
        return False
    least = _FREE if getattr(request.options, "variables", None) == "free" else _OFFSETS
    return len(design.vertices) >= least[many]

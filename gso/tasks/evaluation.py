"""The metrics of a task, per component and combined."""

from __future__ import annotations

import numpy as np

from gso import metrics as measure
from gso import tasks
from gso.components import combined, several, split
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.typing import Array


def compute_metrics(task: str, design: Mesh, after: Mesh, flat: Array | None) -> dict[str, float]:
    """Compute the metrics of a result, per component by its own size, and combine them.

    Parameters
    ----------
    task : str
        Name of the task.
    design, after : Mesh
        Before and after. If their faces differ, their components cannot be matched and each
        surface is measured as a whole.
    flat : ndarray, (n, 2), or None
        Flat image.

    Examples
    --------
    >>> panel = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> lifted = Mesh.from_grid(panel + [0.0, 0.0, 0.1])
    >>> round(compute_metrics("developable", Mesh.from_grid(panel), lifted, None)["d_H"], 6)
    3.535534
    """
    metrics = tasks.get(task).metrics
    if not several(design) or not np.array_equal(design.faces, after.faces):
        return metrics(design, after, flat, measure.unit(design))
    parts = split(design)
    found = [
        metrics(
            part.mesh,
            part.of(after),
            None if flat is None else flat[part.vertices],
            measure.unit(part.mesh),
        )
        for part in parts
    ]
    return combined(found, [part.area for part in parts])


def largest_strain(surface: Mesh, pattern: Pattern) -> float:
    """Return the largest principal strain max |s - 1| of a surface in its pattern."""
    return float(measure.principal_strains(pattern.surface(surface), pattern.flat).values.max())

"""Panels of a result: one for each connected part of its pattern."""

from __future__ import annotations

from typing import Any

import numpy as np

from gso.errors import MeshError
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.result import Result
from gso.ruled.ruled_surface import RuledSurface
from gso.typing import Array, Ints
from gso.workshop.matings import across, numbered, of_pattern
from gso.workshop.panels import Made, Panel


def of_surface(name: str, surface: Mesh, pattern: Pattern, record: dict[str, Any]) -> Made:
    """Divide a surface with a pattern into panels.

    Parameters
    ----------
    name : str
        Panels are called NAME-1, NAME-2 and so on, the largest first; a single one NAME.
    surface : Mesh
    pattern : Pattern
    record : dict
        What was measured.
    """
    panels, label, local = _divided(name, surface.vertices, pattern, None)
    matings = of_pattern(surface.vertices, pattern, label, local)
    return Made(name, tuple(panels), numbered(matings), record)


def of_ruled(name: str, result: Result, record: dict[str, Any]) -> Made:
    """Divide a ruled surface, of one piece or of several, into panels: one for each strip."""
    ruled = result.ruled
    if ruled is None:
        raise MeshError(f"{name}: there are no strips")
    points = ruled.mesh.vertices
    panels, label, local = _divided(name, points, ruled.pattern, ruled)
    matings = of_pattern(points, ruled.pattern, label, local)
    if result.pieces is not None:
        strips = np.cumsum(result.details["strips"])
        owner = [
            int(np.searchsorted(strips, ruled.strip[_first(ruled.pattern, label, k)], "right"))
            for k in range(len(panels))
        ]
        rims = _rims(panels, ruled.pattern, label, local)
        matings += across(result.pieces, ruled.moved, owner, panels, rims)
    return Made(name, tuple(panels), numbered(matings), record)


def _divided(
    name: str, points: Array, pattern: Pattern, ruled: RuledSurface | None
) -> tuple[list[Panel], Ints, Ints]:
    """Return the panels of a pattern, and the panel and the number in it of each vertex."""
    from gso.components import split

    parts = sorted(split(pattern.mesh), key=lambda part: -part.area)
    label, local = (np.full(len(pattern.flat), -1) for _ in range(2))
    for number, part in enumerate(parts):
        label[part.vertices], local[part.vertices] = number, np.arange(len(part.vertices))
    edges, at = np.empty((0, 2), np.int64), np.empty(0, np.int64)
    if ruled is not None and len(ruled.rulings.edges):
        edges, at = ruled.bend_edges
    panels = []
    for number, part in enumerate(parts):
        own = label[edges[:, 0]] == number if len(edges) else np.zeros(0, bool)
        surface = part.mesh.replaced(points[pattern.vertex[part.vertices]])
        flat = pattern.flat[part.vertices]
        said = f"{name}-{number + 1}" if len(parts) > 1 else name
        if ruled is None:
            panels.append(Panel(said, surface, flat))
            continue
        angles, radii = ruled.rulings.angles[at[own]], ruled.rulings.radii[at[own]]
        panels.append(Panel(said, surface, flat, local[edges[own]], angles, radii))
    return panels, label, local


def _first(pattern: Pattern, label: Ints, number: int) -> int:
    """Return the first face of a panel."""
    return int(np.flatnonzero(label[pattern.faces[:, 0]] == number)[0])


def _rims(panels: list[Panel], pattern: Pattern, label: Ints, local: Ints) -> list[Ints]:
    """Return the edges of each panel's outline that are no seam of the pattern."""
    ends = pattern.seams.reshape(-1, 2)
    out = []
    for number, panel in enumerate(panels):
        n = len(panel.flat)
        rim = np.concatenate(
            [np.stack([loop, np.roll(loop, -1)], axis=1) for loop in panel.surface.boundary_loops]
        )
        own = np.sort(local[ends[label[ends[:, 0]] == number]], axis=1) @ np.array([n, 1])
        keys = np.sort(rim, axis=1) @ np.array([n, 1])
        out.append(rim[~np.isin(keys, own)])
    return out

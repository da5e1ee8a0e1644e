"""Objectives of meshes with several components, each scaled to its own unit ball."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from gso.components import several, split
from gso.energy import Weighted
from gso.energy.placed import placed
from gso.mesh import Mesh
from gso.typing import Array


def objective(mesh: Mesh, make: Callable[..., list[Weighted]], *positions: Array) -> list[Weighted]:
    """Build the terms of a mesh, those of each component in its own unit ball.

    The energy is the mean over the components, weighted by area. A small component joined to a
    large one by constraints is thus treated as if it were alone.

    Parameters
    ----------
    mesh : Mesh
        The whole mesh, in the solver's frame.
    make : callable
        ``make(mesh, *positions)`` returns the terms of one component.
    *positions : ndarray, (n, 3)
        Further positions of the vertices, in the frame of `mesh`.
    """
    if not several(mesh):
        return make(mesh, *positions)
    parts = split(mesh)
    total = sum(part.area for part in parts)
    items = []
    for part in parts:
        frame = part.mesh.frame
        own = part.mesh.replaced(frame.to_unit(part.mesh.vertices))
        for item in make(own, *(frame.to_unit(p[part.vertices]) for p in positions)):
            share = part.area / total
            term = placed(item.term, frame, part.vertices, part.faces, share=share)
            items.append(replace(item, term=term))
    return items

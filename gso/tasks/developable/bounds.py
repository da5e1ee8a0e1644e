"""Bounds on the displacement of vertices."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from gso.constraints import Pins
from gso.errors import OptionError
from gso.mesh import Mesh
from gso.mesh.normals import vertex_normals
from gso.tasks.developable.analysis import Analysis
from gso.tasks.options import Options
from gso.tasks.request import Request
from gso.typing import Array, Ints


def radius(request: Request[Options]) -> float | None:
    """Return the bound on the displacement, reduced by a tiny margin for rounding."""
    bound = request.max_displacement
    return None if bound is None else bound * (1.0 - 1e-7)


def check_handles(analysis: Analysis, request: Request[Options]) -> None:
    """Raise if hard constraints are incompatible with `max_deviation`."""
    c, reach = analysis.constraints, request.max_displacement
    if reach is None:
        return
    for part in c.parts:
        if part.hard and not isinstance(part, Pins):
            raise OptionError(
                f"{c.names[part.owner]} cannot be kept with max_deviation, under which vertices "
                "move along their normals only; leave one out, or give the constraint a weight "
                "where it takes one"
            )
    if not len(c.hard_ids):
        return
    far = np.linalg.norm(c.hard_positions - analysis.mesh.vertices[c.hard_ids], axis=1)
    if far.max() > reach:
        raise OptionError(
            f"a handle moves its vertex by {far.max() / reach:.3g} times max_deviation; "
            "allow more, or give the handle a weight"
        )


def offset_bounds(
    mesh: Mesh, radius: float | None, held: Ints
) -> Callable[[Array], tuple[Array, Array]] | None:
    """Build the bounds on normal offsets that keep vertices within `radius` of the design's.

    Vertices in `held` are fixed and have no unknown. None without a radius.
    """
    return None if radius is None else partial(_bounds_at, mesh, radius, held)


def _bounds_at(mesh: Mesh, radius: float, held: Ints, coordinates: Array) -> tuple[Array, Array]:
    points = coordinates.reshape(-1, 3)
    n = vertex_normals(mesh.replaced(points))
    u = points - mesh.vertices
    along = (u * n).sum(axis=1)
    root = np.sqrt(np.maximum(along**2 - (u * u).sum(axis=1) + radius**2, 0.0))
    low, high = np.minimum(-along - root, 0.0), np.maximum(-along + root, 0.0)
    return np.delete(low, held), np.delete(high, held)


def inside(points: Array, mesh: Mesh, radius: float | None) -> Array:
    """Project points into the balls of radius `radius` around their vertices in the design."""
    if radius is None:
        return points
    u = points - mesh.vertices
    length = np.linalg.norm(u, axis=1, keepdims=True)
    bounded: Array = mesh.vertices + u * np.minimum(1.0, radius / np.maximum(length, 1e-300))
    return bounded

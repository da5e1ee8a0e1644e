"""The metrics of strips."""

from __future__ import annotations

import numpy as np

from gso import geometry, metrics
from gso.geometry.polygon import signed_area
from gso.geometry.vectors import lengths
from gso.mesh import Mesh
from gso.mesh.topology import four_corners
from gso.pattern import Pattern
from gso.ruled.fold_lines import Folds
from gso.ruled.ruled_surface import RuledSurface
from gso.typing import Array

#: Length of a crease that its mean turn is given for, in % of the diagonal.
_PER = 1.0
#: Largest width of needles, relative to the diagonal.
_NEEDLE = 0.001


def strip_metrics(design: Mesh, surface: RuledSurface) -> dict[str, float]:
    """Compute the metrics of strips near a design.

    They have no Gaussian curvature, so there is none here. Distances are measured all over both
    surfaces; each is the larger one of both directions.
    """
    if surface.pleats is None:
        surface = surface.measured_pleats(design)
    true = surface.deviation or surface.distances(design)
    percent = 100.0 / design.diagonal
    flat, sheet = surface.pattern.flat, surface.pattern.surface(surface.mesh)
    return (
        surface.strains
        | {
            "distance_mean": percent * true.mean,
            "distance_max": percent * true.largest,
            "d_H": metrics.d_H(design, design.replaced(surface.moved)),
            "fold_max": float(metrics.dihedral_angles(surface.mesh).max(initial=0.0)),
            "flipped_cells": float(metrics.flips(sheet, flat)),
            "strips": float(surface.strips),
            "rulings": float(len(surface.rulings.edges)),
            "flats": float(np.count_nonzero(surface.flat)),
            "rulings_crossed": float(surface.crossed),
            "pleat_max": surface.pleat_max,
            "bend_radius_min": surface.rulings.smallest_radius,
        }
        | _creases(surface.creases, surface.mesh.vertices, percent)
        | _part_metrics(surface.pattern)
        | {"needles": float((percent * _widths(surface.mesh) < 100.0 * _NEEDLE).sum())}
    )


def _creases(creases: Folds, vertices: Array, percent: float) -> dict[str, float]:
    """Return the angles at creases and how much these turn."""
    turns = creases.turns(vertices)
    angle = np.degrees(np.abs(creases.angles))
    order = np.argsort(angle)
    a, b = vertices[creases.edges].transpose(1, 0, 2)
    total = np.cumsum(lengths(b - a)[order])
    length = percent * float(total[-1]) if len(total) else 0.0
    at = np.searchsorted(total, 0.9 * total[-1]) if len(total) else 0
    return {
        "crease_angle_max": float(angle.max(initial=0.0)),
        "crease_angle_p90": float(angle[order][at]) if len(total) else 0.0,
        "crease_turn_max": float(np.degrees(turns.max(initial=0.0))),
        "crease_turn_mean": _PER * float(np.degrees(turns.sum())) / length if length else 0.0,
    }


def smallest_part(pattern: Pattern) -> float:
    """Return the area of the smallest part of a pattern, in % of all."""
    return _least_area(_regions(pattern))


def _part_metrics(pattern: Pattern) -> dict[str, float]:
    """Return the size of the smallest part of a pattern."""
    regions = _regions(pattern)
    widths = [_inscribed(region) for region in regions]
    return {"part_area_min": _least_area(regions), "part_circle_min": min(widths)}


def _regions(pattern: Pattern) -> list[np.ndarray]:
    """Return the polygons of each part; several where the pattern meets itself."""
    import shapely

    mesh, flat = pattern.mesh, pattern.flat
    label = mesh.components
    rings: list[list[Array]] = [[] for _ in range(int(label.max()) + 1)]
    for loop in mesh.boundary_loops:
        rings[label[loop[0]]].append(flat[loop])
    out = []
    for loops in rings:
        outer, *holes = sorted(loops, key=lambda loop: -abs(signed_area(loop)))
        out.append(shapely.get_parts(shapely.make_valid(shapely.Polygon(outer, holes))))
    return out


def _least_area(regions: list[np.ndarray]) -> float:
    """Return the smallest area, in % of all."""
    import shapely

    areas = [float(shapely.area(region).sum()) for region in regions]
    return 100.0 * min(areas) / max(sum(areas), 1e-300)


def _inscribed(region: np.ndarray) -> float:
    """Return the diameter of the largest circle in a part."""
    import shapely

    largest = max(region, key=shapely.area)
    if not shapely.area(largest):
        return 0.0
    return 2.0 * float(shapely.length(shapely.maximum_inscribed_circle(largest)))


def _widths(mesh: Mesh) -> Array:
    """Return the widths of faces (m,): heights of triangles, of quads area over longest side."""
    corners = four_corners(mesh.faces)
    p = mesh.vertices[corners]
    side = lengths(np.roll(p, -1, axis=1) - p).max(axis=1)
    double = lengths(geometry.quad_area_vectors(mesh.vertices, corners))
    return np.asarray(np.where(corners[:, 0] == corners[:, 3], 1.0, 0.5) * double / side)

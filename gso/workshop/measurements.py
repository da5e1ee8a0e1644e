"""What is measured of a made surface and of its panels, and its verdict."""

from __future__ import annotations

from typing import Any

import numpy as np

from gso import faults, metrics, parametrization, rulings
from gso.errors import MeshError
from gso.mesh import Mesh
from gso.mesh.validation import have_area
from gso.pattern import Pattern
from gso.seams.sheets import rectangle
from gso.verdict import Code, Measurement, Reason, compare, merge
from gso.workshop.asking import Ask
from gso.workshop.panels import Made, Panel

#: Share of the area whose curvature counts, and the curvature, times the diagonal, up to which a
#: panel is flat.
_MOST, _STRAIGHT = 0.99, 1e-6


def of_panels(design: Mesh, panels: list[Panel], ask: Ask, allowed: float) -> dict[str, Any]:
    """Measure panels together, against the whole design."""
    start = np.cumsum([0, *(len(p.flat) for p in panels)])[:-1].tolist()
    wide = max(p.surface.faces.shape[1] for p in panels)
    faces = []
    for panel, first in zip(panels, start, strict=True):
        table = panel.surface.faces
        table = np.pad(table, ((0, 0), (0, wide - table.shape[1])), constant_values=-1)
        faces.append(np.where(table < 0, -1, table + first))
    points, table = np.concatenate([p.surface.vertices for p in panels]), np.concatenate(faces)
    flat = np.concatenate(parametrization.beside([p.flat for p in panels]))
    # Slivers of a small panel may have no area relative to the whole.
    mesh = Mesh(points, table[have_area(table, points) & have_area(table, flat)])
    return of_pattern(design, mesh, Pattern.whole(mesh, flat), ask, allowed)


def bend_radius(panel: Panel) -> float:
    """Return the smallest radius that a panel is bent to, in its unit.

    Of a panel with bend lines it is that of the bends; otherwise the 1 % of the area that is
    curved most is left out, as the curvature of single faces is not accurate.
    """
    if len(panel.bends):
        return float(panel.radii.min())
    shape = rulings.shape_operator(panel.surface)
    curved = np.abs(shape.curvatures).max(axis=1)
    order = np.argsort(curved)
    share = np.cumsum(shape.areas[order]) / shape.areas.sum()
    most = curved[order[min(int(np.searchsorted(share, _MOST)), len(order) - 1)]]
    return float(1.0 / most) if most * panel.surface.diagonal > _STRAIGHT else np.inf


def of_pattern(
    design: Mesh,
    surface: Mesh,
    pattern: Pattern,
    ask: Ask,
    allowed: float | None,
) -> dict[str, Any]:
    """Measure a surface and its pattern; `allowed` is the largest distance from the design."""
    away = metrics.surface_distance(design, surface)
    sheet = pattern.surface(surface)
    strains = metrics.strains(sheet, pattern.flat)
    far = max(away.there_max, away.back_max)
    overlaps = len(faults.overlaps(sheet, pattern.flat))
    flips = int(metrics.flips(sheet, pattern.flat))
    return {
        "formulation": ask.formulation,
        "area": metrics.area(surface),
        "diagonal": design.diagonal,
        "allowed": allowed,
        "deviation_mean": max(away.there_mean, away.back_mean),
        "deviation_max": far,
        "deviation_at": _worst(design, surface),
        "strain_max": strains["strain_max"],
        "strain_p99": strains["strain_p99"],
        "curvature": _curvatures(surface),
        "planarity_max": _planarity(surface),
        "overlaps": overlaps,
        "inverted": flips,
        "pieces": len(pattern.mesh.boundary_loops),
        "strips": [],
    }


def judge(made: Made, ask: Ask) -> tuple[Reason, ...]:
    """Return why panels are not what was asked for, beside the reasons of their solve."""
    record, names = made.record, [panel.name for panel in made.panels]
    sizes = np.array([rectangle(panel.flat)[1] for panel in made.panels])
    # Strips keep the smallest radius themselves, or say why not.
    plain = [panel for panel in made.panels if ask.min_radius and not len(panel.bends)]
    wide, long = (None, None) if ask.max_size is None else sorted(ask.max_size)
    limits = {
        Code.DEVIATION: record["allowed"],
        Code.STRAIN: ask.strain,
        Code.TOO_LONG: long,
        Code.TOO_WIDE: wide,
        Code.BEND_RADIUS: ask.min_radius,
    }
    measured = {
        Code.DEVIATION: Measurement(record["deviation_max"]),
        Code.STRAIN: Measurement(record["strain_max"]),
        Code.PATTERN_OVERLAPS: Measurement(record["overlaps"]),
        Code.PATTERN_INVERTED: Measurement(record["inverted"]),
        Code.TOO_LONG: Measurement(sizes[:, 0], "part", names),
        Code.TOO_WIDE: Measurement(sizes[:, 1], "part", names),
        Code.BEND_RADIUS: Measurement(
            np.array([bend_radius(panel) for panel in plain]), "part", [p.name for p in plain]
        ),
    }
    later = compare(measured, limits)
    # The solve may have had another design in its place, or less room; and a strain that is too
    # large is said as the record has it.
    decided = {Code.DEVIATION} | ({Code.STRAIN} & {reason.code for reason in later})
    return merge(made.reasons, later, decided)


def _worst(design: Mesh, surface: Mesh) -> list[float]:
    """Return the vertex of the surface that is farthest from the design."""
    points = surface.vertices[surface.used]
    return points[int(metrics.point_to_surface(points, design).argmax())].tolist()


def _curvatures(surface: Mesh) -> list[float]:
    """Return the mean absolute curvature by both triangulations, 1 over size squared."""
    try:
        return [float(metrics.loss_gc(surface)), float(metrics.loss_gc_worst(surface))]
    except MeshError:
        # No vertex is inside.
        return [0.0, 0.0]


def _planarity(surface: Mesh) -> float:
    """Return the largest distance of a quad's diagonals, over its mean edge."""
    if surface.is_triangles:
        return 0.0
    return float(np.nan_to_num(metrics.nonplanarity(surface)).max(initial=0.0))

"""What is measured of a made surface, and what is not within its bound."""

from __future__ import annotations

from typing import Any

import numpy as np

from gso import faults, metrics, parametrization, rulings
from gso.errors import MeshError
from gso.mesh import Mesh
from gso.mesh.validation import have_area
from gso.pattern import Pattern
from gso.workshop.asking import Ask
from gso.workshop.panels import Panel


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
    return of_pattern(design, mesh, Pattern.whole(mesh, flat), ask, allowed, [])


def bend_radius(panel: Panel) -> float:
    """Return the smallest radius of a panel's bends, or of its surface if it has none."""
    if len(panel.bends):
        return float(panel.radii.min())
    return rulings.smallest_radius(panel.surface)


def of_pattern(
    design: Mesh,
    surface: Mesh,
    pattern: Pattern,
    ask: Ask,
    allowed: float | None,
    reasons: list[str],
) -> dict[str, Any]:
    """Measure a surface and its pattern, and add what is not within its bound to the reasons."""
    away = metrics.surface_distance(design, surface)
    sheet = pattern.surface(surface)
    strains = metrics.strains(sheet, pattern.flat)
    far = max(away.there_max, away.back_max)
    overlaps = len(faults.overlaps(sheet, pattern.flat))
    flips = int(metrics.flips(sheet, pattern.flat))
    if allowed is not None and far > allowed * (1.0 + 1e-6) and not reasons:
        reasons.append(
            f"the surface is up to {far:.4g} from the design, more than {allowed:.4g} (in the "
            "design's unit)"
        )
    if strains["strain_p99"] > ask.max_strain and not reasons:
        reasons.append(
            f"the strain of the patterns is {100 * strains['strain_p99']:.3g} % (99 %), more than "
            f"{100 * ask.max_strain:.3g} %"
        )
    if overlaps and not reasons:
        reasons.append(f"{overlaps} faces of the patterns overlap")
    if flips and not reasons:
        reasons.append(f"{flips} faces of the patterns are inverted")
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
        "reasons": reasons,
    }


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

"""What is measured of a made surface and of its panels, and its verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso import faults, metrics, rulings
from gso.components import split
from gso.errors import MeshError
from gso.mesh import Mesh
from gso.mesh.topology import edge_keys, pair_keys
from gso.metrics import Distances
from gso.pattern import Pattern
from gso.seams import Sheet
from gso.seams.sheets import too_small
from gso.typing import Json
from gso.verdict import Code, Measurement, Reason, compare, merge, ordered
from gso.workshop.fabrication_settings import FabricationSettings
from gso.workshop.panels import Made, Panel


def bend_radius(panel: Panel) -> float:
    """Return the smallest radius of a panel's bends, or of its surface if it has none."""
    if len(panel.bends):
        return float(panel.radii.min())
    return rulings.smallest_radius(panel.surface)


def of_pattern(
    design: Mesh,
    surface: Mesh,
    pattern: Pattern,
    settings: FabricationSettings,
    allowed: float | None,
    *,
    is_kept: bool = False,
) -> Json:
    """Measure a surface and its pattern; `allowed` is the largest distance from the design.

    With `is_kept` the surface is the design, divided into more triangles.
    """
    away = Distances(0, 0, 0, 0) if is_kept else metrics.surface_distance(design, surface)
    sheet = pattern.surface(surface)
    strains = metrics.strains(sheet, pattern.flat)
    overlaps = len(faults.overlaps(sheet, pattern.flat))
    flips = int(metrics.flips(sheet, pattern.flat))
    return {
        "formulation": settings.formulation,
        "area": metrics.area(surface),
        "diagonal": design.diagonal,
        "size": design.size,
        "allowed": allowed,
        "deviation_mean": away.mean,
        "deviation_max": away.largest,
        "deviation_at": surface.vertices[0].tolist() if is_kept else _worst(design, surface),
        "strain_max": strains["strain_max"],
        "strain_p99": strains["strain_p99"],
        "curvature": _curvatures(pattern.surface(surface)),
        "planarity_max": _planarity(surface),
        "overlaps": overlaps,
        "inverted": flips,
        "pieces": len(split(pattern.mesh)),
        "strips": [],
    }


def _judged(made: Made, settings: FabricationSettings) -> tuple[Reason, ...]:
    """Return why panels are not what was asked for, beside the reasons of their solve."""
    record, names = made.record, [panel.name for panel in made.panels]
    sheets = [Sheet(panel.surface, panel.flat) for panel in made.panels]
    sizes = np.array([sheet.size for sheet in sheets])
    # Strips keep the smallest radius themselves, or say why not.
    plain = [panel for panel in made.panels if settings.min_radius and not _is_strip(panel)]
    wide, long = (None, None) if settings.max_size is None else sorted(settings.max_size)
    limits = {
        Code.DEVIATION: record["allowed"],
        Code.STRAIN: settings.strain,
        Code.TOO_LONG: long,
        Code.TOO_WIDE: wide,
        Code.BEND_RADIUS: settings.min_radius,
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
    unmarked = np.array([_unmarked_fold(panel) for panel in made.panels])
    measured[Code.UNMARKED_FOLD] = Measurement(unmarked, "part", names)
    pairs = [{seam.one.panel, seam.two.panel} for seam in made.matings]
    joined = sorted(set().union(*(p for p in pairs if len(p) > 1)))
    if joined:
        own, some = [made.panels[k].name for k in joined], [sheets[k] for k in joined]
        measured |= too_small(some, record["area"], record["size"], "part", own)
    asked = settings.seams()
    later = ordered([*compare(measured, limits), *asked.reasons(record["pieces"], sheets, names)])
    # The solve may have had another design in its place, or less room; pieces may have become
    # other parts; and a strain that is too large is said as the record has it.
    decided = {Code.DEVIATION, Code.PIECES, Code.NECK, Code.TOO_SHORT} | (
        {Code.STRAIN} & {reason.code for reason in later}
    )
    return merge(made.reasons, later, decided)


def checked(made: Made, settings: FabricationSettings) -> Made:
    """Add the reasons against the panels."""
    return replace(made, reasons=_judged(made, settings))


def bent(made: Made) -> Made:
    """Measure the smallest radius of all panels."""
    radius = min(bend_radius(panel) for panel in made.panels)
    return replace(made, record=made.record | {"bend_radius_min": radius})


def _unmarked_fold(panel: Panel) -> float:
    """Return the largest angle between two faces where no bend lies, in degrees."""
    he, count = panel.surface.half_edges, len(panel.flat)
    inner = he.interior
    keys = edge_keys(he.origin[inner], he.dest[inner], count)
    bent = pair_keys(panel.bends, count)
    angles = metrics.dihedral_angles(panel.surface)
    return float(angles[~np.isin(keys, bent)].max(initial=0.0))


def _is_strip(panel: Panel) -> bool:
    """Tell whether a panel has bends that are neither lines of a zone nor sharp folds."""
    return bool(((panel.zone < 0) & (panel.radii > 0)).any())


def _worst(design: Mesh, surface: Mesh) -> list[float]:
    """Return the vertex of the surface that is farthest from the design."""
    points = surface.vertices[surface.used]
    worst: list[float] = points[int(metrics.point_to_surface(points, design).argmax())].tolist()
    return worst


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

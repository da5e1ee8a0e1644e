"""One design made of flat panels: whole if possible, otherwise cut into pieces."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gso import decimation, faults, metrics, parametrization
from gso.errors import ConvergenceWarning, GSOError, MeshError
from gso.io.surface import welded
from gso.mesh import Mesh
from gso.mesh.validation import have_area
from gso.pattern import Pattern
from gso.result import Result
from gso.segmentation import Segmentation
from gso.segmentation import pieces as search
from gso.segmentation.sheets import rectangle
from gso.tno import optimize
from gso.workshop.asking import Ask
from gso.workshop.matings import across, numbered
from gso.workshop.paneling import of_ruled, of_surface
from gso.workshop.panels import Made, Mating, Panel, Side

#: Shares of the allowed distance: what the pieces may use, and within what strips follow them, so
#: that the two sides of a seam stay together.
_PIECES, _FOLLOW = 0.9, 0.1
#: Largest number of strips of a piece of several; more of them are worse than none.
_STRIPS = 4
#: Distance of vertices that are merged, relative to the diagonal.
_SAME = 1e-9

#: Number of triangles that a larger design is decimated to, and the share of the allowed distance
#: within which.
_LIGHT, _NEAR = 10_000, 0.35

Say = Callable[[str], None]


@dataclass(frozen=True)
class _Design:
    """A design, the mesh that is solved in its place, and the allowed distances from both."""

    mesh: Mesh
    light: Mesh
    allowed: float
    left: float

    @classmethod
    def of(cls, mesh: Mesh, allowed: float) -> _Design:
        light, away = decimation.within(mesh, _NEAR * allowed, _LIGHT)
        return cls(mesh, light, allowed, allowed - away)


def made(name: str, design: Mesh, ask: Ask, say: Say = lambda said: None) -> Made:
    """Make a design of flat panels within what is asked, or as near to it as possible.

    A ruled surface is tried as a whole, and then in pieces; a piece that no strips follow keeps
    the pattern of the joint solve, whose strain is within `max_strain`.

    Parameters
    ----------
    name : str
    design : Mesh
        One component.
    ask : Ask
    say : callable
        Called with what is being done.
    """
    joined = welded(design, _SAME * design.diagonal)
    if len(joined.vertices) < len(design.vertices):
        # Poles of grids, whose edges have no length, become one vertex.
        design = joined
    allowed = ask.distance(design.diagonal)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        if ask.formulation == "flatten":
            return _flattened(name, design, ask, say)
        own = _Design.of(design, allowed)
        whole = _whole(name, own, ask, say)
        if whole is not None:
            whole = _sized(whole, ask)
        if whole is not None and not whole.reasons:
            return whole
        try:
            parted = _sized(_parted(name, own, ask, say), ask)
        except GSOError:
            if whole is None:
                raise
            return whole
    if whole is None or not parted.reasons:
        return parted
    return min((whole, parted), key=lambda one: one.record["deviation_max"])


def _whole(name: str, design: _Design, ask: Ask, say: Say) -> Made | None:
    """Make the design of one surface; None if it is closed, or has a handle."""
    if not parametrization.flattens(design.light):
        return None
    say(f"{name}: as a whole")
    if ask.formulation != "ruled":
        result = optimize(
            design.light,
            formulation=ask.formulation,
            max_deviation=design.left,
            max_strain=ask.max_strain,
        )
        if result.pattern is None:
            return None
        reasons = list(result.reasons)
        record = _record(design.mesh, result.mesh, result.pattern, ask, design.allowed, reasons)
        return of_surface(name, result.mesh, result.pattern, record)
    try:
        result = optimize(
            design.light, formulation="ruled", options=_options(ask), max_deviation=design.left
        )
    except MeshError:
        return None
    return of_ruled(name, result, _ruled_record(design, result, ask))


def _sized(made: Made, ask: Ask) -> Made:
    """Add a reason if a pattern is larger than a sheet."""
    if ask.max_size is None:
        return made
    limit = np.sort(ask.max_size)[::-1]
    for panel in made.panels:
        size = np.array(rectangle(panel.flat)[1])
        if (size > limit * (1.0 + 1e-9)).any():
            long, wide = size.tolist()
            why = f"the pattern of {panel.name} is {long:.4g} by {wide:.4g}, larger than a sheet"
            made.record["reasons"] = [*made.reasons, why]
            break
    return made


def _options(ask: Ask) -> Any:
    from gso.tasks.developable.ruled import Options

    return Options(strips="auto", max_strips=ask.max_strips, min_radius=ask.min_radius)


def _flattened(name: str, design: Mesh, ask: Ask, say: Say) -> Made:
    """Cut a design whose shape stays into pieces, as far as the strain requires."""
    found = _searched(name, design, ask, None, say)
    pattern = found.pattern
    if pattern is None:
        raise MeshError(f"{name}: a piece cannot be laid flat; {'; '.join(found.reasons)}")
    record = _record(design, found.design, pattern, ask, None, list(found.reasons))
    return of_surface(name, found.design, pattern, record | {"pieces": len(found)})


def _searched(name: str, design: Mesh, ask: Ask, allowed: float | None, say: Say) -> Segmentation:
    """Search for seams; on triangles they need not follow edge rows."""
    triangles = Mesh(design.vertices, design.triangles)
    return search(
        triangles,
        max_strain=ask.max_strain,
        max_deviation=allowed,
        darts=ask.darts,
        max_size=ask.max_size,
        callback=lambda said: say(f"{name}: {said}"),
    )


def _parted(name: str, design: _Design, ask: Ask, say: Say) -> Made:
    """Make the design in pieces: each of them ruled where that is asked and possible."""
    share = _PIECES if ask.formulation == "ruled" else 1.0
    found = _searched(name, design.light, ask, share * design.left, say)
    if any(sheet is None for sheet in found.sheets):
        raise MeshError(f"{name}: a piece cannot be laid flat; {'; '.join(found.reasons)}")
    panels: list[Panel] = []
    matings: list[Mating] = []
    owner: list[int] = []
    moved = found.opened.mesh.vertices.copy()
    strips = []
    for number, (piece, part, sheet) in enumerate(
        zip(found, found.parts, found.sheets, strict=True)
    ):
        own = f"{name}-{piece.name}" if len(found) > 1 else name
        result = None
        if ask.formulation == "ruled":
            say(f"{own}: strips")
            result = _strips(piece.mesh, ask, _FOLLOW * design.left)
        if result is None or result.ruled is None or sheet is None:
            panels.append(Panel(own, piece.mesh, sheet.flat))  # type: ignore[union-attr]
            owner.append(number)
            strips.append(0)
            continue
        sub = of_ruled(own, result, {})
        first = len(panels)
        matings += [
            replace(m, one=_shifted(m.one, first), two=_shifted(m.two, first)) for m in sub.matings
        ]
        panels += sub.panels
        owner += [number] * len(sub.panels)
        strips.append(len(sub.panels))
        moved[part.vertices] = result.ruled.moved
    rims = [
        np.concatenate([np.stack([loop, np.roll(loop, -1)], axis=1) for loop in panel.loops])
        for panel in panels
    ]
    matings += across(found, moved, owner, panels, rims)
    record = _of_panels(design.mesh, panels, ask, design.allowed)
    reasons = [
        *(r for r in found.reasons if "distance between surface and design" not in r),
        *record["reasons"],
    ]
    seams = found.opened.seams
    gap = np.linalg.norm(moved[seams[:, 0]] - moved[seams[:, 1]], axis=2).max(initial=0.0)
    record |= {"pieces": len(found), "strips": strips, "seam_gap": float(gap), "reasons": reasons}
    return Made(name, tuple(panels), numbered(matings), record)


def _strips(mesh: Mesh, ask: Ask, left: float) -> Result | None:
    """Make a piece of strips; None if no strips are usable within the distance."""
    # The piece is developable already: its own normals give the rulings.
    options = replace(_options(ask), max_strips=1, starts=("design",))
    most = min(ask.max_strips, _STRIPS)
    try:
        result = optimize(mesh, formulation="ruled", options=options, max_deviation=left)
        if result.usable:
            return result
        ruled = result.ruled
        # Strips of pieces that are not smooth come near in proportion to their number.
        if ruled is None or ruled.distances(mesh).there_max > most * left:
            return None
        options = replace(options, max_strips=most)
        result = optimize(mesh, formulation="ruled", options=options, max_deviation=left)
    except MeshError:
        return None
    return result if result.usable else None


def _shifted(side: Side, by: int) -> Side:
    return replace(side, panel=side.panel + by)


def _ruled_record(design: _Design, result: Result, ask: Ask) -> dict[str, Any]:
    ruled = result.ruled
    if ruled is None:
        raise MeshError("the solve was ended before there were strips")
    known = ruled.deviation if design.light is design.mesh else None
    away = known or ruled.distances(design.mesh)
    reasons = list(result.reasons)
    record = _record(design.mesh, ruled.mesh, ruled.pattern, ask, design.allowed, reasons)
    return record | {
        "deviation_mean": max(away.there_mean, away.back_mean),
        "deviation_max": max(away.there_max, away.back_max),
        "bend_radius_min": ruled.rulings.smallest_radius,
        "pieces": 1,
        "strips": [ruled.strips],
    }


def _of_panels(design: Mesh, panels: list[Panel], ask: Ask, allowed: float) -> dict[str, Any]:
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
    record = _record(design, mesh, Pattern.whole(mesh, flat), ask, allowed, [])
    radii = [p.radii for p in panels if len(p.radii)]
    record["bend_radius_min"] = float(np.concatenate(radii).min()) if radii else np.inf
    return record


def _record(
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
        reasons.append(f"the surface is up to {far:.4g} from the design, more than {allowed:.4g}")
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

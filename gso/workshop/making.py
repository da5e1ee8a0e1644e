"""One design made of flat panels: whole if possible, otherwise cut into pieces."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.spatial import cKDTree as Points

from gso import decimation, parametrization
from gso.errors import ConvergenceWarning, GSOError, MeshError
from gso.executors import open_executor
from gso.io.raw_surface import welded
from gso.mesh import Mesh
from gso.result import Result
from gso.seams import Segmentation
from gso.seams import pieces as search
from gso.tno import optimize
from gso.workshop import measurements
from gso.workshop.asking import Ask
from gso.workshop.designs import Design
from gso.workshop.matings import across, numbered
from gso.workshop.paneling import of_ruled, of_surface
from gso.workshop.panels import Made, Mating, Panel, Side

#: Shares of the allowed distance: what the pieces may use, and within what a strip follows its
#: piece, so that the two sides of a seam stay together.
_PIECES, _FOLLOW = 0.9, 0.1
#: Number of pieces from which on processes make their strips.
_MANY = 8
#: Distance of vertices that are merged, relative to the diagonal.
_SAME = 1e-9

#: Number of triangles that a larger design is decimated to, and the share of the allowed distance
#: within which.
_LIGHT, _NEAR = 6_000, 0.35

Say = Callable[[str], None]


@dataclass(frozen=True)
class _Target:
    """A design, the mesh that is solved in its place, and the allowed distances from both."""

    mesh: Mesh
    solved: Design
    allowed: float
    left: float

    @classmethod
    def of(cls, given: Design, allowed: float) -> _Target:
        if len(given.kept):
            return cls(given.mesh, given, allowed, allowed)
        light, away = decimation.within(given.mesh, _NEAR * allowed, _LIGHT)
        return cls(given.mesh, replace(given, mesh=light), allowed, allowed - away)


def made(given: Design, ask: Ask, say: Say = lambda said: None, workers: int | None = 0) -> Made:
    """Make a design of flat panels within what is asked, or as near to it as possible.

    A ruled surface is tried as a whole, and then in pieces; a piece that no single strip follows
    keeps the pattern of the joint solve, whose strain is within `max_strain`.

    Parameters
    ----------
    given : Design
    ask : Ask
    say : callable
        Called with what is being done.
    workers : int, optional
        Number of processes for the strips of many pieces; one for each processor when not given.
    """
    given = _welded(given)
    name, design = given.name, given.mesh
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        if ask.formulation == "flatten":
            return _checked(_flattened(given, ask, say), ask)
        own = _Target.of(given, ask.distance(design.diagonal))
        whole = None if len(given.kept) else _whole(name, own, ask, say)
        if whole is not None:
            whole = _checked(whole, ask)
        if whole is not None and not whole.reasons:
            return whole
        try:
            parted = _checked(_parted(name, own, ask, say, workers), ask)
        except GSOError:
            if whole is None:
                raise
            return whole
    if whole is None or not parted.reasons:
        return parted
    return min((whole, parted), key=lambda one: one.record["deviation_max"])


def _welded(given: Design) -> Design:
    """Join the vertices of a grid's poles, whose edges have no length."""
    mesh = given.mesh
    joined = welded(mesh, _SAME * mesh.diagonal)
    if len(joined.vertices) == len(mesh.vertices):
        return given
    ids = Points(joined.vertices).query(mesh.vertices[given.kept])[1]
    return replace(given, mesh=joined, kept=ids[ids[:, 0] != ids[:, 1]])


def _whole(name: str, design: _Target, ask: Ask, say: Say) -> Made | None:
    """Make the design of one surface; None if it is closed, or has a handle."""
    if not parametrization.flattens(design.solved.mesh):
        return None
    say(f"{name}: as a whole")
    if ask.formulation != "ruled":
        result = optimize(
            design.solved.mesh,
            formulation=ask.formulation,
            max_deviation=design.left,
            max_strain=ask.strain,
        )
        if result.pattern is None:
            return None
        record = measurements.of_pattern(
            design.mesh, result.mesh, result.pattern, ask, design.allowed
        )
        whole = of_surface(name, result.mesh, result.pattern, record)
        return _bent(replace(whole, reasons=result.reasons))
    try:
        result = optimize(
            design.solved.mesh,
            formulation="ruled",
            options=_options(ask),
            max_deviation=design.left,
        )
    except MeshError:
        return None
    record = _ruled_record(design, result, ask)
    return replace(of_ruled(name, result, record), reasons=result.reasons)


def _checked(made: Made, ask: Ask) -> Made:
    """Add the reasons against the panels."""
    return replace(made, reasons=measurements.judge(made, ask))


def _options(ask: Ask) -> Any:
    from gso.tasks.developable.ruled import Options

    return Options(strips="auto", max_strips=ask.max_strips, min_radius=ask.min_radius)


def _flattened(given: Design, ask: Ask, say: Say) -> Made:
    """Cut a design whose shape stays into pieces, as far as the strain requires."""
    name, design = given.name, given.mesh
    found = _searched(given, ask, None, say)
    pattern = found.pattern
    if pattern is None:
        raise MeshError(
            f"{name}: a piece cannot be laid flat; {'; '.join(map(str, found.reasons))}"
        )
    record = measurements.of_pattern(design, found.design, pattern, ask, None)
    whole = of_surface(name, found.design, pattern, record | {"pieces": len(found)})
    return _bent(replace(whole, reasons=found.reasons))


def _bent(made: Made) -> Made:
    """Measure the smallest radius of all panels."""
    radius = min(measurements.bend_radius(panel) for panel in made.panels)
    return replace(made, record=made.record | {"bend_radius_min": radius})


def _searched(
    given: Design, ask: Ask, allowed: float | None, say: Say, workers: int | None = 0
) -> Segmentation:
    """Search for seams; on triangles they need not follow edge rows."""
    triangles = Mesh(given.mesh.vertices, given.mesh.triangles)
    return search(
        triangles,
        max_strain=ask.strain,
        max_deviation=allowed,
        darts=ask.darts,
        sheet=ask.sheet,
        unit=ask.unit,
        keep=given.kept if len(given.kept) else None,
        workers=workers,
        callback=lambda said: say(f"{given.name}: {said}"),
    )


def _parted(name: str, design: _Target, ask: Ask, say: Say, workers: int | None) -> Made:
    """Make the design in pieces: each of them ruled where that is asked and possible."""
    share = _PIECES if ask.formulation == "ruled" else 1.0
    found = _searched(design.solved, ask, share * design.left, say, workers)
    if any(sheet is None for sheet in found.sheets):
        raise MeshError(
            f"{name}: a piece cannot be laid flat; {'; '.join(map(str, found.reasons))}"
        )
    panels: list[Panel] = []
    matings: list[Mating] = []
    owner: list[int] = []
    moved = found.opened.mesh.vertices.copy()
    strips = []
    results: list[Result | None] = [None] * len(found)
    if ask.formulation == "ruled":
        meshes = [piece.mesh for piece in found]
        results = _strips(name, meshes, ask, _FOLLOW * design.left, say, workers)
    for number, (piece, part, sheet, result) in enumerate(
        zip(found, found.parts, found.sheets, results, strict=True)
    ):
        own = f"{name}-{piece.name}" if len(found) > 1 else name
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
    record = measurements.of_panels(design.mesh, panels, ask, design.allowed)
    seams = found.opened.seams
    gap = np.linalg.norm(moved[seams[:, 0]] - moved[seams[:, 1]], axis=2).max(initial=0.0)
    record |= {"pieces": len(found), "strips": strips, "seam_gap": float(gap)}
    return _bent(Made(name, tuple(panels), numbered(matings), record, found.reasons))


def _ruled_record(design: _Target, result: Result, ask: Ask) -> dict[str, Any]:
    ruled = result.ruled
    if ruled is None:
        raise MeshError("the solve was ended before there were strips")
    known = ruled.deviation if design.solved.mesh is design.mesh else None
    away = known or ruled.distances(design.mesh)
    record = measurements.of_pattern(design.mesh, ruled.mesh, ruled.pattern, ask, design.allowed)
    return record | {
        "deviation_mean": max(away.there_mean, away.back_mean),
        "deviation_max": max(away.there_max, away.back_max),
        "bend_radius_min": ruled.rulings.smallest_radius,
        "pieces": 1,
        "strips": [ruled.strips],
    }


def _strips(
    name: str, meshes: Sequence[Mesh], ask: Ask, left: float, say: Say, workers: int | None
) -> list[Result | None]:
    """Make pieces of one strip each, where that is usable within the distance."""
    out: list[Result | None] = [None] * len(meshes)
    # Starting processes takes as long as a few strips.
    workers = workers if len(meshes) >= _MANY else 0
    work = partial(_strip, ask, left)
    with open_executor(workers) as executor:
        for count, done in enumerate(executor.as_completed(work, meshes), start=1):
            out[done.index] = done.result
            say(f"{name}: strip {count} of {len(meshes)}")
    return out


def _strip(ask: Ask, left: float, mesh: Mesh) -> Result | None:
    """Make a piece of one strip; None if that is not usable within the distance."""
    # The piece is developable already: its own normals give the rulings.
    options = replace(_options(ask), max_strips=1, starts=("design",))
    try:
        result = optimize(mesh, formulation="ruled", options=options, max_deviation=left)
    except MeshError:
        return None
    return result if result.usable else None


def _shifted(side: Side, by: int) -> Side:
    return replace(side, panel=side.panel + by)

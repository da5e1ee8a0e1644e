"""Panels of a design of which parts are developable as they are, and the others are changed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from gso import metrics
from gso.cut_pieces import Pieces
from gso.exact import developable_parts
from gso.mesh import Mesh
from gso.mesh.cut import cut
from gso.mesh.topology import edge_keys, pair_keys
from gso.seams.kinds import edges_between
from gso.seams.seam_request import faces_within
from gso.typing import Ints, Json
from gso.verdict import compare
from gso.verdict.surface_checks import crossed
from gso.workshop.designs import Design
from gso.workshop.fabrication_settings import FabricationSettings
from gso.workshop.matings import across, numbered
from gso.workshop.panels import Made, Panel, Side

#: Largest number of parts that a design is divided into.
_MANY = 12

_Make = Callable[[Design, FabricationSettings], Made | None]


def mixed(given: Design, settings: FabricationSettings, keep: _Make, change: _Make) -> Made | None:
    """Keep the developable parts of a design between sharp edges, and change the others.

    Parameters
    ----------
    given : Design
    settings : FabricationSettings
    keep, change : callable
        Make panels of a part that stays, and of one that is changed.

    Returns
    -------
    Made or None
        Its reasons are those of the crossings of the design and of its changed parts. None if it
        has no such parts, or they cannot be made.
    """
    mesh = given.mesh
    avoided = np.isin(np.arange(len(mesh.faces)), given.avoid)
    if mesh.grid_index is not None:
        mesh = Mesh(mesh.vertices, mesh.triangles)
        avoided = faces_within(given.mesh, given.avoid, mesh)
    kept = developable_parts(mesh, settings.strain)
    if not kept.any() or kept.all():
        return None
    pieces = Pieces(mesh, cut(mesh, edges_between(mesh, kept)))
    if len(pieces) > _MANY:
        return None
    own = replace(settings, max_deviation=settings.distance(mesh.diagonal))
    some: list[Made] = []
    for piece in pieces:
        local = np.full(len(mesh.vertices), -1)
        local[piece.vertices] = np.arange(len(piece.vertices))
        keys = pair_keys(piece.mesh.edges, len(local))
        kept_edges, along = (
            edges[np.isin(pair_keys(edges, len(local)), keys)]
            for edges in (local[given.kept], local[given.along])
        )
        part = replace(
            given,
            name=f"{given.name}-{piece.name}",
            mesh=piece.mesh,
            kept=kept_edges,
            along=along,
            avoid=np.flatnonzero(avoided[piece.faces]),
        )
        made = (keep if kept[piece.faces[0]] else change)(part, own)
        if made is None:
            return None
        some.append(made)
    panels = [panel for made in some for panel in made.panels]
    first = np.cumsum([0, *(len(made.panels) for made in some)]).tolist()
    matings = [
        replace(seam, one=_moved(seam.one, k), two=_moved(seam.two, k))
        for made, k in zip(some, first, strict=False)
        for seam in made.matings
    ]
    sides = [side for seam in matings for side in (seam.one, seam.two)]
    rims = [_rim(panel, [s for s in sides if s.panel == k]) for k, panel in enumerate(panels)]
    owner = np.repeat(np.arange(len(some)), np.diff(first)).tolist()
    joints = across(pieces, owner, panels, rims)
    gaps = [
        float(np.linalg.norm(np.subtract(*points), axis=1).max())
        for seam in joints
        if (points := [s.on(panels[s.panel].surface.vertices) for s in (seam.one, seam.two)])
    ]
    record = _record(given.mesh, settings, [made.record for made in some])
    record["seam_gap"] = max([*gaps, *(made.record.get("seam_gap", 0.0) for made in some)])
    reasons = [reason for made in some for reason in made.reasons]
    return Made(
        given.name,
        tuple(panels),
        numbered([*matings, *joints]),
        record,
        (*compare(crossed(given.mesh), {}), *reasons),
    )


def _moved(side: Side, first: int) -> Side:
    return replace(side, panel=side.panel + first)


def _rim(panel: Panel, seams: Sequence[Side]) -> Ints:
    """Return the edges of a panel's outline that are no seam."""
    count, rim = len(panel.flat), panel.rim
    known = [np.empty(0, np.int64)]
    for side in seams:
        ends = side.edges[:, 0]
        known += [edge_keys(ends[:-1], ends[1:], count), edge_keys(ends, side.edges[:, 1], count)]
    return rim[~np.isin(pair_keys(rim, count), np.concatenate(known))]


def _record(design: Mesh, settings: FabricationSettings, some: Sequence[Json]) -> Json:
    """Return what was measured on all parts together."""
    areas = [one["area"] for one in some]
    far = max(some, key=lambda one: one["deviation_max"])
    creases = [one["crease_angle_max"] for one in some if "crease_angle_max" in one]
    worst = ("deviation_max", "strain_max", "strain_p99", "planarity_max")
    return {
        **far,
        **{name: max(one[name] for one in some) for name in worst},
        **{name: sum(one[name] for one in some) for name in ("overlaps", "inverted", "pieces")},
        "area": metrics.area(design),
        "diagonal": design.diagonal,
        "size": design.size,
        "allowed": settings.distance(design.diagonal),
        "deviation_mean": float(np.average([one["deviation_mean"] for one in some], weights=areas)),
        "curvature": np.max([one["curvature"] for one in some], axis=0).tolist(),
        "strips": [number for one in some for number in one["strips"]],
        "bend_radius_min": min(one["bend_radius_min"] for one in some),
        **({"crease_angle_max": max(creases)} if creases else {}),
    }

"""What the page of a job shows, as a dictionary: panels in place and flat, values, seams, parts.

It is made of what was made (:class:`gso.workshop.panels.Made`), so that it does not depend on the
command that made it. ``web/src/data.js`` reads it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gso import metrics, rulings
from gso.errors import MeshError
from gso.geometry.rigid import closest_motion
from gso.io.json_file import plain
from gso.mesh import Mesh
from gso.mesh.view import pale_colours
from gso.pattern import Bend
from gso.typing import Array, Json
from gso.workshop.assembly_view import short, sides
from gso.workshop.joining import Step, order_of_joining
from gso.workshop.page_arrays import Arrays
from gso.workshop.panels import Made, Mating, Panel
from gso.workshop.part import Part

#: Values at the vertices of panels that a page can show as colours: unit, and what it is.
VALUES = {
    "deviation": ("mm", "distance from the design"),
    "strain": ("%", "change of lengths between surface and pattern"),
    "curvature": ("1/m²", "Gaussian curvature: 0 where the surface is developable"),
    "bending": ("1/m", "largest curvature in any direction: one over the radius"),
}
_SHARE, _METRE = 100.0, 1000.0
#: Relative difference up to which values are one.
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Shown:
    """A made design as a page shows it.

    Attributes
    ----------
    made : Made
    design : Mesh
        What it was made of, in the same unit.
    scale : float
        Millimetres per unit of length.
    panels : tuple of Panel
        Its panels with the angles and radii that are drawn, in millimetres.
    copies : tuple of Mesh
        Designs that are made the same, the design itself included.
    """

    made: Made
    design: Mesh
    scale: float
    panels: tuple[Panel, ...]
    copies: tuple[Mesh, ...] = ()

    @cached_property
    def steps(self) -> list[Step]:
        """The order in which the panels are joined."""
        return order_of_joining(self.made)


def data_for_page(shown: Sequence[Shown], parts: Sequence[Part], certificate: Json) -> Json:
    """Describe designs and their parts for the page; lengths in millimetres.

    Parameters
    ----------
    shown : sequence of Shown
        Designs that were made.
    parts : sequence of Part
        What is drawn, one of each kind.
    certificate : dict
        Whose ``designs`` have the records of parts; those of `shown` are found by their names.

    Returns
    -------
    dict
        JSON-compatible but for ``arrays``: bytes with the numbers, in which the entries ``at``,
        ``count`` and ``columns`` say where an array is. ``designs`` have ``name``,
        ``mesh`` and ``motions``; ``panels`` their design, their part, ``points`` in place,
        ``flat`` (it and the part are None without a pattern), ``triangles``, edges of ``rim`` and
        ``bends``, and ``values`` at the points; ``seams`` the two panels, lengths and ``line``;
        ``parts`` what the certificate says; ``steps`` the order of joining; ``view`` the axes of
        the view from the front: right, up, towards the viewer are its columns.
    """
    arrays = Arrays()
    records = {one["name"]: one for one in certificate["designs"]}
    number = {part.name: k for k, part in enumerate(parts)}
    out: Json = {"designs": [], "panels": [], "seams": [], "steps": []}
    entries: list[Json] = [{} for _ in parts]
    count = sum(len(one.panels) for one in shown)
    colours = (255 * pale_colours(count)).round().astype(int).tolist()
    for k, one in enumerate(shown):
        first = len(out["panels"])
        bare = [{"name": panel.name, "same_as": None} for panel in one.panels]
        own = records[one.made.name].get("parts") or bare
        out["designs"].append(_design(one, arrays))
        for panel, values, entry in zip(one.panels, _values(one), own, strict=True):
            part = number.get(entry["same_as"] or entry["name"])
            out["panels"].append(
                {
                    "name": panel.name,
                    "short": short(panel.name, one.made.name),
                    "design": k,
                    "part": part,
                    "colour": colours[len(out["panels"])],
                    **_panel(panel, one.scale, arrays),
                    "values": {name: _value(arrays, x) for name, x in values.items()},
                }
            )
            if part is not None and entry["same_as"] is None:
                entries[part] = {k: x for k, x in entry.items() if k != "joined"}
        out["seams"] += [_seam(one, seam, k, first, arrays) for seam in one.made.matings]
        out["steps"] += [
            {"panel": first + step.panel, "design": k, "seams": [*step.closed, *step.seams]}
            for step in one.steps
        ]
    if out["panels"]:
        every = [panel for one in shown for panel in one.made.panels]
        out["view"] = sides(every)[0].axes.tolist()
    out["parts"] = [
        entry | {"bends": [_bend(bend) for bend in part.bends]}
        for entry, part in zip(entries, parts, strict=True)
    ]
    out["values"] = {name: {"unit": unit, "text": said} for name, (unit, said) in VALUES.items()}
    data: Json = plain(out)
    return data | {"arrays": arrays.content()}


def _design(one: Shown, arrays: Arrays) -> Json:
    mesh = one.design
    motions = [closest_motion(mesh.vertices, copy.vertices) for copy in one.copies]
    return {
        "name": one.made.name,
        "mesh": {
            "points": arrays.quantised(one.scale * mesh.vertices),
            "triangles": arrays.indices(mesh.triangles),
        },
        # Rows of rotations, each with its shift.
        "motions": [
            np.c_[turn, one.scale * shift].tolist() for turn, shift in motions or [_still()]
        ],
    }


def _still() -> tuple[Array, Array]:
    return np.eye(3), np.zeros(3)


def _panel(panel: Panel, scale: float, arrays: Arrays) -> Json:
    """Describe the shape of a panel, whose bends are in millimetres and whose surface is not."""
    return {
        "points": arrays.quantised(scale * panel.surface.vertices),
        "flat": arrays.quantised(panel.flat) if panel.has_pattern else None,
        "triangles": arrays.indices(panel.surface.triangles),
        "rim": arrays.indices(panel.rim),
        "bends": arrays.indices(panel.bends.reshape(-1, 2)),
        "angles": np.degrees(panel.angles).round(3).tolist(),
        "radii": [_short_number(r) for r in panel.radii],
    }


def _values(one: Shown) -> list[dict[str, Array]]:
    """Return the values of :data:`VALUES` at the vertices of each panel; NaN where unknown."""
    panels = one.made.panels
    points = [panel.surface.vertices for panel in panels]
    if one.made.record.get("deviation_max") == 0.0:
        away = [np.zeros(len(x)) for x in points]
    else:
        every = metrics.point_to_surface(np.concatenate(points), one.design)
        away = np.split(one.scale * every, np.cumsum([len(x) for x in points])[:-1])
    out = []
    for panel, far in zip(panels, away, strict=True):
        surface, scale = panel.surface, one.scale / _METRE
        out.append(
            {
                "deviation": far,
                "strain": _strain(panel),
                "curvature": metrics.worst_curvature(surface) / scale**2,
                "bending": _largest(surface, _bending(surface)) / scale,
            }
        )
    return out


def _strain(panel: Panel) -> Array:
    """Return the largest strain at the vertices of a panel, in per cent; NaN without a pattern."""
    surface = panel.surface
    if not panel.has_pattern:
        return np.full(len(surface.vertices), np.nan)
    return _SHARE * _largest(surface, metrics.face_strains(surface, panel.flat))


def _bending(surface: Mesh) -> Array:
    """Return the largest absolute curvature of every face, in one over the unit."""
    try:
        return np.asarray(np.abs(rulings.shape_operator(surface).curvatures).max(axis=1))
    except MeshError:
        return np.full(len(surface.faces), np.nan)


def _largest(mesh: Mesh, values: Array) -> Array:
    """Return the largest value of the faces around each vertex, so that none is lost."""
    out = np.full(len(mesh.vertices), np.nan)
    rows, corner = np.nonzero(mesh.faces >= 0)
    np.fmax.at(out, mesh.faces[rows, corner], values[rows])
    return out


def _value(arrays: Arrays, values: Array) -> Json | float | None:
    """Describe values at vertices: one number where they are all the same."""
    if not np.isfinite(values).any():
        return None
    if np.isfinite(values).all() and np.ptp(values) <= _SAME * np.abs(values).max():
        return _short_number(float(values.mean()))
    return arrays.quantised(values)


def _seam(one: Shown, seam: Mating, design: int, first: int, arrays: Arrays) -> Json:
    """Describe a seam; ``line`` has the points of both sides, the first one's first."""
    panels = one.made.panels
    sides = [side.on(panels[side.panel].surface.vertices) for side in (seam.one, seam.two)]
    return {
        "number": seam.number,
        "mark": seam.kind or seam.number,
        "design": design,
        "panels": [first + seam.one.panel, first + seam.two.panel],
        "length": one.scale * seam.length,
        "mismatch": seam.mismatch(one.panels),
        "gap": one.scale * float(np.linalg.norm(sides[0] - sides[1], axis=1).max()),
        "angle": float(np.degrees(seam.angle)),
        "line": arrays.quantised(one.scale * np.concatenate(sides)),
    }


def _bend(bend: Bend) -> list[float | None]:
    """Describe a bend that is drawn: its angle in degrees and its radius in millimetres."""
    return [
        round(float(np.degrees(bend.angle)), 3),
        _short_number(bend.radius),
    ]


def _short_number(value: float) -> float | None:
    """Return a number with five digits; None if it is not finite."""
    return float(f"{value:.5g}") if np.isfinite(value) else None

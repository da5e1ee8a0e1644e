"""Panels of surfaces that are flat or developable as they are, bent and rolled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gso.errors import OptionError
from gso.exact import FoldedPattern, folded_pattern
from gso.geometry.ears import divided
from gso.mesh import Mesh
from gso.recognition import Recognised
from gso.result import Result
from gso.typing import Ints, Json
from gso.verdict import compare
from gso.verdict.surface_checks import crossed
from gso.workshop import measurements
from gso.workshop.designs import Design
from gso.workshop.fabrication_settings import FabricationSettings
from gso.workshop.panels import Made
from gso.workshop.pattern_panels import of_surface

#: Inner radius, relative to the thickness, up to which bends are bent by a press.
_PRESSED = 5.0


def exact_panels(
    given: Design, settings: FabricationSettings, *, rows: bool = False
) -> Made | None:
    """Unfold a design that is flat or developable as it is; None if it is not.

    Parameters
    ----------
    given : Design
    settings : FabricationSettings
    rows : bool
        As of :func:`gso.exact.folded_pattern`.
    """
    found = _folded(given, given.mesh, settings, rows=rows)
    if found is None:
        return None
    allowed = settings.distance(given.mesh.diagonal)
    record = measurements.of_pattern(
        given.mesh, found.surface, found.pattern, settings, allowed, is_kept=True
    )
    record |= {"pieces": found.parts, "thickness": given.sheet}
    one = _of_folded(given.name, found, record, _cad_faces(given.mesh, found.recognised))
    panels = tuple(replace(panel, is_kept=True) for panel in one.panels)
    one = replace(one, panels=panels, reasons=compare(crossed(given.mesh), {}))
    return measurements.checked(measurements.bent(one), settings)


def rolled(
    given: Design, result: Result, record: Json, settings: FabricationSettings
) -> Made | None:
    """Make panels that are rolled of rings with facets; None where that is not possible.

    Parameters
    ----------
    given : Design
    result : Result
        Strips near the design.
    record : dict
        What was measured of them.
    settings : FabricationSettings
    """
    # These import SciPy.
    from gso.ruled.paneling.ring_strips import REVOLUTION
    from gso.seams.kinds import edges_between

    surface = result.ruled
    if surface is None or result.details.get("rulings_from") != REVOLUTION or len(given.kept):
        return None
    points, faces = surface.mesh.vertices, surface.mesh.faces
    triangles, owner = divided([face[face >= 0] for face in faces], points)
    mesh = Mesh(points, triangles)
    part = surface.strip[owner]
    apart = replace(given, kept=edges_between(mesh, part))
    found = _folded(apart, mesh, settings, parts=part)
    if found is None or found.parts != surface.strips:
        return None
    far = record["deviation_max"] + found.recognised.chord
    if far > record["allowed"]:
        return None
    names: list[tuple[str, ...]] = [()] * len(found.recognised.faces)
    return _of_folded(given.name, found, record | {"deviation_max": far}, names)


def _folded(
    given: Design,
    surface: Mesh,
    settings: FabricationSettings,
    *,
    rows: bool = False,
    parts: Ints | None = None,
) -> FoldedPattern | None:
    """Unfold a surface, which is a design or near it; None if it is not developable."""
    try:
        return folded_pattern(
            surface,
            max_strain=settings.strain,
            cut=given.kept,
            keep=given.uncut,
            sheet=settings.max_size or settings.page,
            # Those than a page are divided in the PDF; a sheet must be large enough.
            larger=settings.max_size is None,
            bend_step=settings.bend_step,
            unit=settings.unit,
            press_radius=_press_radius(given, settings),
            rows=rows,
            parts=parts,
        )
    except OptionError:
        # A face is larger than the sheet.
        if len(given.uncut):
            raise
        return None


def _of_folded(
    name: str, found: FoldedPattern, record: Json, names: Sequence[tuple[str, ...]]
) -> Made:
    """Make panels of the faces of a surface, which have the names of faces in a CAD file."""
    # By the equations of the faces: chords of the mesh are shorter than the arcs of the pattern.
    strains = {"strain_max": found.strain, "strain_p99": found.strain}
    drawn = (found.bends, found.zones, found.seam_angles, (found.face, names))
    return of_surface(name, found.surface, found.pattern, record | strains, *drawn)


def _cad_faces(mesh: Mesh, shape: Recognised) -> list[tuple[str, ...]]:
    """Return the names in a CAD file of what each face consists of: the given ones if there are."""
    said = mesh.attributes
    if said is None or said.surfaces is None:
        return [()] * len(shape.faces)
    given, labels = said.surfaces.of_face, said.labels.get("g")
    names = [surface.name for surface in said.surfaces.surfaces]
    if labels is not None:
        for number, first in zip(*np.unique(given, return_index=True), strict=True):
            label = int(labels.of_face[first])
            names[number] = (labels.names[label] if label >= 0 else "") or names[number]
    own = (np.unique(given[shape.source[face.triangles]]).tolist() for face in shape.faces)
    return [tuple(names[k] for k in numbers) for numbers in own]


def _press_radius(given: Design, settings: FabricationSettings) -> tuple[float, float] | None:
    """Return the largest radii of mountain and valley bends that a press bends at one line."""
    if given.sheet is not None:
        return (_PRESSED + 1) * given.sheet, _PRESSED * given.sheet
    return None if settings.press is None else (_PRESSED * settings.press,) * 2

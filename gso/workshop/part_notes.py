"""Notes on parts that can be made, but that a workshop should look at before."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.typing import Json
from gso.workshop.fabrication_settings import FabricationSettings
from gso.workshop.panels import Panel

#: Distance of outlines from smooth curves that a note is made of, relative to the design's size.
_COARSE = 5e-4


def strip_notes(panels: Sequence[Panel], record: Json) -> list[str]:
    """Return notes on the strips of a design: folds, tight bends, steep creases, small parts.

    Parameters
    ----------
    panels : sequence of Panel
        With patterns in millimetres.
    record : dict
        Of the design, in millimetres.
    """
    if "crease_angle_max" not in record:
        return []
    from gso.ruled.paneling.shop_notes import said

    angles = np.concatenate([panel.angles for panel in panels])
    radii = np.concatenate([panel.radii for panel in panels])
    areas = [part["area"] for part in record["parts"]]
    small = 100.0 * min(areas) / sum(areas)
    return list(said(angles, radii, record["size"], record["crease_angle_max"], small, "mm"))


def outline_notes(record: Json) -> list[str]:
    """Return a note on outlines that are coarse polygons."""
    far = max(part["chord"] for part in record["parts"])
    if far <= _COARSE * record["size"]:
        return []
    return [
        f"outlines are polygons, up to {far:.3g} mm from smooth curves through their corners; a "
        "finer design has finer outlines"
    ]


def guide_notes(records: Sequence[Json], settings: FabricationSettings) -> list[str]:
    """Return a note on parts without bend lines."""
    every = [part for record in records for part in record.get("parts", ())]
    guided = [part["guide_angle_max"] for part in every if part["guide_lines"]]
    if not guided:
        return []
    why = ": no strip follows them closely enough" if settings.formulation == "ruled" else ""
    return [
        f"{len(guided)} of {len(every)} parts are curved and have no bend lines{why}; their guide "
        f"lines, along which they are curved least, are up to {max(guided):.2g} degrees from "
        "straight"
    ]

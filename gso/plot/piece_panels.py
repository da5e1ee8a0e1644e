"""Panels of a design in pieces, and of their patterns, in the same colours."""

from __future__ import annotations

import colorsys

import numpy as np

from gso.plot.draw import GRAZING, Panel
from gso.plot.view import View
from gso.seams.segmentation import Segmentation, whole_pattern
from gso.typing import Array


def pieces(found: Segmentation) -> list[Panel]:
    """Make panels of the surface with its seams, of its other side, and of the patterns."""
    view = View.of(found.design)
    behind = View(view.frame, view.axes * np.array([-1.0, 1.0, -1.0]))
    colours = _colours(len(found))
    surface = found.design
    panels = []
    for side, title in ((view, _title(found)), (behind, "from behind")):
        panel = Panel(side.project(surface.vertices), surface.faces, title, light=GRAZING)
        panel.tint = colours[found.of_face]
        panel.lines = list(panel.points[found.edges])
        panels.append(panel)
    own = [k for k, sheet in enumerate(found.sheets) if sheet is not None]
    if own:
        mesh, flat = whole_pattern(found)
        points = (flat - 0.5 * (flat.min(axis=0) + flat.max(axis=0))) / np.ptp(flat, axis=0).max()
        wide = float(np.ptp(panels[0].points[:, :2], axis=0).max())
        sheet = Panel(np.pad(wide * points, ((0, 0), (0, 1))), mesh.faces, shaded=False)
        count = [len(found.sheets[k].mesh.faces) for k in own]  # type: ignore[union-attr]
        sheet.tint = np.repeat(colours[own], count, axis=0)
        sheet.title = "patterns (not at the same scale)"
        panels.append(sheet)
    return panels


def _title(found: Segmentation) -> str:
    count = len(found)
    return f"{count} piece{'s' if count > 1 else ''}, seam {found.seam_length:.3g}"


def _colours(count: int) -> Array:
    """Return pale colours of even brightness, far apart for neighbouring numbers."""
    hue = (0.58 + 0.618034 * np.arange(count)) % 1.0
    return np.array([colorsys.hls_to_rgb(h, 0.74, 0.45) for h in hue]).reshape(-1, 3)

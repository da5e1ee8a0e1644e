"""Panels of a ruled surface, with its rulings and creases, and of its pattern with bend lines."""

from __future__ import annotations

import numpy as np

from gso.mesh import Mesh
from gso.plot.draw import GRAZING, Panel, facing
from gso.plot.view import View
from gso.ruled.ruled_surface import RuledSurface
from gso.typing import Array

#: Colours of neighbouring strips, and of flat regions.
_STRIPS = np.array([(0.60, 0.71, 0.82), (0.78, 0.83, 0.72)])
_FLAT = np.array((0.93, 0.78, 0.55))


def strips(design: Mesh, surface: RuledSurface) -> list[Panel]:
    """Make panels of the design, of the strips near it, and of their pattern.

    Strips have two colours in turn, and flat regions a third. Lines are rulings and creases, and
    bend lines in the pattern.
    """
    view, mesh = View.of(design), surface.mesh
    before = Panel(view.project(design.vertices), design.faces, "design", light=GRAZING)
    tint = np.where(surface.flat[:, None], _FLAT, _STRIPS[surface.strip % len(_STRIPS)])
    far = surface.distances(design)
    share = 100.0 * max(far.there_max, far.back_max) / design.diagonal
    after = Panel(view.project(mesh.vertices), mesh.faces, tint=tint)
    parts = surface.strips
    after.title = f"{parts} strip{'s' if parts > 1 else ''}, largest distance {share:.2g} %"
    edges = np.concatenate([surface.rulings.edges, surface.creases.edges])
    after.lines = list(after.points[edges])
    flat = surface.pattern.flat
    seen = after.points[surface.pattern.vertex]
    turn = facing(flat, seen) if parts == 1 else 1.0
    points = _placed(flat, turn) / design.frame.scale
    sheet = Panel(points, surface.pattern.faces, shaded=False, tint=tint)
    sheet.title = "exact pattern with its bend lines"
    middle = flat.mean(axis=0)
    sheet.lines = [
        _placed(bend.line - middle, turn, fixed=True) / design.frame.scale for bend in surface.bends
    ]
    return [before, after, sheet]


def _placed(flat: Array, turn: complex, *, fixed: bool = False) -> Array:
    z = (flat if fixed else flat - flat.mean(axis=0)) @ np.array([1.0, 1j]) * turn
    return np.stack([z.real, z.imag, np.zeros(len(z))], axis=1)

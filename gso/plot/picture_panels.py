"""Panels of pictures: surfaces in pieces, with ruling lines, or of strips; and their patterns."""

from __future__ import annotations

import numpy as np

from gso import geometry
from gso.components import largest_first
from gso.mesh import Mesh
from gso.mesh.view import GRAZING, View, pale_colours
from gso.pattern import Pattern
from gso.plot.draw import Panel, facing, turned
from gso.ruled.ruled_surface import RuledSurface
from gso.rulings import gauss_image, shape_operator, trace
from gso.seams.segmentation import Segmentation, whole_pattern
from gso.typing import Array, Ints
from gso.unfolding import Net

#: Pixels along a picture in which parts are looked for.
_PIXELS = 300
#: Colours of neighbouring strips, and of flat regions.
_STRIPS = np.array([(0.60, 0.71, 0.82), (0.78, 0.83, 0.72)])
_FLAT = np.array((0.93, 0.78, 0.55))


def ruled(mesh: Mesh, view: View, count: int) -> Panel:
    """Make a panel of the surface with up to `count` ruling lines."""
    rulings = trace(mesh, count=count)
    panel = Panel(view.project(mesh.vertices), mesh.faces)
    panel.lines = [view.project(line) for line in rulings.lines]
    panel.title = "no rulings: the surface is flat"
    if len(rulings):
        panel.title = f"rulings, off straight by {100 * rulings.straightness.mean():.2g} %"
    return panel


def gauss(mesh: Mesh, view: View, name: str = "Gauss image") -> Panel:
    """Make a panel of the surface's Gauss image, seen from the same side as the surface."""
    panel = Panel(gauss_image(mesh) @ view.axes, mesh.faces, shaded=False, circle=1.0)
    panel.title = f"{name}, thickness {shape_operator(mesh).thickness:.2g}"
    return panel


def strips(design: Mesh, surface: RuledSurface) -> list[Panel]:
    """Make panels of the design, of the strips near it, and of their pattern.

    Strips have two colours in turn, and flat regions a third. Lines are rulings and creases, and
    bend lines in the pattern.
    """
    view, mesh = View.of(design), surface.mesh
    before = Panel(view.project(design.vertices), design.faces, "design", light=GRAZING)
    tint = np.where(surface.flat[:, None], _FLAT, _STRIPS[surface.strip % len(_STRIPS)])
    far = surface.distances(design)
    share = 100.0 * far.largest / design.diagonal
    after = Panel(view.project(mesh.vertices), mesh.faces, tint=tint)
    parts = surface.strips
    after.title = f"{parts} strip{'s' if parts > 1 else ''}, largest distance {share:.2g} %"
    edges = np.concatenate([surface.rulings.edges, surface.creases.edges])
    after.lines = list(after.points[edges])
    number = part_numbers(surface.pattern)
    after.names = _named(after, number)
    flat = surface.pattern.flat
    seen = after.points[surface.pattern.vertex]
    turn = facing(flat, seen) if parts == 1 else 1.0
    middle, size = flat.mean(axis=0), design.frame.scale
    points = turned(flat - middle, turn) / size
    sheet = Panel(points, surface.pattern.faces, shaded=False, tint=tint)
    sheet.title = "exact pattern with its bend lines"
    sheet.names = _named(sheet, number)
    sheet.lines = [turned(bend.line - middle, turn) / size for bend in surface.bends]
    return [before, after, sheet]


def part_numbers(pattern: Pattern) -> Ints:
    """Return the number of the part that each face of a pattern is in: from 1, the largest first.

    These are the numbers of parts in the files of ``gso fabricate``.
    """
    out = np.empty(len(pattern.faces), np.int64)
    for number, part in enumerate(largest_first(pattern.mesh)):
        out[part.faces] = number + 1
    return out


def _named(panel: Panel, number: Ints) -> list[tuple[str, Array]]:
    """Return the numbers of parts, each where there is most room on what is seen of it."""
    low, high = panel.points[:, :2].min(axis=0), panel.points[:, :2].max(axis=0)
    scale = _PIXELS / float((high - low).max())
    placed = panel.points.copy()
    placed[:, :2] -= low
    corners = panel.corners
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    wide, tall = (int(np.ceil(side)) for side in scale * (high - low))
    seen, _ = geometry.nearest_triangles(scale * placed[triangles], (tall + 1, wide + 1))
    owner = np.where(seen >= 0, np.tile(number, 2)[seen], -1)
    return [(str(k), low + at / scale) for k, at in geometry.roomiest_pixels(owner).items()]


def pieces(found: Segmentation) -> list[Panel]:
    """Make panels of the surface with its seams, of its other side, and of the patterns."""
    view = View.of(found.design)
    colours = pale_colours(len(found))
    surface = found.design
    panels = []
    for side, title in ((view, _title(found)), (view.behind, "from behind")):
        panel = Panel(side.project(surface.vertices), surface.faces, title, light=GRAZING)
        panel.tint = colours[found.of_face]
        panel.lines = list(panel.points[found.edges])
        names = _named(panel, found.of_face)
        panel.names = [(found.name(int(k)), at) for k, at in names]
        panels.append(panel)
    own = [k for k, sheet in enumerate(found.sheets) if sheet is not None]
    if own:
        mesh, flat, _ = whole_pattern(found)
        points = (flat - 0.5 * (flat.min(axis=0) + flat.max(axis=0))) / np.ptp(flat, axis=0).max()
        wide = float(np.ptp(panels[0].points[:, :2], axis=0).max())
        sheet = Panel(np.pad(wide * points, ((0, 0), (0, 1))), mesh.faces, shaded=False)
        count = [len(found.sheets[k].mesh.faces) for k in own]  # type: ignore[union-attr]
        sheet.tint = np.repeat(colours[own], count, axis=0)
        sheet.title = "patterns (not at the same scale)"
        panels.append(sheet)
    return panels


def net(found: Net) -> list[Panel]:
    """Make panels of the surface of a net from both sides, and of its parts."""
    mesh, flat = found.mesh, found.pattern.flat
    view, tint = View.of(mesh), pale_colours(len(found))[found.part]
    panels = []
    for side, title in ((view, f"{len(found.cut_edges)} edges cut"), (view.behind, "from behind")):
        panel = Panel(side.project(mesh.vertices), mesh.faces, title, tint=tint, light=GRAZING)
        panel.lines = list(panel.points[found.cut_edges])
        panels.append(panel)
    size = mesh.frame.scale
    points = np.pad((flat - flat.mean(axis=0)) / size, ((0, 0), (0, 1)))
    sheet = Panel(points, found.pattern.faces, shaded=False, tint=tint)
    sheet.title = f"{len(found)} part{'s' if len(found) > 1 else ''} with fold lines"
    sheet.lines = list(points[found.folds.edges])
    return [*panels, sheet]


def _title(found: Segmentation) -> str:
    count = len(found)
    return f"{count} piece{'s' if count > 1 else ''}, seam {found.seam_length:.3g}"

"""Panels of a surface with its ruling lines, and of its Gauss image."""

from __future__ import annotations

from gso.mesh import Mesh
from gso.plot.draw import Panel
from gso.plot.view import View
from gso.rulings import gauss_image, shape_operator, trace


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

"""Paint surfaces side by side.

Faces are painted from back to front, each in the colour of its value times its shading.
That is faster than Matplotlib's own 3D axes and keeps the proportions.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gso.io import check_writable, replacing
from gso.plot.heat import Heat, Scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

SUFFIXES = (".png", ".pdf", ".svg")
"""Suffixes of the pictures that are written."""

LIGHT = np.array([-0.40, 0.45, 0.80])
"""Where the light comes from: right, up, towards the viewer."""

GRAZING = np.array([-0.85, 0.45, 0.28])
"""Light along the surface, which shows every bump."""

_PLAIN = (0.60, 0.71, 0.82)
_UNKNOWN = (0.80, 0.80, 0.80)

#: Inches of a panel; faces up to which the mesh lines leave something between them.
_WIDTH, _BAR = 4.0, 1.0
_LINES = 2500


@dataclass
class Panel:
    """One surface of a picture.

    Attributes
    ----------
    points : ndarray, (n, 3)
        Vertices: right, up, and towards the viewer.
    faces : ndarray of int, (m, 3) or (m, 4)
        Faces as in :class:`gso.Mesh`.
    title : str
        Text above.
    heat : Heat, optional
        What colours the faces.
    light : ndarray, (3,)
        Where the light comes from.
    shaded : bool
        Shade the faces by their normals.
    """

    points: Array
    faces: NDArray[np.int64]
    title: str = ""
    heat: Heat | None = None
    light: Array = field(default_factory=lambda: LIGHT)
    shaded: bool = True

    @property
    def corners(self) -> NDArray[np.int64]:
        """Faces (m, 4); a triangle repeats its first corner."""
        first, last = self.faces[:, :1], self.faces[:, 3:]
        return np.c_[self.faces[:, :3], np.where(last < 0, first, last) if last.size else first]


def draw(panels: Sequence[Panel]) -> Figure:
    """Panels in a row, with one colour bar per scale."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    sizes = [np.ptp(p.points[np.unique(p.corners), :2], axis=0) for p in panels]
    tallest = max(size[1] / size[0] for size in sizes)
    height = _WIDTH * float(np.clip(tallest, 0.35, 1.3)) + _BAR
    figure = Figure(figsize=(_WIDTH * len(panels), height), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(1, len(panels), squeeze=False)[0]
    bars: dict[Scale, tuple[ScalarMappable, list[Axes]]] = {}
    for ax, panel in zip(axes, panels, strict=True):
        mappable = _paint(ax, panel)
        if panel.heat is not None and mappable is not None:
            bars.setdefault(panel.heat.scale, (mappable, []))[1].append(ax)
    for scale, (mappable, owners) in bars.items():
        figure.colorbar(
            mappable,
            ax=owners,
            location="bottom",
            label=scale.label,
            extend=scale.extend,
            shrink=0.7 / len(owners),
            aspect=28,
            pad=0.02,
        )
    return figure


def _paint(ax: Any, panel: Panel) -> ScalarMappable | None:
    """Paint the faces; what a colour bar is made from."""
    from matplotlib.collections import PolyCollection

    corners = panel.corners
    colours, mappable = _colours(panel)
    order = np.argsort(panel.points[corners, 2].mean(axis=1))
    colours = colours[order]
    few = len(corners) <= _LINES
    faces = PolyCollection(
        list(panel.points[corners[order], :2]),
        facecolors=colours,
        edgecolors=0.72 * colours if few else colours,
        linewidths=0.35,
        rasterized=not few,
    )
    ax.add_collection(faces)
    used = panel.points[np.unique(corners), :2]
    low, high = used.min(axis=0), used.max(axis=0)
    margin = 0.03 * (high - low).max()
    ax.set_xlim(low[0] - margin, high[0] + margin)
    ax.set_ylim(low[1] - margin, high[1] + margin)
    ax.set_aspect("equal")
    ax.set_title(panel.title, fontsize=11)
    ax.axis("off")
    return mappable


def _colours(panel: Panel) -> tuple[Array, ScalarMappable | None]:
    """Colour of every face (m, 3)."""
    mappable = None
    colours = np.tile(_PLAIN, (len(panel.faces), 1))
    if panel.heat is not None:
        from matplotlib import colormaps
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        scale = panel.heat.scale
        mappable = ScalarMappable(Normalize(scale.low, scale.high), colormaps[scale.colours])
        known = np.isfinite(panel.heat.values)
        colours = mappable.to_rgba(np.where(known, panel.heat.values, scale.low))[:, :3]
        colours[~known] = _UNKNOWN
    if panel.shaded:
        colours = colours * _shading(panel, ambient=0.30 if mappable is None else 0.62)[:, None]
    return np.clip(colours, 0.0, 1.0), mappable


def _shading(panel: Panel, ambient: float) -> Array:
    """Brightness of every face (m,), lit from both sides alike."""
    p = panel.points[panel.corners]
    normal = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    length = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    lit = np.abs(normal @ panel.light) / (length * np.linalg.norm(panel.light))
    return ambient + (1.05 - ambient) * lit


def write(figure: Figure, path: str | PathLike[str] | None) -> Figure:
    """Write a figure to a file, if one is given, and return it."""
    if path is not None:
        check_writable(path, SUFFIXES)
        suffix = os.path.splitext(os.fsdecode(path))[1].lower()
        with replacing(path) as file:
            figure.savefig(file, format=suffix[1:])
    return figure

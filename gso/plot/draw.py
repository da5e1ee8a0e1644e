"""Drawing of surfaces side by side.

Faces are painted from back to front, each in the colour of its value times its shading.
This is faster than Matplotlib's own 3D axes and preserves proportions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

from gso import geometry
from gso.errors import GSOError
from gso.io import check_writable, replacing, suffix_of
from gso.mesh import topology
from gso.mesh.view import lit
from gso.plot.heat import Heat, Scale
from gso.typing import AnyPath, Array, Ints, Keywords

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure


SUFFIXES = (".png", ".pdf", ".svg")
"""Suffixes of the pictures that are written."""

LIGHT = np.array([-0.40, 0.45, 0.80])
"""Where the light comes from: right, up, towards the viewer."""

_PLAIN = (0.60, 0.71, 0.82)
_UNKNOWN = (0.80, 0.80, 0.80)
_INK = (0.12, 0.16, 0.30)
_RIM = (0.70, 0.70, 0.70)

#: Widths of mesh lines and of lines on the surface, points.
_EDGE, _STROKE = 0.35, 0.9

#: Width of a panel, height of the colour bars, and height of the titles, inches.
_WIDTH, _BAR, _TITLE = 4.0, 0.85, 0.35

#: How names are drawn.
_LABEL = {"boxstyle": "round,pad=0.15", "facecolor": "white", "linewidth": 0, "alpha": 0.8}
_NAME: Keywords = {"fontsize": 8, "weight": "bold", "ha": "center", "va": "center", "bbox": _LABEL}

#: Largest number of faces for which mesh lines are visible.
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
        Values that colour the faces.
    tint : ndarray, (m, 3), optional
        Colours of the faces, where there are no values.
    light : ndarray, (3,)
        Direction to the light.
    shaded : bool
        Shade the faces by their normals.
    lines : sequence of ndarray, (k, 3)
        Polylines on the surface, in the same coordinates.
    circle : float
        Radius of a circle about the origin, behind the faces; 0 for none.
    names : sequence of (str, ndarray (2,))
        Texts, and the points that they stand at.
    """

    points: Array
    faces: Ints
    title: str = ""
    heat: Heat | None = None
    tint: Array | None = None
    light: Array = field(default_factory=lambda: LIGHT)
    shaded: bool = True
    lines: Sequence[Array] = ()
    circle: float = 0.0
    names: Sequence[tuple[str, Array]] = ()

    @property
    def corners(self) -> Ints:
        """Faces (m, 4); a triangle repeats its first corner."""
        return topology.four_corners(self.faces)


def available() -> bool:
    """Tell whether Matplotlib is installed."""
    return find_spec("matplotlib") is not None


def require() -> None:
    """Raise an error if Matplotlib is not installed.

    Raises
    ------
    GSOError
        With instructions to install it.
    """
    if not available():
        raise GSOError('plots need Matplotlib: pip install ".[plot]" in the folder of gso')


def draw(panels: Sequence[Panel]) -> Figure:
    """Draw panels in a row, with one colour bar per scale."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    # The same extent for all panels, so that lengths are comparable and titles align.
    span = 1.06 * np.max([np.ptp(_seen(p), axis=0) for p in panels], axis=0)
    tall = _WIDTH * float(np.clip(span[1] / span[0], 0.3, 1.3))
    below = _BAR if any(p.heat for p in panels) else 0.0
    width, height = _WIDTH * len(panels), below + tall + _TITLE
    figure = Figure(figsize=(width, height), dpi=120)
    FigureCanvasAgg(figure)
    bars: dict[Scale, tuple[ScalarMappable, list[int]]] = {}
    for k, panel in enumerate(panels):
        place = (k * _WIDTH / width, below / height, _WIDTH / width, tall / height)
        mappable = _paint(figure.add_axes(place), panel, span)
        if panel.heat is not None and mappable is not None:
            bars.setdefault(panel.heat.scale, (mappable, []))[1].append(k)
    for scale, (mappable, owners) in bars.items():
        middle = (float(np.mean(owners)) + 0.5) * _WIDTH
        place = (
            (middle - 0.35 * _WIDTH) / width,
            0.6 / height,
            0.7 * _WIDTH / width,
            0.12 / height,
        )
        figure.colorbar(
            mappable,
            cax=figure.add_axes(place),
            orientation="horizontal",
            label=scale.label,
            extend=scale.extend,
        )
    return figure


def facing(flat: Array, seen: Array) -> complex:
    """Return the rotation, as a complex number, that turns a pattern like a view of its surface.

    Parameters
    ----------
    flat, seen : ndarray, (n, 2), (n, 3)
        Vertices of the pattern, and of the surface in the coordinates of a panel.
    """
    z, w = (p[:, 0] + 1j * p[:, 1] for p in (flat - flat.mean(axis=0), seen))
    return complex(np.exp(1j * np.angle((np.conj(z) * (w - w.mean())).sum())))


def turned(flat: Array, turn: complex) -> Array:
    """Return points (n, 2), rotated by a complex number, in the plane z = 0."""
    z = flat @ np.array([1.0, 1j]) * turn
    return np.stack([z.real, z.imag, np.zeros(len(z))], axis=1)


def _seen(panel: Panel) -> Array:
    if panel.circle:
        return panel.circle * np.array([(-1.0, -1.0), (1.0, 1.0)])
    return panel.points[np.unique(panel.corners), :2]


def _segments(lines: Sequence[Array]) -> Array:
    """Return the segments of polylines, (s, 2, 3)."""
    return np.concatenate([np.empty((0, 2, 3)), *(np.stack([p[:-1], p[1:]], 1) for p in lines)])


def _paint(ax: Axes, panel: Panel, span: Array) -> ScalarMappable | None:
    """Draw a panel; return the mappable of its colour bar."""
    from matplotlib.patches import Circle

    if panel.circle:
        ax.add_patch(Circle((0.0, 0.0), panel.circle, facecolor="none", edgecolor=_RIM))
    colours, mappable = _colours(panel)
    ax.add_collection(_polygons(panel, colours))
    for name, at in panel.names:
        ax.text(float(at[0]), float(at[1]), name, **_NAME)
    seen = _seen(panel)
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2
    ax.set_xlim(middle[0] - span[0] / 2, middle[0] + span[0] / 2)
    ax.set_ylim(middle[1] - span[1] / 2, middle[1] + span[1] / 2)
    ax.set_aspect("equal")
    ax.set_title(panel.title, fontsize=11)
    ax.axis("off")
    return mappable


def _polygons(panel: Panel, colours: Array) -> PolyCollection:
    """Collect the coloured faces and the segments of the lines, sorted from back to front."""
    from matplotlib.collections import PolyCollection

    corners, strokes = panel.points[panel.corners], _segments(panel.lines)
    few = len(corners) <= _LINES
    # A line is drawn after the faces that it lies on and before those that hide it.
    thick = np.ptp(corners[..., 2], axis=1).max()
    depth = np.r_[corners[..., 2].mean(axis=1), strokes[..., 2].mean(axis=1) + thick]
    order = np.argsort(depth, kind="stable")
    fill = np.zeros((depth.size, 4))
    edge = np.tile((*_INK, 1.0), (depth.size, 1))
    width = np.full(depth.size, _STROKE)
    m = len(corners)
    fill[:m, :3], fill[:m, 3] = colours, 1.0
    edge[:m, :3] = 0.72 * colours if few else colours
    width[:m] = _EDGE
    shapes = [*corners[..., :2], *strokes[..., :2]]
    return PolyCollection(
        [shapes[k] for k in order],
        facecolors=fill[order],
        edgecolors=edge[order],
        linewidths=width[order],
        rasterized=not few,
    )


def _colours(panel: Panel) -> tuple[Array, ScalarMappable | None]:
    """Compute the colour of every face (m, 3), and the mappable of the colour bar."""
    mappable = None
    colours = np.tile(_PLAIN, (len(panel.faces), 1)) if panel.tint is None else panel.tint
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
        colours = colours * _shading(panel, ambient=0.34 if mappable is None else 0.62)[:, None]
    return np.clip(colours, 0.0, 1.0), mappable


def _shading(panel: Panel, ambient: float) -> Array:
    """Compute the brightness of every face (m,), the same for both orientations."""
    normal = geometry.quad_area_vectors(panel.points, panel.corners)
    return ambient + (1.05 - ambient) * lit(normal, panel.light)


def write(figure: Figure, path: AnyPath | None) -> Figure:
    """Write a figure to a file, if one is given, and return it."""
    if path is not None:
        check_writable(path, SUFFIXES)
        with replacing(path) as file:
            figure.savefig(file, format=suffix_of(path)[1:])
    return figure

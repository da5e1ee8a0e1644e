"""Plots of surfaces and results, drawn with Matplotlib without a display.

>>> import tempfile, os
>>> import gso
>>> y, x = np.mgrid[:9., :9.]
>>> mesh = gso.Mesh.from_grid(np.stack([x, y, x * y / 20], axis=-1))
>>> path = os.path.join(tempfile.mkdtemp(), "saddle.png")
>>> figure = plot_surface(mesh, "curvature", path=path)
"""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from gso import metrics
from gso.components import average
from gso.errors import OptionError
from gso.io import as_mesh
from gso.mesh import Mesh
from gso.mesh.view import GRAZING, View
from gso.pattern import Pattern
from gso.plot.draw import SUFFIXES, Panel, available, draw, facing, require, turned, write
from gso.plot.heat import Heat, Scale, curvatures, distance, numbers, scales, strain, stretch
from gso.plot.picture_panels import gauss, net, pieces, ruled, strips
from gso.result import Result
from gso.ruled.ruled_surface import RuledSurface
from gso.seams import Segmentation
from gso.spelling import choices
from gso.typing import AnyPath, MeshLike
from gso.unfolding import Net

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "COLOURS",
    "GRAZING",
    "SUFFIXES",
    "Heat",
    "Panel",
    "Scale",
    "View",
    "available",
    "curvatures",
    "distance",
    "draw",
    "numbers",
    "picture",
    "plot_pieces",
    "plot_result",
    "plot_rulings",
    "plot_surface",
    "png",
    "require",
    "strain",
]

#: Dots per inch of pictures in notebooks.
_DPI = 80

COLOURS = ("curvature", "distance", "strain", "none")
"""Names that :func:`plot_surface` takes for its values."""


def plot_surface(
    mesh: MeshLike,
    values: str | ArrayLike = "none",
    *,
    path: AnyPath | None = None,
    title: str = "",
    label: str = "",
    before: MeshLike | None = None,
) -> Figure:
    """Draw a surface, coloured by a quantity.

    Parameters
    ----------
    mesh : Mesh, or anything that :func:`gso.as_mesh` takes
        The surface.
    values : {"none", "curvature", "distance", "strain"} or array_like
        Quantity shown by the colours: the absolute Gaussian curvature times the squared size,
        the distance to `before` in percent of its diagonal, the larger principal strain of
        the map from `before` to this flat pattern, or your own values per vertex (n,) or
        per face (m,).
    path : str or PathLike, optional
        A .png, .pdf or .svg file to write.
    title, label : str
        Text above the surface, and at the colour bar of your own values.
    before : Mesh, optional
        A surface to draw beside it, from the same side and with the same colour scale.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    GSOError
        Matplotlib is not installed.
    OptionError
        The values do not match the mesh, or the quantity needs `before`.
    MeshError
        The surface cannot be used, or the file cannot be written.
    """
    require()
    surface = as_mesh(mesh)
    first = None if before is None else as_mesh(before)
    meshes = [surface] if first is None else [first, surface]
    if isinstance(values, str):
        panels = _named(values, meshes)
    else:
        panels = _plain(meshes)
        panels[-1].heat = numbers(surface, np.asarray(values, float), label)
    panels[-1].title = title or panels[-1].title
    return write(draw(panels), path)


def _plain(meshes: list[Mesh]) -> list[Panel]:
    view = View.of(meshes[0])
    panels = [Panel(view.project(m.vertices), m.faces) for m in meshes]
    if len(panels) > 1:
        panels[0].title, panels[1].title = "before", "after"
    return panels


def _named(name: str, meshes: list[Mesh]) -> list[Panel]:
    if name not in COLOURS:
        raise OptionError(f"no colour {name!r}; {choices(name, COLOURS)}")
    if name in ("distance", "strain") and len(meshes) < 2:
        raise OptionError(f"the colour {name!r} needs the surface before")
    panels = _plain(meshes)
    if name == "curvature":
        for panel, heat in zip(panels, curvatures(meshes), strict=True):
            panel.heat = heat
    elif name == "distance":
        panels[1].heat = distance(*meshes)
        panels[1].title = "distance: " + panels[1].heat.summary
    elif name == "strain":
        return _flattened(meshes[0], Pattern.whole(meshes[0], meshes[1].vertices[:, :2]))
    return panels


def _flattened(design: Mesh, pattern: Pattern, scale: np.ndarray | None = None) -> list[Panel]:
    """Make panels of a surface and its flat pattern, rotated to match the view of the surface.

    They are coloured by the scale of the faces, if that is given, else by the strain.
    """
    flat, opened = pattern.flat, pattern.surface(design)
    heat = strain(opened, flat) if scale is None else scales(opened, flat, scale)
    surface = _plain([design])[0]
    surface.title, surface.heat = "surface", heat
    points = turned(flat - flat.mean(axis=0), facing(flat, surface.points[pattern.vertex]))
    sheet = Panel(points / design.frame.scale, pattern.faces, shaded=False, heat=heat)
    sheet.title = "flat pattern: " + heat.summary
    return [surface, sheet]


def plot_result(result: Result, path: AnyPath | None = None) -> Figure:
    """Draw a result beside its design.

    `developable`: the curvature before and after in one colour scale, the distance between the
    two, and the strain of the flat pattern if there is one. A ruled surface: its strips with
    rulings, creases and flat regions, and the pattern with its bend lines. `bend`: curvature and
    strain, with the stretch instead of the distance. `flatten`: the strain on the surface and on
    the flat pattern.
    `conformal`: the scale of the faces on both. `denoise`: both surfaces in grazing light, and
    the distance between the two.

    Parameters
    ----------
    result : Result
        Returned by :func:`gso.tno.optimize`.
    path : str or PathLike, optional
        A .png, .pdf or .svg file to write.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    GSOError
        Matplotlib is not installed.
    MeshError
        The file cannot be written.
    """
    require()
    design, mesh = result.design, result.mesh
    if result.ruled is not None:
        return write(draw(strips(design, result.ruled)), path)
    surface_too = result.task == "developable"
    if result.pattern is not None and not surface_too:
        return write(draw(_flattened(design, result.pattern, result.cell_scale)), path)
    before, after, apart = panels = _plain([design, mesh, mesh])
    bent = result.task == "bend"
    apart.heat = stretch(design, mesh) if bent else distance(design, mesh)
    apart.title = ("stretch: " if bent else "distance: ") + apart.heat.summary
    if result.task == "denoise":
        before.title, after.title = "input", "denoised"
        before.light = after.light = GRAZING
    else:
        before.heat, after.heat = curvatures([design, mesh])
        before.title = f"input: mean |K| {average(_curved, design, design):.2g}"
        after.title = f"result: mean |K| {average(_curved, design, mesh):.2g}"
    if result.pattern is not None:
        panels.append(_flattened(mesh, result.pattern)[1])
    return write(draw(panels), path)


def _curved(design: Mesh, mesh: Mesh) -> float:
    """Compute the mean absolute Gaussian curvature of a surface, scaled by its design's size."""
    return metrics.mean_abs_K(mesh, scale=metrics.unit(design))


def plot_pieces(found: Segmentation, path: AnyPath | None = None) -> Figure:
    """Draw a design in pieces from both sides, with its seams, beside the patterns.

    Parameters
    ----------
    found : Segmentation
        Returned by :func:`gso.pieces`.
    path : str or PathLike, optional
        A .png, .pdf or .svg file to write.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    GSOError
        Matplotlib is not installed.
    MeshError
        The file cannot be written.
    """
    require()
    return write(draw(pieces(found)), path)


def plot_rulings(
    mesh: MeshLike,
    *,
    path: AnyPath | None = None,
    count: int = 24,
    before: MeshLike | None = None,
) -> Figure:
    """Draw a surface with its ruling lines, and its Gauss image beside it.

    Parameters
    ----------
    mesh : Mesh, or anything that :func:`gso.as_mesh` takes
        The surface.
    path : str or PathLike, optional
        A .png, .pdf or .svg file to write.
    count : int
        Number of lines.
    before : Mesh, optional
        A surface whose Gauss image is drawn first, from the same side.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    GSOError
        Matplotlib is not installed.
    OptionError
        `count` is not a whole number of lines, 1 or more.
    MeshError
        The surface cannot be used, or the file cannot be written.
    """
    require()
    surface = as_mesh(mesh)
    view = View.of(surface)
    panels = [ruled(surface, view, count), gauss(surface, view)]
    if before is not None:
        panels.insert(0, gauss(as_mesh(before), view, "Gauss image before"))
    return write(draw(panels), path)


def picture(found: object) -> Figure | None:
    """Draw a mesh, a result, pieces, a net or a ruled surface; None for something else.

    Raises
    ------
    GSOError
        Matplotlib is not installed.

    Examples
    --------
    >>> picture("a text") is None
    True
    """
    if isinstance(found, Result):
        return plot_result(found)
    if isinstance(found, Segmentation):
        return plot_pieces(found)
    if isinstance(found, Net):
        return draw(net(found))
    if isinstance(found, RuledSurface):
        return plot_surface(found.mesh)
    return plot_surface(found) if isinstance(found, Mesh) else None


def png(found: object) -> bytes | None:
    """Return the picture of an object as a PNG; None if there is none, or no Matplotlib."""
    if not available():
        return None
    figure = picture(found)
    if figure is None:
        return None
    data = BytesIO()
    figure.savefig(data, format="png", dpi=_DPI)
    return data.getvalue()

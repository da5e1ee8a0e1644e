"""Flat patterns as SVG drawings at full size."""

from __future__ import annotations

import io
from collections.abc import Sequence
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import MeshError, OptionError
from gso.io.atomic import check_writable, replacing
from gso.io.lines import polyline
from gso.mesh import Mesh
from gso.pattern import Bend
from gso.spelling import choices, known_keywords
from gso.typing import Array, Ints

MILLIMETRES = {
    "um": 1e-3,
    "mm": 1.0,
    "cm": 10.0,
    "dm": 100.0,
    "m": 1000.0,
    "in": 25.4,
    "ft": 304.8,
    "yd": 914.4,
}
"""Length of each unit that :func:`save_flat` knows, in millimetres."""

# Line width on paper in millimetres, and its largest fraction of the pattern's size.
_LINE = 0.1
_FINEST = 1 / 500


@known_keywords()
def save_flat(
    flat: ArrayLike,
    mesh: Mesh,
    path: str | PathLike[str],
    *,
    unit: str = "mm",
    mesh_lines: bool = False,
    lines: Sequence[Any] = (),
    bends: Sequence[Bend] = (),
) -> None:
    """Write a flat pattern as an SVG drawing at the scale 1:1.

    The pattern is drawn as seen from positive z, with x to the right and y up, so that
    faces which are anticlockwise in `flat` are anticlockwise on paper. The layer `outline`
    has one closed path per boundary loop, holes included. The layer `mesh` has the inner
    edges, and the layer `lines` has the given polylines. The layers `mountain` and `valley`
    have the lines to bend along; each has its angle and radius as its title.

    Parameters
    ----------
    flat : array_like, (n, 2)
        Plane coordinates of the mesh's vertices.
    mesh : Mesh
        The mesh that was flattened; its connectivity defines the outline and inner edges.
    path : str or PathLike
        A file whose name ends in .svg. It is replaced only when the drawing is complete.
    unit : {"mm", "um", "cm", "dm", "m", "in", "ft", "yd"}
        Unit of the coordinates in `flat`. The drawing itself is in millimetres.
    mesh_lines : bool
        Also draw the inner edges.
    lines : sequence of array_like (k, 2)
        Polylines to add, in the coordinates of `flat`.
    bends : sequence of Bend
        Lines to bend along, in the same coordinates.

    Raises
    ------
    MeshError
        `flat` does not fit the mesh, it or a line is not finite, the mesh is closed, or the
        file cannot be written.
    OptionError
        Unknown unit.

    Examples
    --------
    >>> import tempfile, os
    >>> y, x = np.mgrid[:3, :4]
    >>> mesh = Mesh.from_grid(np.stack([x, y, 0 * x], axis=-1))
    >>> path = os.path.join(tempfile.mkdtemp(), "pattern.svg")
    >>> save_flat(mesh.vertices[:, :2], mesh, path, unit="cm")
    """
    check_writable(path, (".svg",))
    if unit not in MILLIMETRES:
        raise OptionError(f"unknown unit {unit!r}; {choices(unit, MILLIMETRES)}")
    points = np.array(flat, dtype=np.float64)
    if points.shape != (len(mesh.vertices), 2):
        raise MeshError(
            f"the flat pattern is an array {points.shape}, but the mesh needs "
            f"({len(mesh.vertices)}, 2)"
        )
    loops = mesh.boundary_loops
    if not loops:
        raise MeshError("a closed surface has no outline; cut it open before flattening")
    used = np.unique(mesh.faces[mesh.faces >= 0])
    points *= MILLIMETRES[unit]
    if not np.isfinite(points[used]).all():
        raise MeshError("the flat pattern has coordinates that are not finite")
    extra = [MILLIMETRES[unit] * polyline(line, k, 2) for k, line in enumerate(lines)]
    scale = MILLIMETRES[unit]
    folds = [Bend(scale * np.asarray(b.line), b.angle, scale * b.radius) for b in bends]
    text = _drawing(points, used, loops, mesh.edges if mesh_lines else None, extra, folds)
    with replacing(path) as file:
        file.write(text.encode("utf-8"))


def _drawing(
    points: Array,
    used: Ints,
    loops: list[Ints],
    edges: Ints | None,
    lines: Sequence[Array],
    bends: Sequence[Bend],
) -> str:
    """Return the SVG text of a pattern; `points` are in millimetres with y up."""
    import svgwrite
    from svgwrite.extensions import Inkscape

    low, high = points[used].min(axis=0), points[used].max(axis=0)
    line = min(_LINE, _FINEST * float((high - low).max()))
    margin = 10 * line
    width, height = (high - low + 2 * margin).tolist()

    # In SVG y points down: flip the coordinates here, so that the file needs no transform.
    def on_paper(p: Array) -> Array:
        return np.stack([p[:, 0] - low[0], high[1] - p[:, 1]], axis=1) + margin

    paper = on_paper(points)
    drawing = svgwrite.Drawing(
        size=(f"{width:.9g}mm", f"{height:.9g}mm"),
        viewBox=f"0 0 {width:.9g} {height:.9g}",
        debug=False,
    )
    layers = Inkscape(drawing)

    def layer(name: str, colour: str) -> Any:
        group = layers.layer(
            label=name, id=name, fill="none", stroke=colour, stroke_width=f"{line:.9g}"
        )
        return drawing.add(group)

    if edges is not None:
        rim = np.concatenate([np.stack([p, np.roll(p, -1)], axis=1) for p in loops])
        n = np.int64(len(points))
        inner = edges[~np.isin(_keys(edges, n), _keys(rim, n))]
        pairs = paper[inner].reshape(-1, 4)
        if len(pairs):
            path = ("M%.9g %.9gL%.9g %.9g" * len(pairs)) % tuple(pairs.ravel().tolist())
            layer("mesh", "#808080").add(drawing.path(d=path))
    if lines:
        inside = layer("lines", "#0050a0")
        for given in lines:
            inside.add(drawing.path(d=_path(on_paper(given))))
    for name, sign, colour in (("mountain", 1.0, "#c02020"), ("valley", -1.0, "#2040c0")):
        chosen = [bend for bend in bends if sign * bend.angle > 0]
        if chosen:
            folds = layer(name, colour)
            for bend in chosen:
                drawn = drawing.path(d=_path(on_paper(bend.line)))
                angle = abs(np.degrees(bend.angle))
                drawn.set_desc(title=f"{name}, {angle:.2f} degrees, radius {bend.radius:.4g} mm")
                folds.add(drawn)
    outline = layer("outline", "#000000")
    for loop in loops:
        outline.add(drawing.path(d=_path(paper[loop]) + "Z"))
    text = io.StringIO()
    drawing.write(text)
    return text.getvalue()


def _path(points: Array) -> str:
    return "M" + "L".join(f"{x:.9g} {y:.9g}" for x, y in points.tolist())


def _keys(edges: Ints, count: np.int64) -> Ints:
    return edges.min(axis=1) * count + edges.max(axis=1)

"""Flat patterns as SVG drawings at full size."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import MeshError
from gso.io.atomic import check_writable, write_bytes
from gso.io.lines import polyline
from gso.io.svg_page import SVGPage
from gso.mesh import Mesh
from gso.pattern import Bend
from gso.quantities import millimetres
from gso.typing import AnyPath

# Line width on paper in millimetres, and its largest fraction of the pattern's size.
_LINE = 0.1
_FINEST = 1 / 500


def save_flat(
    flat: ArrayLike,
    mesh: Mesh,
    path: AnyPath,
    *,
    unit: str = "mm",
    mesh_lines: bool = False,
    lines: Sequence[ArrayLike] = (),
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
    scale = millimetres(unit)
    points = np.array(flat, dtype=np.float64)
    if points.shape != (len(mesh.vertices), 2):
        raise MeshError(
            f"the flat pattern is an array {points.shape}, but the mesh needs "
            f"({len(mesh.vertices)}, 2)"
        )
    loops = mesh.boundary_loops
    if not loops:
        raise MeshError("a closed surface has no outline; cut it open before flattening")
    points *= scale
    inside = points[mesh.used]
    if not np.isfinite(inside).all():
        raise MeshError("the flat pattern has coordinates that are not finite")
    low, high = inside.min(axis=0), inside.max(axis=0)
    width = min(_LINE, _FINEST * float((high - low).max()))
    page = SVGPage(low - 10 * width, high + 10 * width)
    inner = mesh.edges[~mesh.boundary_edges] if mesh_lines else np.empty((0, 2), np.int64)
    page.path(page.layer("mesh", "#808080", width), points[inner])
    layer = page.layer("lines", "#0050a0", width)
    for number, line in enumerate(lines):
        page.path(layer, [scale * polyline(line, number, 2)])
    for name, sign, colour in (("mountain", 1.0, "#c02020"), ("valley", -1.0, "#2040c0")):
        layer = page.layer(name, colour, width)
        for bend in bends:
            if sign * bend.angle > 0:
                title = bend._replace(radius=scale * bend.radius).in_words()
                page.path(layer, [scale * np.asarray(bend.line)], title=title)
    layer = page.layer("outline", "#000000", width)
    for loop in loops:
        page.path(layer, [points[loop]], closed=True)
    write_bytes(path, page.content())

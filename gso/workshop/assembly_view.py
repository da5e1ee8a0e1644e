"""Pictures of a design's panels in their places, with their names, bend lines and seams."""

from __future__ import annotations

import base64
import struct
import zlib
from collections.abc import Callable, Sequence
from xml.etree.ElementTree import SubElement, tostring

import numpy as np

from gso import geometry
from gso.io.svg_page import SVGPage
from gso.mesh import Mesh
from gso.mesh.view import GRAZING, View, lit, pale_colours
from gso.typing import Array
from gso.workshop.panels import Made

#: Size of a picture, its margin and the height of its texts, in pixels; pixels of the image of
#: the faces per pixel; points of a line at which it is looked for behind others, and their
#: distance from faces.
_SIZE, _MARGIN, _TALL, _FINE, _POINTS, _NEAR = 470, 12, 14, 2, 9, 3.0
#: Lowest brightness.
_DARK = 0.45


def assembly(made: Made, link: Callable[[str], str]) -> list[str]:
    """Draw the panels of a design from two opposite sides.

    Panels have colours of their own, and their names where they are seen. Thin lines are bends,
    thick ones are outlines.

    Parameters
    ----------
    made : Made
    link : callable
        Gives the address of what is shown when a panel's name is clicked; empty for none.

    Returns
    -------
    list of str
        SVG elements.
    """
    front = View.of(_joined([panel.surface for panel in made.panels]))
    return [_drawn(view, made, link) for view in (front, front.behind)]


def _joined(meshes: Sequence[Mesh]) -> Mesh:
    """Return one mesh of several."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    triangles = [mesh.triangles + k for mesh, k in zip(meshes, first, strict=False)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(triangles))


def _drawn(view: View, made: Made, link: Callable[[str], str]) -> str:
    """Draw the panels in a view: faces as an image, what is seen of lines, and names."""
    meshes = [panel.surface for panel in made.panels]
    points = [view.project(mesh.vertices) for mesh in meshes]
    every = np.concatenate(points)
    low, size = every[:, :2].min(axis=0), np.ptp(every[:, :2], axis=0)
    scale = _SIZE / float(size.max())
    high = scale * size + 2 * _MARGIN
    # Pixels of the picture, y up; the image has its first row above.
    placed = [scale * (p - [*low, 0.0]) + [_MARGIN, _MARGIN, 0.0] for p in points]
    turned = [_FINE * (p * [1.0, -1.0, 1.0] + [0.0, high[1], 0.0]) for p in placed]
    corners = np.concatenate([p[m.triangles] for p, m in zip(turned, meshes, strict=True)])
    owner = np.repeat(np.arange(len(meshes)), [len(mesh.triangles) for mesh in meshes])
    wide, tall = (int(np.ceil(_FINE * side)) for side in high)
    triangle, depth = geometry.nearest_triangles(corners, (tall, wide))
    image = np.full((tall, wide, 3), 255, np.uint8)
    shown = triangle >= 0
    image[shown] = _tones(corners, pale_colours(len(meshes))[owner])[triangle[shown]]

    page = SVGPage(np.zeros(2), high, digits=5)
    width, height = (f"{side:.5g}" for side in high)
    page.root.attrib |= {"width": width, "height": height}
    source = f"data:image/png;base64,{base64.b64encode(_png(image)).decode()}"
    SubElement(page.root, "image", {"href": source, "width": width, "height": height})
    bends, rims = ([getattr(panel, name) for panel in made.panels] for name in ("bends", "rim"))
    for kind, edges in (("bend", bends), ("rim", rims)):
        drawn = [
            _seen_parts(own[ends], turn[ends], depth)
            for ends, own, turn in zip(edges, placed, turned, strict=True)
        ]
        page.path(page.root, np.concatenate(drawn), kind=kind)
    for number, middle in geometry.roomiest_pixels(np.where(shown, owner[triangle], -1)).items():
        name, (column, row) = made.panels[number].name, middle / _FINE
        address = link(name)
        target = SubElement(page.root, "a", {"href": address} if address else {})
        SubElement(target, "title").text = name
        at = np.array([column, high[1] - row - 0.36 * _TALL])
        page.text(target, _short(name, made.name), at, 0.72 * _TALL)
    return tostring(page.root, "unicode")


def _short(name: str, design: str) -> str:
    """Return a name without the design's.

    >>> _short("roof-A-1", "roof"), _short("roof", "roof")
    ('A-1', 'roof')
    """
    return name.removeprefix(f"{design}-") or name


def _seen_parts(lines: Array, turned: Array, depth: Array) -> Array:
    """Return the parts (k, 2, 2) of lines (l, 2, 3) that are not hidden."""
    share = np.linspace(0.0, 1.0, _POINTS)[:, None]
    points, places = (
        (x[:, None, 0] + share * (x[:, None, 1] - x[:, None, 0])) for x in (lines, turned)
    )
    every = geometry.in_front(places.reshape(-1, 3), depth, _FINE * _NEAR)
    shown = every.reshape(len(lines), _POINTS)
    whole = np.asarray(shown.all(axis=1))
    steps = np.stack([points[:, :-1], points[:, 1:]], axis=2)[..., :2]
    kept = shown[:, :-1] & shown[:, 1:] & ~whole[:, None]
    return np.concatenate([lines[whole][..., :2], steps[kept]])


def _tones(corners: Array, colours: Array) -> np.ndarray:
    """Return the colours of triangles, the same for both orientations, (m, 3)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # Rows of the image count downwards.
    bright = _DARK + (1.0 - _DARK) * lit(normal * [1.0, -1.0, 1.0], GRAZING)
    return np.asarray(np.round(255.0 * colours * bright[:, None]).astype(np.uint8))


def _png(image: np.ndarray) -> bytes:
    """Return an image (rows, columns, 3) of bytes as a PNG file."""

    def chunk(name: bytes, data: bytes) -> bytes:
        check = struct.pack(">I", zlib.crc32(name + data))
        return struct.pack(">I", len(data)) + name + data + check

    rows, columns = image.shape[:2]
    # Each row begins with the number of its filter, 0 for none.
    lines = np.pad(image.reshape(rows, -1), ((0, 0), (1, 0))).tobytes()
    head = struct.pack(">IIBBBBB", columns, rows, 8, 2, 0, 0, 0)
    parts = [(b"IHDR", head), (b"IDAT", zlib.compress(lines, 9)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*part) for part in parts)

"""Pictures of a design's panels in their places, with their names, bend lines and seams."""

from __future__ import annotations

import base64
import struct
import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import SubElement

import numpy as np

from gso import geometry
from gso.geometry.polygon import arc_lengths, points_at
from gso.mesh import Mesh
from gso.mesh.view import GRAZING, View, lit, pale_colours
from gso.typing import Array, Flags, Ints
from gso.workshop.page_svg import PageSVG
from gso.workshop.panels import Made, Mating, Panel

#: Size of a picture and the height of its capital letters, in pixels.
SIZE, TALL = 470, 10.0
#: Margin in pixels; pixels of the image of the faces per pixel; points of a line at which it is
#: looked for behind others, and their distance from faces.
_MARGIN, _FINE, _POINTS, _NEAR = 12, 2, 9, 3.0
#: Lowest brightness.
_DARK = 0.45
#: Degrees of brightness of pictures with few of them.
_DEGREES = 24
#: Least distance between the numbers of seams and other texts, in pixels.
_APART = 12.0
#: Distance in pixels from lines that points on them may have.
_STRAIGHT = 0.2
#: Colour of outlines in the image of the faces.
_EDGE = (110, 110, 108)


@dataclass(frozen=True, eq=False)
class Name:
    """A text of a picture: what a panel or a seam is called.

    Attributes
    ----------
    text : str
    at : ndarray, (2,)
        The middle of its base line.
    title : str
        The whole name.
    kind : {"panel", "seam"}
    """

    text: str
    at: Array
    title: str
    kind: str = "panel"


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture of panels in their places, in pixels with y up.

    Attributes
    ----------
    size : (float, float)
        Width and height.
    image : ndarray of uint8, (rows, columns, 3)
        The faces; the first row is the upper one.
    lines : dict of ndarray (k, 2, 2)
        Lines that are seen, by their kind: "bends", "rim", "joined" (seams).
    names : tuple of Name
    """

    size: tuple[float, float]
    image: np.ndarray
    lines: dict[str, Array]
    names: tuple[Name, ...] = ()

    def svg(
        self,
        link: Callable[[str], str] = lambda title: "",
        name: str = "",
        before: tuple[str, Picture] | None = None,
    ) -> str:
        """Return it as an SVG element of the page.

        Parameters
        ----------
        link : callable
            Gives the addresses of names, empty for none.
        name : str
            Identifier of the image of the faces, which other pictures may repeat.
        before : (str, Picture), optional
            A picture of the same view on the same page, with its `name`: only what differs from
            its faces is stored.
        """
        page = PageSVG(np.zeros(2), np.array(self.size), "picture")
        page.root.set("style", f"--w:{self.size[0]:.0f}")
        faces = SubElement(page.root, "g", {"id": name} if name else {})
        # Pixels from the left, the top, the right and the bottom.
        sides, image = (0, 0, *self.image.shape[1::-1]), self.image
        if before is not None:
            SubElement(faces, "use", {"href": f"#{before[0]}"})
            sides, image = _changed(before[1].image, image)
        if image.size:
            wide, high = sides[2] - sides[0], sides[3] - sides[1]
            look = dict(zip(("x", "y", "width", "height"), (*sides[:2], wide, high), strict=True))
            places = {key: f"{side / _FINE:g}" for key, side in look.items() if side}
            SubElement(faces, "image", {"href": _source(image)} | places)
        for kind, lines in self.lines.items():
            page.path(page.root, _chains(lines), kind=kind)
        for own in self.names:
            address = link(own.title)
            target = SubElement(page.root, "a", {"href": address} if address else {})
            target.set("class", f"{own.kind}-name")
            SubElement(target, "title").text = own.title
            page.text(target, own.text, own.at, TALL)
        return page.text_of()

    def png(self) -> bytes:
        """Return the image of the faces as a PNG file."""
        return _png(self.image)

    def source(self) -> str:
        """Return the same as the address of an image in HTML."""
        return _source(self.image)


class Stage:
    """The panels of a design in one view, put on one after another.

    Parameters
    ----------
    made : Made
    view : View
    size : float
        The larger side of its pictures, without margins, in pixels.
    """

    def __init__(self, made: Made, view: View, size: float = SIZE):
        self._made = made
        meshes = [panel.surface for panel in made.panels]
        points = [view.project(mesh.vertices) for mesh in meshes]
        every = np.concatenate(points)
        low, extent = every[:, :2].min(axis=0), np.ptp(every[:, :2], axis=0)
        self._scale = size / float(extent.max())
        self._view, self._low = view, low
        wide, high = (self._scale * extent + 2 * _MARGIN).tolist()
        self.size = wide, high
        # Pixels of the picture, y up; the image has its first row above.
        self._placed = [self._pixels(p) for p in points]
        turned = [self._turned(p) for p in self._placed]
        self._turned_points = turned
        self._corners = [p[m.triangles] for p, m in zip(turned, meshes, strict=True)]
        self._first = np.cumsum([0, *(len(own) for own in self._corners)])
        self._owner = np.repeat(np.arange(len(meshes)), [len(own) for own in self._corners])
        shape = (int(np.ceil(_FINE * high)), int(np.ceil(_FINE * wide)))
        self._triangle = np.full(shape, -1)
        self._depth = np.full(shape, -np.inf)
        self._shown: list[int] = []

    def _pixels(self, points: Array) -> Array:
        placed: Array = self._scale * (points - [*self._low, 0.0]) + [_MARGIN, _MARGIN, 0.0]
        return placed

    def _turned(self, placed: Array) -> Array:
        turned: Array = _FINE * (placed * [1.0, -1.0, 1.0] + [0.0, self.size[1], 0.0])
        return turned

    def add(self, panels: Iterable[int]) -> None:
        """Put panels on, by their numbers."""
        panels = list(panels)
        corners = np.concatenate([np.empty((0, 3, 3)), *(self._corners[k] for k in panels)])
        number = np.concatenate(
            [np.empty(0, np.int64), *(np.arange(*self._first[k : k + 2]) for k in panels)]
        )
        if not len(corners):
            return
        triangle, depth = geometry.nearest_triangles(corners, self._depth.shape)
        nearer = depth > self._depth
        self._depth[nearer] = depth[nearer]
        self._triangle[nearer] = number[triangle[nearer]]
        self._shown += panels

    @property
    def owner(self) -> Ints:
        """The panel that is seen in each pixel of the image, -1 for none."""
        owner: Ints = np.append(self._owner, -1)[self._triangle]
        return owner

    def picture(
        self,
        colours: Array,
        *,
        new: Sequence[int] | None = None,
        seams: Sequence[Mating] = (),
    ) -> Picture:
        """Draw what was put on.

        Parameters
        ----------
        colours : ndarray, (p, 3)
            Of all panels, 0 to 1.
        new : sequence of int, optional
            Panels whose names and lines are drawn; others have their outlines in the image of
            the faces only. By default all.
        seams : sequence of Mating
            Seams that are drawn in front of everything, with their numbers where these do not lie
            on each other.
        """
        # The last tone is that of pixels without a triangle, whose number is -1.
        tones = np.full((len(self._owner) + 1, 3), 255, np.uint8)
        seen = np.zeros(len(tones), bool)
        seen[self._triangle] = True
        used = np.flatnonzero(seen[:-1])
        corners = np.concatenate(self._corners)[used]
        tones[used] = _tones(corners, colours[self._owner[used]], new is None)
        image = tones[self._triangle]
        panels, owner = self._made.panels, self.owner
        drawn_panels = self._shown if new is None else list(new)
        if new is not None:
            image[_borders(owner)] = _EDGE
        lines = {
            kind: self._seen(drawn_panels, [getattr(panels[k], kind) for k in drawn_panels])
            for kind in ("bends", "rim")
        }
        names = []
        for number, middle in _roomiest(owner, drawn_panels).items():
            column, row = middle / _FINE
            at = np.array([column, self.size[1] - row - 0.5 * TALL])
            title = panels[number].name
            names.append(Name(short(title, self._made.name), at, title))
        if seams:
            drawn = [self._seam(seam) for seam in seams]
            lines["joined"] = np.concatenate(
                [np.stack([line[:-1], line[1:]], axis=1) for line in drawn]
            )
            for seam, line in zip(seams, drawn, strict=True):
                at = _middle(line) - [0.0, 0.5 * TALL]
                if all(np.abs(at - name.at).max() > _APART for name in names):
                    names.append(Name(str(seam.number), at, f"seam {seam.number}", "seam"))
        return Picture(self.size, image, lines, tuple(names))

    def shadow(self, panel: int) -> list[Array]:
        """Return the outlines (k, 2) of what a panel covers, whether it is seen or not."""
        import shapely

        own = self._made.panels[panel]
        corners = self._placed[panel][own.surface.triangles, :2]
        if not np.ptp(np.sign(_areas(corners))):
            # Nothing is folded over: the outline is that of the panel.
            return [self._placed[panel][loop, :2] for loop in own.loops]
        # Rounding to a tenth of a pixel closes gaps between triangles.
        whole = shapely.union_all(shapely.polygons(corners), grid_size=0.1)
        shapes = shapely.get_parts(shapely.simplify(whole, 0.3))
        rings = shapely.get_rings(shapes[shapely.get_type_id(shapes) == 3])
        return [shapely.get_coordinates(ring)[:-1] for ring in rings]

    def _seam(self, seam: Mating) -> Array:
        points = seam.one.on(self._made.panels[seam.one.panel].surface.vertices)
        return self._pixels(self._view.project(points))[:, :2]

    def _seen(self, panels: Sequence[int], edges: Sequence[Ints]) -> Array:
        """Return what is seen of edges of each panel, (k, 2, 2)."""
        drawn = [
            _seen_parts(self._placed[k][ends], self._turned_points[k][ends], self._depth)
            for k, ends in zip(panels, edges, strict=True)
        ]
        return np.concatenate([np.empty((0, 2, 2)), *drawn])


def here(picture: Picture, name: str, loops: Sequence[Array]) -> str:
    """Draw the place of a panel, by outlines (k, 2), on a picture with an identifier."""
    import shapely

    page = PageSVG(np.zeros(2), np.array(picture.size), "place")
    SubElement(page.root, "use", {"href": f"#{name}"})
    rings = shapely.simplify([shapely.LinearRing(loop) for loop in loops], _STRAIGHT)
    drawn = [shapely.get_coordinates(ring)[:-1] for ring in rings]
    page.path(page.root, drawn, closed=True, kind="here")
    return page.text_of()


def sides(panels: Sequence[Panel]) -> tuple[View, View]:
    """Return the views of panels from the front and from behind."""
    front = View.of(_joined([panel.surface for panel in panels]))
    return front, front.behind


def front(made: Made) -> Picture:
    """Return the picture of a design's panels in their places from the front."""
    stage = Stage(made, sides(made.panels)[0])
    stage.add(range(len(made.panels)))
    return stage.picture(pale_colours(len(made.panels)))


class Places:
    """Pictures of a design's panels in their places, from two opposite sides.

    Panels have colours of their own, and their names where they are seen. Thin lines are bends,
    thick ones are outlines.

    Parameters
    ----------
    made : Made
    colours : ndarray, (p, 3), optional
        Those of the panels, 0 to 1.

    Attributes
    ----------
    pictures : list of Picture
        From the front, and from behind.
    """

    def __init__(self, made: Made, colours: Array | None = None):
        self._stages = [Stage(made, view) for view in sides(made.panels)]
        count = len(made.panels)
        seen = []
        self.pictures = []
        for stage in self._stages:
            stage.add(range(count))
            self.pictures.append(stage.picture(pale_colours(count) if colours is None else colours))
            seen.append(np.bincount(stage.owner.ravel() + 1, minlength=count + 1)[1:])
        self._best = np.argmax(seen, axis=0)

    def side(self, panel: int) -> int:
        """Return the number of the picture in which most of a panel is seen."""
        return int(self._best[panel])

    def shadow(self, side: int, panel: int) -> list[Array]:
        """Return the outlines (k, 2) of what a panel covers in a picture."""
        return self._stages[side].shadow(panel)


def _joined(meshes: Sequence[Mesh]) -> Mesh:
    """Return one mesh of several."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    triangles = [mesh.triangles + k for mesh, k in zip(meshes, first, strict=False)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(triangles))


def _areas(corners: Array) -> Array:
    """Return twice the signed areas of triangles (m, 3, 2)."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _borders(owner: Ints) -> Flags:
    """Tell which pixels have a neighbour of another panel, or of none, below or to the right."""
    out = np.zeros(owner.shape, bool)
    out[:-1] |= owner[:-1] != owner[1:]
    out[:, :-1] |= owner[:, :-1] != owner[:, 1:]
    return out


def _roomiest(owner: Ints, panels: Sequence[int]) -> dict[int, Array]:
    """Return the pixel (column, row) with most room for a name on each panel that is seen."""
    own = np.where(np.isin(owner, panels), owner, -1)
    rows, columns = (np.flatnonzero((own >= 0).any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return {}
    low = np.array([columns[0], rows[0]])
    part = own[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return {k: middle + low for k, middle in geometry.roomiest_pixels(part, _FINE).items()}


def _middle(line: Array) -> Array:
    """Return the point half-way along a line (k, 2)."""
    along = arc_lengths(line)
    return points_at(0.5 * along[-1], along, line)


def short(name: str, design: str) -> str:
    """Return a name without the design's.

    >>> short("roof-A-1", "roof"), short("roof", "roof")
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


def _tones(corners: Array, colours: Array, fine: bool = True) -> np.ndarray:
    """Return the colours of triangles, the same for both orientations, (m, 3).

    With `fine` false there are few degrees of brightness.
    """
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # Rows of the image count downwards.
    light = lit(normal * [1.0, -1.0, 1.0], GRAZING)
    light = light if fine else (_DEGREES * light).round() / _DEGREES
    bright = _DARK + (1.0 - _DARK) * light
    return np.asarray(np.round(255.0 * colours * bright[:, None]).astype(np.uint8))


def _chains(segments: Array) -> list[Array]:
    """Join segments (k, 2, 2) that meet to lines, each drawn once, without points in between."""
    import shapely

    ends = np.round(segments, 1)
    back = np.lexsort(ends.transpose(2, 0, 1)[::-1], axis=-1)[:, 0] == 1
    ends[back] = ends[back][:, ::-1]
    ends = np.unique(ends[(ends[:, 0] != ends[:, 1]).any(axis=1)], axis=0)
    if not len(ends):
        return []
    joined = shapely.line_merge(shapely.multilinestrings(shapely.linestrings(ends)))
    lines = shapely.simplify(shapely.get_parts(joined), _STRAIGHT)
    return [shapely.get_coordinates(line) for line in lines]


def _changed(before: np.ndarray, image: np.ndarray) -> tuple[tuple[int, ...], np.ndarray]:
    """Return the part of an image that differs from an earlier one, and its sides in pixels.

    What is the same is white. Pixels around what differs are kept, so that nothing shines through
    where the image is scaled.
    """
    own = np.pad((before != image).any(axis=2), 1)
    near = own[1:-1, 1:-1] | own[:-2, 1:-1] | own[2:, 1:-1] | own[1:-1, :-2] | own[1:-1, 2:]
    rows, columns = (np.flatnonzero(near.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return (0, 0, 0, 0), image[:0]
    top, bottom, left, right = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
    cut = (slice(top, bottom), slice(left, right))
    kept = np.where(near[cut][..., None], image[cut], np.uint8(255))
    return (int(left), int(top), int(right), int(bottom)), kept


def _source(image: np.ndarray) -> str:
    """Return an image as an address in HTML."""
    return f"data:image/png;base64,{base64.b64encode(_png(image)).decode()}"


def _png(image: np.ndarray) -> bytes:
    """Return an image (rows, columns, 3) of bytes as a PNG file."""

    def chunk(name: bytes, data: bytes) -> bytes:
        check = struct.pack(">I", zlib.crc32(name + data))
        return struct.pack(">I", len(data)) + name + data + check

    rows, columns = image.shape[:2]
    red, green, blue = image.reshape(-1, 3).T.astype(np.uint32)
    code = red << 16 | green << 8 | blue
    # Neighbours are mostly equal: each run of equal pixels is looked at once.
    start = np.flatnonzero(np.append(True, code[1:] != code[:-1])[: len(code)])
    colours, index = np.unique(code[start], return_inverse=True)
    few = len(colours) <= 256
    # Each row begins with the number of its filter, 0 for none.
    if few:
        length = np.diff(np.append(start, len(code)))
        pixels = np.repeat(index.astype(np.uint8), length).reshape(rows, columns)
    else:
        pixels = image.reshape(rows, -1)
    lines = np.pad(pixels, ((0, 0), (1, 0))).tobytes()
    parts = [(b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, 3 if few else 2, 0, 0, 0))]
    # White is transparent: what has no face shows the page.
    if few:
        parts.append((b"PLTE", b"".join(int(c).to_bytes(3, "big") for c in colours)))
        parts.append((b"tRNS", bytes(0 if c == 0xFFFFFF else 255 for c in colours.tolist())))
    else:
        parts.append((b"tRNS", b"\x00\xff" * 3))
    parts += [(b"IDAT", zlib.compress(lines, 7)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*part) for part in parts)

"""Grids on a disk or a tube: copies of a design whose lines strips may run along.

The outline is divided into four sides, and the disk is mapped harmonically to a rectangle, so that
grid lines join opposite sides. Sides begin at the sharpest corners of the outline, or where a
box along the principal directions of curvature, a mirror plane or a given direction touches it.
Surfaces with two boundary loops are mapped to a cylinder.
"""

from __future__ import annotations

import numpy as np

from gso import geometry, parametrization
from gso.geometry.polygon import arc_lengths, points_at, signed_area
from gso.geometry.vectors import lengths, unit
from gso.mesh import Mesh, Nearest, vertex_normals
from gso.mesh.polyline import turns
from gso.ruled.lines.mirror_lines import mirror_lines
from gso.ruled.polygon import turning
from gso.typing import Array, Ints

#: Least and largest number of cells; between these, half as many as triangles.
_CELLS = (48**2, 64**2)
#: Smallest number of rows or columns.
_FEW = 12
#: Number of lines that distances between lines are measured on, and the power of their mean.
_FINE, _WIDE = 128, 40
#: Distance of corners along the outline, relative to its length, below which they are one.
_SAME = 1e-3
#: Shortest side of a grid, relative to the length of the outline; turning angles are compared in
#: steps, in radians.
_SHORT, _ALIKE = 0.05, 0.02
#: Turning of the outline at a corner, in radians.
_SHARP = np.radians(30.0)
#: Least angle between boxes, in radians, and largest number of those along mirror planes.
_TURNED, _MIRRORS = np.radians(5.0), 2
#: Points around the outline, and how many of them its places are averaged over to smooth it.
_AROUND, _WINDOW = 256, 33


def grid_copies(mesh: Mesh, along: Array | None = None) -> list[Mesh]:
    """Make grids on a disk or a tube whose lines run along several directions; else none.

    Parameters
    ----------
    mesh : Mesh
    along : ndarray, (m, 3), optional
        A direction at each triangle that lines of the only grid are to follow.

    Examples
    --------
    >>> u, v = np.mgrid[-1:1:9j, -1:1:9j]
    >>> sheet = Mesh.from_grid(np.stack([u, v, 0.2 * v * v], axis=-1))
    >>> (copy,) = grid_copies(Mesh(sheet.vertices, sheet.triangles))
    >>> copy.grid_shape
    (48, 50)
    """
    if len(mesh.boundary_loops) == 2:
        image = parametrization.around(mesh)
        return [] if image is None else [_closed(mesh, image)]
    if len(mesh.boundary_loops) != 1 or not parametrization.flattens(mesh):
        return []
    (loop,) = mesh.boundary_loops
    if len(loop) < 4:
        return []
    flat = parametrization.begin(mesh).flat
    flat = flat if signed_area(flat[loop]) > 0 else flat * [1.0, -1.0]
    outline = flat[loop]
    turn = turning(outline)
    found: list[Ints] = []
    if along is None:
        # Of corners that are equally sharp, the farthest from the middle are taken.
        far = lengths(outline - outline.mean(axis=0))
        sharpest = np.sort(np.lexsort((-far, -np.round(turn / _ALIKE)))[:4])
        if turn[sharpest].min() > _SHARP and _apart(outline, sharpest):
            found.append(sharpest)
    for angle in _angles(mesh, flat) if along is None else [_direction(mesh, flat, along)]:
        corners = _touching(outline, turn, angle)
        if corners is not None and not any(np.array_equal(np.sort(corners), own) for own in found):
            found.append(corners)
    return [_grid(mesh, loop, turn, corners) for corners in found]


def _angles(mesh: Mesh, flat: Array) -> list[float]:
    """Return angles in the plane of lines that strips may run along or across.

    These are a principal direction of curvature and, where they differ, mirror planes.
    """
    out = [_principal(mesh, flat)]
    for line in mirror_lines(mesh):
        angle = _direction(mesh, flat, np.tile(line, (len(mesh.triangles), 1)))
        # A box at right angles is the same.
        off = [abs((angle - own + 0.25 * np.pi) % (0.5 * np.pi) - 0.25 * np.pi) for own in out]
        if min(off) > _TURNED and len(out) <= _MIRRORS:
            out.append(angle)
    return out


def _slopes(mesh: Mesh, flat: Array, values: Array) -> Array:
    """Return the derivatives (t, d, 2) of values (n, d) on the triangles by places in the plane."""
    corner, value = flat[mesh.triangles], values[mesh.triangles]
    edges = np.swapaxes(corner[:, 1:] - corner[:, :1], 1, 2)
    change = np.swapaxes(value[:, 1:] - value[:, :1], 1, 2)
    double = np.linalg.det(edges)
    safe = np.where(np.abs(double) > 1e-14 * np.abs(double).max(), double, np.inf)
    inverse = np.stack([edges[:, 1, 1], -edges[:, 0, 1], -edges[:, 1, 0], edges[:, 0, 0]], axis=1)
    return np.asarray(change @ (inverse.reshape(-1, 2, 2) / safe[:, None, None]))


def _principal(mesh: Mesh, flat: Array) -> float:
    """Return the angle in the plane of a principal direction of curvature, on the whole."""
    position, normal = (_slopes(mesh, flat, x) for x in (mesh.vertices, vertex_normals(mesh)))
    second = np.einsum("tdi,tdj->tij", position, normal)
    weight = np.abs(geometry.signed_areas(flat, mesh.triangles))
    # Turned by an angle, this number turns by twice that; its square is that of both directions.
    two = second[:, 0, 0] - second[:, 1, 1] + 1j * (second[:, 0, 1] + second[:, 1, 0])
    return float(0.25 * np.angle(weight @ two**2))


def _direction(mesh: Mesh, flat: Array, along: Array) -> float:
    """Return the angle in the plane that is along directions (t, 3) on the whole."""
    own = np.einsum("tdi,td->ti", _slopes(mesh, flat, mesh.vertices), along)
    weight = np.abs(geometry.signed_areas(flat, mesh.triangles))
    square = np.einsum("t,ti,tj->ij", weight, own, own)
    return float(0.5 * np.arctan2(square[0, 1] + square[1, 0], square[0, 0] - square[1, 1]))


def _touching(outline: Array, turn: Array, angle: float) -> Ints | None:
    """Return where a turned box has its corners, (4,) positions; None where two are the same.

    The outline is smoothed before; a sharp corner nearby is taken instead.
    """
    from scipy.ndimage import uniform_filter1d

    along = arc_lengths(np.vstack([outline, outline[:1]]))
    places = np.linspace(0.0, along[-1], _AROUND, endpoint=False)
    z = np.exp(-1j * angle) * (outline @ np.array([1.0, 1j]))
    x, y = (np.interp(places, along, np.append(c, c[0]) / np.ptp(c)) for c in (z.real, z.imag))
    sharp = np.flatnonzero(turn > _SHARP)

    def gaps(one: float, others: Array) -> Array:
        gap: Array = np.abs(one - others)
        return np.asarray(np.minimum(gap, along[-1] - gap))

    corners = []
    for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        smooth = uniform_filter1d(a * x + b * y, _WINDOW, mode="wrap")
        top = places[smooth.argmax()]
        off = gaps(top, along[sharp])
        near = bool(len(off)) and off.min() <= along[-1] * _WINDOW / (2 * _AROUND)
        corners.append(sharp[off.argmin()] if near else gaps(top, along[:-1]).argmin())
    first = (np.array(corners) - corners[0]) % len(outline)
    return np.array(corners) if (np.diff(np.r_[first, len(outline)]) > 0).all() else None


def _grid(mesh: Mesh, loop: Ints, turn: Array, corners: Ints) -> Mesh:
    """Return a grid whose corners are at positions (4,) of the outline."""
    loop, turn = np.roll(loop, -corners[0]), np.roll(turn, -corners[0])
    n = len(loop)
    start = np.r_[(corners - corners[0]) % n, n]
    ring = mesh.vertices[np.r_[loop, loop[0]]]
    along = arc_lengths(ring)
    side = np.diff(along[start])
    wide, high = 0.5 * (side[0] + side[2]), 0.5 * (side[1] + side[3])
    box = np.array([[0.0, 0.0], [wide, 0.0], [wide, high], [0.0, high], [0.0, 0.0]])
    which = np.repeat(np.arange(4), np.diff(start))
    share = (along[:-1] - along[start[which]]) / side[which]
    rim = box[which] + share[:, None] * (box[which + 1] - box[which])
    image = parametrization.inside(mesh, loop, rim)
    rows, columns = _counts(wide, high, len(mesh.triangles))

    def outline(number: int, share: Array) -> Array:
        at = along[start[number]] + share * side[number]
        return points_at(at, along, ring)

    def placed(one: Array, two: Array) -> Array:
        points = _placed(mesh.vertices, mesh.triangles, image, one, two)
        # Triangles with two edges on one side of the box have no area in the image.
        points[:, 0], points[-1] = outline(0, one / wide), outline(1, two / high)
        points[:, -1], points[0] = outline(2, 1.0 - one / wide), outline(3, 1.0 - two / high)
        return points

    even = [np.linspace(0.0, x, _FINE) for x in (wide, high)]
    fine = placed(*even)
    one = _spread(even[0], fine, rows + 1)
    two = _spread(even[1], np.swapaxes(fine, 0, 1), columns + 1)
    points = placed(one, two).reshape(-1, 3)
    flat = np.stack(np.meshgrid(one, two, indexing="ij"), axis=-1).reshape(-1, 2)
    # Corners of the outline stay.
    index = np.arange(len(points)).reshape(rows + 1, columns + 1)
    border = np.r_[index[:-1, 0], index[-1, :-1], index[:0:-1, -1], index[0, :0:-1]]
    step = max(float(np.diff(one).max()), float(np.diff(two).max()))
    free = np.ones(len(border), bool)
    for k in _distinct(np.flatnonzero(np.abs(turn) > _SHARP), mesh.vertices[loop], len(border)):
        gap = lengths(flat[border] - rim[k])
        at = int(gap.argmin())
        # A second corner at the same place takes its neighbour, and others stay as they are.
        at = at if free[at] else int(np.where(free, gap, np.inf).argmin())
        if gap[at] <= 1.5 * step:
            points[border[at]], free[at] = mesh.vertices[loop[k]], False
    return Mesh.from_grid(points.reshape(rows + 1, columns + 1, 3))


def _closed(mesh: Mesh, image: parametrization.Around) -> Mesh:
    """Return a grid that closes around."""
    wide, high = image.size
    around, up = _counts(wide, high, len(image.mesh.triangles))
    # The image winds: its neighbours on both sides have the other points.
    n, windings = len(image.flat), (-1, 0, 1)
    every = np.concatenate([image.flat + np.array([k * wide, 0.0]) for k in windings])
    triangles = np.concatenate([image.mesh.triangles + k * n for k in range(len(windings))])
    vertices = np.tile(image.mesh.vertices, (len(windings), 1))
    begin = float(image.flat[:, 0].min())

    def placed(one: Array, two: Array) -> Array:
        points = _placed(vertices, triangles, every, begin + one, two)
        # Triangles with two edges on an end of the tube have no area in the image.
        for loop in mesh.boundary_loops:
            x, y = image.flat[loop].T
            own = points_at(begin + one, x, mesh.vertices[loop], period=wide)
            points[:, -1 if y.mean() > 0.5 * high else 0] = own
        return points

    even = [np.linspace(0.0, x, _FINE) for x in (wide, high)]
    fine = placed(*even)
    one = _spread(even[0], fine, around + 1)[:-1]
    points = placed(one, _spread(even[1], np.swapaxes(fine, 0, 1), up + 1)).reshape(-1, 3)
    index = np.arange(len(points)).reshape(around, up + 1)
    # Corners of the outline stay.
    for loop in mesh.boundary_loops:
        way, free = (
            np.roll(mesh.vertices[loop], -1, axis=0) - mesh.vertices[loop],
            np.arange(around),
        )
        sharp = np.flatnonzero(np.radians(turns(unit(way))) > _SHARP)
        for vertex in loop[_distinct(sharp, mesh.vertices[loop], around)]:
            x, y = image.flat[vertex]
            gap = np.abs(one[free] - (x - begin) % wide)
            at = int(np.minimum(gap, wide - gap).argmin())
            points[index[free[at], -1 if y > 0.5 * high else 0]] = mesh.vertices[vertex]
            free = np.delete(free, at)
    after = np.roll(index, -1, axis=0)
    corners = [index[:, :-1], after[:, :-1], after[:, 1:], index[:, 1:]]
    return Mesh(points, np.stack(corners, axis=-1).reshape(-1, 4))


def _distinct(corners: Ints, outline: Array, places: int) -> Ints:
    """Return the corners of a closed outline (n, 3) without those that are nearly the same.

    None of a jagged outline, which has more of them than a third of the places on the border.
    """
    along = arc_lengths(outline)[corners]
    least = _SAME * float(lengths(np.roll(outline, -1, axis=0) - outline).sum())
    kept = corners[np.diff(along, prepend=-np.inf) > least]
    return kept if 3 * len(kept) <= places else kept[:0]


def _apart(outline: Array, corners: Ints) -> bool:
    """Return whether corners divide a closed outline into sides that are not very short."""
    along = arc_lengths(np.vstack([outline, outline[:1]]))
    side = np.diff(np.r_[along[corners], along[-1] + along[corners[0]]])
    return bool(side.min() > _SHORT * along[-1])


def _counts(wide: float, high: float, triangles: int) -> tuple[int, int]:
    """Return the numbers of cells of a grid along both sides."""
    cells = int(np.clip(triangles // 2, *_CELLS))
    rows = int(np.clip(np.sqrt(cells * wide / high), _FEW, cells // _FEW))
    return rows, max(cells // rows, _FEW)


def _spread(places: Array, points: Array, count: int) -> Array:
    """Return places (count,) whose lines are about equally far apart.

    Parameters
    ----------
    places : ndarray, (k,)
    points : ndarray, (k, c, 3)
        Points of the surface on the line at each place.
    """
    step = lengths(np.diff(points, axis=0))
    step = ((step / max(float(step.max()), 1e-300)) ** _WIDE).mean(axis=1) ** (1.0 / _WIDE)
    along = np.r_[0.0, np.cumsum(step)]
    return np.interp(np.linspace(0.0, along[-1], count), along, places)


def _placed(vertices: Array, triangles: Ints, image: Array, one: Array, two: Array) -> Array:
    """Return the points (k, l, 3) of a surface whose images are nearest to a lattice."""
    near = Nearest.of(np.pad(image, ((0, 0), (0, 1))), triangles)
    flat = np.stack(np.meshgrid(one, two, indexing="ij"), axis=-1)
    triangle, shares, _ = near.locate(np.pad(flat.reshape(-1, 2), ((0, 0), (0, 1))))
    found = np.einsum("kj,kjd->kd", shares, vertices[triangles[triangle]])
    return np.asarray(found.reshape(*flat.shape[:2], 3))

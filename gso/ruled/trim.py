"""Strips cut along the outline of the design.

The outline and the holes of the design are projected to the strips, and the faces are clipped
with them in the parameters of :mod:`gso.ruled.strip_embedding`.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gso.geometry.steady import steady
from gso.geometry.vectors import cross, lengths, unit
from gso.mesh import Nearest
from gso.ruled.division import Trimmed, meshed
from gso.ruled.extended import Extended
from gso.ruled.nodes import Nodes
from gso.ruled.strip_embedding import plane
from gso.ruled.strip_layout import Strips
from gso.ruled.unroll import Unrolled
from gso.typing import Array, Ints

if TYPE_CHECKING:
    from shapely import Geometry, LinearRing, Polygon

#: Grids of the parameters, to which intersections are rounded; coarser ones are more robust.
_GRIDS = (1e-12, 1e-11, 1e-10, 1e-9, 1e-8)
#: Number of times that the intersection of a normal with the strips is corrected, and the
#: cosine of the angle between the normals below which it is not.
_TURNS, _STEEP = 5, 0.2
#: Length of the outline's segments that cross edges of the strips, relative to the diagonal.
_SHORT = 2e-5
#: Distance from a normal at which a point is not on it.
_MISSED = 1e-6


def trimmed(target: Extended, strips: Strips, vertices: Array, unrolled: Unrolled) -> Trimmed:
    """Cut strips along the boundary loops of a design.

    The loops are moved to the strips along the design's normals.

    Parameters
    ----------
    target : Extended
        The design; its diagonal is one.
    strips, vertices
        Strips with planar faces.
    unrolled : Unrolled
        Their unrolling.
    """
    import shapely

    triangles, face = strips.divided(vertices)
    place = plane(strips, triangles)
    design, normals = target.domain.mesh, target.normals
    step = float(np.median(lengths(np.diff(vertices[strips.sides], axis=1)[:, 0]))) / 3.0
    rings = []
    for loop in design.boundary_loops:
        both = _dense(np.concatenate([design.vertices[loop], normals[loop]], axis=1), step)
        which, shares = _traced(vertices, triangles, face, both)
        rings.append(_enclosed(np.einsum("kj,kjd->kd", shares, place[triangles[which]])))
    outer = int(np.argmax(shapely.area(rings)))
    holes = [ring for k, ring in enumerate(rings) if k != outer]
    region = rings[outer]
    if holes:
        region = steady(shapely.difference, region, steady(shapely.union_all, holes))
    c = strips.corners
    cells = shapely.polygons(place[c[:, [0, 1, 3, 2]]])
    pieces, which = shapely.get_parts(_clipped(cells, region), return_index=True)
    kept = (shapely.get_type_id(pieces) == 3) & (shapely.area(pieces) > 0)
    nodes = Nodes(strips, vertices, place)
    polygons = [
        (int(face), [nodes.ring(int(face), np.asarray(r.coords)[:-1]) for r in _rings(piece)])
        for piece, face in zip(pieces[kept], which[kept], strict=True)
    ]
    return meshed(polygons, nodes, unrolled)


def _clipped(cells: NDArray[np.object_], region: Geometry) -> Any:
    """Return the intersections of polygons with a region, on the finest grid that works."""
    import shapely

    for grid in _GRIDS[:-1]:
        try:
            return shapely.intersection(cells, region, grid_size=grid)
        except shapely.GEOSException:
            continue
    return steady(partial(shapely.intersection, grid_size=_GRIDS[-1]), cells, region)


def _traced(vertices: Array, triangles: Ints, face: Ints, line: Array) -> tuple[Ints, Array]:
    """Find where a closed polygon of points and normals (n, 6) meets triangles along the normals.

    Segments between different faces are halved until they are short, as the parameters are not
    linear across edges.
    """
    which, shares = _along_normals(vertices, triangles, line[:, :3], line[:, 3:])
    while True:
        after = np.roll(line, -1, axis=0)
        apart = face[which] != face[np.roll(which, -1)]
        k = np.flatnonzero(apart & (lengths((after - line)[:, :3]) > _SHORT))
        if not k.size:
            return which, shares
        middle = 0.5 * (line[k] + after[k])
        more = _along_normals(vertices, triangles, middle[:, :3], middle[:, 3:])
        line = np.insert(line, k + 1, middle, axis=0)
        which, shares = (np.insert(x, k + 1, y, axis=0) for x, y in zip((which, shares), more))


def _along_normals(
    vertices: Array, triangles: Ints, points: Array, normals: Array
) -> tuple[Ints, Array]:
    """Find where lines through points along normals meet triangles.

    The nearest point of the triangles is found first, and then, again and again, the nearest one
    to the intersection of the line and the plane of the last triangle. Returns triangles and
    barycentric coordinates; beyond the border, of the nearest points.
    """
    near = Nearest.of(vertices, triangles)
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    plane = unit(cross(b - a, c - a))
    which, shares, foot = nearest = near.locate(points)
    for _ in range(_TURNS):
        own = plane[which]
        slope = np.einsum("kd,kd->k", normals, own)
        height = np.einsum("kd,kd->k", foot - points, own)
        steep = np.abs(slope) < _STEEP
        far = np.where(steep, 0.0, height / np.where(steep, 1.0, slope))
        target = np.where(steep[:, None], foot, points + far[:, None] * normals)
        which, shares, foot = near.locate(target)

    def off(found: Array) -> Array:
        return lengths(cross(found - points, normals))

    # Lines that miss the triangles get the nearest points.
    missed = off(foot) > off(nearest[2]) + _MISSED
    which[missed], shares[missed] = nearest[0][missed], nearest[1][missed]
    return which, shares


def _enclosed(ring: Array) -> Geometry:
    """Return the region around which a closed polygon (n, 2) turns, as a Shapely polygon."""
    import shapely

    simple = shapely.Polygon(ring)
    if simple.is_valid:
        return simple
    noded = steady(partial(shapely.unary_union, grid_size=_GRIDS[2]), shapely.LinearRing(ring))
    parts = shapely.get_parts(shapely.polygonize([noded]))
    z = ring @ np.array([1.0, 1j])
    inside = []
    for part in parts:
        at = part.representative_point()
        way = z - complex(at.x, at.y)
        turns = np.angle(np.roll(way, -1) * way.conj()).sum() / (2.0 * np.pi)
        inside.append(abs(turns) > 0.5)
    return steady(shapely.union_all, parts[np.array(inside, bool)])


def _dense(loop: Array, step: float) -> Array:
    """Interpolate values (n, 3 + d) at points along a closed polygon, which come first.

    The distance of the points is at most a step.
    """
    edge = np.roll(loop, -1, axis=0) - loop
    count = np.maximum(np.ceil(lengths(edge[:, :3]) / step), 1).astype(np.int64)
    at = np.repeat(np.arange(len(loop)), count)
    share = (np.arange(len(at)) - np.repeat(np.cumsum(count) - count, count)) / count[at]
    return loop[at] + share[:, None] * edge[at]


def _rings(piece: Polygon) -> list[LinearRing]:
    return [piece.exterior, *piece.interiors]

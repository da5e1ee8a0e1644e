"""Holes cut out of strips that were made without them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gso import metrics
from gso.geometry.ears import divided
from gso.geometry.flat_region import region
from gso.geometry.plane import loop_axes
from gso.geometry.polygon import signed_area
from gso.geometry.steady import steady
from gso.geometry.vectors import cross, lengths, unit
from gso.mesh import Mesh, Nearest, topology
from gso.ruled.fold_lines import Folds
from gso.ruled.lines.line_surface import line_surface
from gso.ruled.lines.polygons import Polygons, area_vectors, inner_edges, sides
from gso.ruled.ruled_surface import RuledSurface
from gso.ruled.surface_polygons import SurfacePolygons
from gso.typing import Array, Flags, Ints
from gso.verdict import Code

if TYPE_CHECKING:
    from shapely import Geometry

#: Distance of points that are one, and of points that are on a line, relative to the diagonal.
_SAME = 1e-9
#: Area of polygons that are left out, relative to the square of the diagonal.
_EMPTY = 1e-10
#: Cosine of the angle between polygons and the plane of a hole below which they are too steep.
_STEEP = 0.3
#: Angle of a fold, in radians, that is none.
_FLAT = 1e-9


def without_holes(
    surface: RuledSurface, design: Mesh, holes: Sequence[Array]
) -> RuledSurface | None:
    """Cut holes out of a surface.

    The outline of each hole is moved to the nearest points of the surface. It is cut out of the
    polygons as they are seen along the normal of its plane. Parts of strips between a hole and
    another strip that are too small to be made are left out.

    Parameters
    ----------
    surface : RuledSurface
        A surface without these holes.
    design : Mesh
        What it is near: a surface with the holes.
    holes : sequence of ndarray, (k, 3)
        Their outlines.

    Returns
    -------
    RuledSurface or None
        None where a polygon has a hole already, and where the surface is steep around a hole.
    """
    read = SurfacePolygons.of(surface)
    if read is None:
        return None
    vertex = surface.pattern.vertex
    cut = _Cut(surface.mesh.vertices, [vertex[ring] for ring in read.rings])
    if not all(cut.out(loop) for loop in holes):
        return None
    cut.leave_out(read.pairs, (Code.SMALL.info.limit or 0.0) * metrics.area(design))
    none = np.empty((0, 3), np.int64)
    polygons = Polygons(
        cut.rings,
        np.zeros(len(cut.rings), np.int64),
        cut.rulings(read.pairs),
        none[:, :2],
        lines=none,
        across=none,
    )
    made = line_surface(design, polygons, cut.points, opened=none[:, :2])
    folds = made.rulings
    folded = np.abs(folds.angles) > _FLAT
    folds = Folds(folds.edges[folded], folds.angles[folded], folds.radii[folded])
    return replace(made, rulings=folds, crossed=surface.crossed).measured(design)


class _Cut:
    """Polygons of a surface, from which holes are cut one after the other.

    Attributes
    ----------
    points : ndarray, (n, 3)
        Vertices of the surface, and new ones.
    rings : list of ndarray of int
        Corners of the polygons.
    origin : ndarray of int, (p,)
        The polygon of the surface that each is in.
    """

    def __init__(self, points: Array, rings: list[Ints]):
        self.points, self.rings, self.origin = points, rings, np.arange(len(rings))
        triangles, self._owner = divided(rings, points)
        self._nearest = Nearest.of(points, triangles)
        self._size = float(np.linalg.norm(np.ptp(points, axis=0)))

    def out(self, loop: Array) -> bool:
        """Cut out a hole with an outline (k, 3); return whether that is possible."""
        import shapely

        triangle, _, moved = self._nearest.locate(loop)
        axes = loop_axes(moved)
        flat = self.points @ axes[:2].T
        hole = region(moved @ axes[:2].T)
        every, owner = sides(self.rings)
        shapes = shapely.polygons(shapely.linearrings(flat[every[:, 0]], indices=owner))
        at_rim = np.isin(self.origin, self._owner[triangle])
        reached = self._joined(shapely.intersects(shapes, hole), at_rim)
        normals = unit(area_vectors(self.rings, self.points)[reached])
        facing = normals @ axes[2]
        seen = (facing > _STEEP).all() or (facing < -_STEEP).all()
        if not (reached.size and seen and shapely.is_valid(shapes[reached]).all()):
            return False
        pieces, of_piece = [], []
        for row, k in enumerate(reached.tolist()):
            outline = flat[self.rings[k]]
            for piece in _without_rings(steady(shapely.difference, shapes[k], hole), outline):
                if piece.area > _EMPTY * self._size**2:
                    ring = np.asarray(piece.exterior.coords)[:-1]
                    same = (signed_area(ring) > 0) == (signed_area(outline) > 0)
                    pieces.append(ring if same else ring[::-1])
                    of_piece.append(row)
        self._replace(reached, pieces, np.array(of_piece, np.int64), axes, normals)
        return True

    def rulings(self, pairs: Ints) -> Ints:
        """Return the edges (k, 2) along rulings, and those where a polygon was divided.

        Parameters
        ----------
        pairs : ndarray of int, (r, 2)
            Polygons of the surface on both sides of rulings.
        """
        return self._hinges(pairs)[:, 2:]

    def leave_out(self, pairs: Ints, least: float) -> None:
        """Leave out the parts of strips that were cut off and have less than an area."""
        label = topology.label_components(len(self.rings), *self._hinges(pairs)[:, :2].T)
        area = 0.5 * lengths(area_vectors(self.rings, self.points))
        small = np.bincount(label, area) < least
        strip = topology.label_components(int(self.origin.max()) + 1, *pairs.T)[self.origin]
        # What is left of a strip has other parts.
        parts = np.unique(np.stack([strip, label], axis=1), axis=0)[:, 0]
        kept = ~small[label] | (np.bincount(parts)[strip] == 1)
        self.rings = [ring for ring, keep in zip(self.rings, kept, strict=True) if keep]
        self.origin = self.origin[kept]

    def _hinges(self, pairs: Ints) -> Ints:
        """Return those edges with the polygons that they join, as :func:`inner_edges` does."""
        inner = inner_edges(self.rings)
        one, two = inner[:, :2].T
        both = np.sort(np.stack([self.origin[one], self.origin[two]], axis=1), axis=1)
        count = int(self.origin.max()) + 1
        known = np.isin(topology.pair_keys(both, count), topology.pair_keys(pairs, count))
        joined = known | (both[:, 0] == both[:, 1])
        return np.asarray(inner[joined])

    def _joined(self, near: Flags, start: Flags) -> Ints:
        """Return the polygons of a mask that are joined to those of another, through others."""
        one, two = inner_edges(self.rings)[:, :2].T
        both = near[one] & near[two]
        label = topology.label_components(len(self.rings), one[both], two[both])
        out: Ints = np.flatnonzero(near & np.isin(label, label[start & near]))
        return out

    def _replace(
        self, reached: Ints, pieces: list[Array], of_piece: Ints, axes: Array, normals: Array
    ) -> None:
        """Replace polygons by pieces of them.

        Parameters
        ----------
        reached : ndarray of int, (r,)
            The polygons.
        pieces : list of ndarray, (k, 2)
            Outlines of the pieces in the plane of two axes.
        of_piece : ndarray of int, (len(pieces),)
            Which of the polygons each is in.
        axes : ndarray, (3, 3)
        normals : ndarray, (r, 3)
            Those of the polygons.
        """
        from scipy.spatial import cKDTree

        same, count = _SAME * self._size, len(self.points)
        places = np.concatenate([np.empty((0, 2)), *pieces])
        of_place = np.repeat(of_piece, [len(piece) for piece in pieces])
        old = np.unique(np.concatenate([self.rings[k] for k in reached]))
        away, k = cKDTree(self.points[old] @ axes[:2].T).query(places)
        number = np.where(away <= same, old[k], -1)
        fresh = np.flatnonzero(number < 0)
        one, two = cKDTree(places[fresh]).query_pairs(same, output_type="ndarray").T
        label = topology.label_components(len(fresh), one, two)
        _, first, label = np.unique(label, return_index=True, return_inverse=True)
        number[fresh] = count + label
        # Above its place in the plane, in the plane of its polygon.
        row, above = of_place[fresh[first]], places[fresh[first]] @ axes[:2]
        corner = self.points[[self.rings[k][0] for k in reached]][row]
        height = np.einsum("kd,kd->k", corner - above, normals[row]) / (normals[row] @ axes[2])
        self.points = np.concatenate([self.points, above + height[:, None] * axes[2]])
        kept = np.setdiff1d(np.arange(len(self.rings)), reached)
        ends = np.cumsum([len(piece) for piece in pieces])[:-1]
        rings = np.split(number, ends)[: len(pieces)]
        rings = [ring[ring != np.roll(ring, 1)] for ring in rings]
        self.rings = [*(self.rings[k] for k in kept), *rings]
        self.origin = np.concatenate([self.origin[kept], self.origin[reached][of_piece]])
        self._insert(np.arange(count, len(self.points)))

    def _insert(self, ids: Ints) -> None:
        """Insert vertices into the sides of polygons that they are on."""
        every, owner = sides(self.rings)
        a, b = self.points[every].transpose(1, 0, 2)
        way, long = unit(b - a), lengths(b - a)
        inside: dict[int, list[tuple[int, float, int]]] = {}
        for v in ids.tolist():
            off = self.points[v] - a
            at = np.einsum("sd,sd->s", off, way)
            on = (lengths(cross(off, way)) <= _SAME * self._size) & (at > 0.0) & (at < long)
            for k in np.flatnonzero(on & (every != v).all(axis=1)).tolist():
                place = int(np.flatnonzero(self.rings[owner[k]] == every[k, 0])[0])
                inside.setdefault(int(owner[k]), []).append((place, float(at[k]), v))
        for ring, new in inside.items():
            new.sort()
            where = [place + 1 for place, _, _ in new]
            self.rings[ring] = np.insert(self.rings[ring], where, [v for _, _, v in new])


def _without_rings(shape: Geometry, outline: Array) -> Iterator[Geometry]:
    """Return the polygons of a shape, divided along the longest side of a polygon (k, 2) at holes.

    A ruling is the longest side of most polygons.
    """
    import shapely

    for part in shapely.get_parts(shape):
        if part.geom_type == "Polygon" and not part.interiors:
            yield part
        elif part.geom_type == "Polygon":
            side = np.roll(outline, -1, axis=0) - outline
            way = unit(side[int(lengths(side).argmax())]) * 2.0 * lengths(side).sum()
            left = np.array([-way[1], way[0]])
            middle = np.array(shapely.Polygon(part.interiors[0]).centroid.coords[0])
            for beyond in (left, -left):
                half = [middle - way, middle + way, middle + way + beyond, middle - way + beyond]
                cut = steady(shapely.intersection, part, shapely.Polygon(half))
                yield from _without_rings(cut, outline)

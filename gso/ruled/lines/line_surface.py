"""Ruled surfaces of planar polygons: faces, folds, and the exact unrolling."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.geometry.ears import divided
from gso.geometry.vectors import cross, lengths, unit
from gso.mesh import Mesh, Nearest, topology
from gso.parametrization import beside, upright
from gso.pattern import Pattern
from gso.ruled.fold_lines import Folds, bend_radii
from gso.ruled.lines.polygons import Polygons, area_vectors, inner_edges, middles, sides
from gso.ruled.ruled_surface import RuledSurface
from gso.ruled.sheet import seam_pairs
from gso.ruled.strip_layout import Strips
from gso.ruled.untrimmed import Untrimmed
from gso.typing import Array, Flags, Ints


def line_surface(
    design: Mesh,
    polygons: Polygons,
    points: Array,
    ends: Ints | None = None,
    opened: Ints | None = None,
) -> RuledSurface:
    """Make a ruled surface of planar polygons, and unroll it.

    Parameters
    ----------
    design : Mesh
        What the surface is near.
    polygons : Polygons
    points : ndarray, (n, 3)
        Positions of the design's vertices, some of which are corners of the polygons.
    ends : ndarray of int, (p + 1, 2), optional
        Of a single strip, the ends of the rulings before, between and after the polygons, with
        which smooth surfaces can be made of it.
    opened : ndarray of int, (k, 2), optional
        Rulings along which strips are cut open that close around; there must be some in each of
        these. By default strips with several ways around are cut until there is one.
    """
    used = np.unique(np.concatenate(polygons.rings))
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    vertices, rings = points[used], [number[ring] for ring in polygons.rings]
    faces, owner = _faces(rings, vertices)
    mesh = Mesh(vertices, faces)
    # Triangles only: the fourth corner is gone.
    faces = faces[:, : mesh.faces.shape[1]]
    planes = _Planes.of(rings, vertices)
    hinges, creases = _edges(rings, number[polygons.rulings])
    if opened is None:
        tree = _tree(hinges, vertices, len(rings))
    else:
        count = len(vertices)
        cut = topology.pair_keys(number[opened], count)
        tree = ~np.isin(topology.pair_keys(hinges[:, 2:], count), cut)
    table, flat, part = _unrolled(planes, rings, vertices, hinges, tree, faces, owner)
    vertex = np.empty(len(flat), np.int64)
    inside = table >= 0
    vertex[table[inside]] = faces[inside]
    if len(flat) == len(vertices):
        # Nothing is cut: the vertices are those of the surface, in their order.
        table, flat, vertex = faces, flat[np.argsort(vertex)], np.arange(len(vertices))
    closing = hinges[~tree]
    return RuledSurface(
        mesh=mesh,
        strip=part[owner],
        flat=np.zeros(len(faces), bool),
        rulings=_folds(hinges[tree], part[hinges[tree, 0]], planes, rings, vertices),
        creases=_sharp(np.concatenate([creases, closing]), planes),
        pattern=Pattern(flat, table, vertex, seam_pairs(mesh, table)),
        moved=Nearest(mesh).locate(design.vertices)[2],
        crossed=int(_tangled(rings, planes, vertices).sum()),
        untrimmed=None if ends is None else Untrimmed(Strips((number[ends],)), vertices, owner),
    )


@dataclass(frozen=True)
class _Planes:
    """Planes of polygons.

    Attributes
    ----------
    origin, normal : ndarray, (p, 3)
    axes : ndarray, (p, 2, 3)
    """

    origin: Array
    normal: Array
    axes: Array

    @classmethod
    def of(cls, rings: list[Ints], vertices: Array) -> _Planes:
        """Return the planes of polygons, seen from where these are anticlockwise."""
        every, owner = sides(rings)
        way = np.diff(vertices[every], axis=1)[:, 0]
        origin, normal = middles(rings, vertices), unit(area_vectors(rings, vertices))
        # The longest side is along the first axis.
        order = np.lexsort((-lengths(way), owner))
        way = way[order[np.flatnonzero(np.diff(owner, prepend=-1))]]
        way = unit(way - np.einsum("pd,pd->p", way, normal)[:, None] * normal)
        return cls(origin, normal, np.stack([way, cross(normal, way)], axis=1))

    def local(self, polygon: Ints, points: Array) -> Array:
        """Return complex coordinates (k,) of points (k, 3) in the planes of polygons (k,)."""
        both = np.einsum("kid,kd->ki", self.axes[polygon], points - self.origin[polygon])
        return np.asarray(both @ np.array([1.0, 1j]))


def _faces(rings: list[Ints], vertices: Array) -> tuple[Ints, Ints]:
    """Return quads and triangles, and the polygon of each: convex quads stay whole."""
    triangles, owner = divided(rings, vertices)
    faces = np.column_stack([triangles, np.full(len(triangles), -1)])
    four = np.flatnonzero([len(ring) == 4 for ring in rings])
    quads = np.array([rings[k] for k in four.tolist()], np.int64).reshape(-1, 4)
    corner = vertices[quads]
    turns = cross(corner - np.roll(corner, 1, axis=1), np.roll(corner, -1, axis=1) - corner)
    convex = (np.einsum("kcd,kd->kc", turns, turns.sum(axis=1)) > 0).all(axis=1)
    # Both triangles of a convex quad become one face.
    first = np.searchsorted(owner, four[convex])
    faces[first] = quads[convex]
    kept = np.ones(len(faces), bool)
    kept[first + 1] = False
    return faces[kept], owner[kept]


def _edges(rings: list[Ints], rulings: Ints) -> tuple[Ints, Ints]:
    """Return the rulings and the other inner edges, (k, 4) each: two polygons and two ends."""
    inner, count = inner_edges(rings), int(max(ring.max() for ring in rings)) + 1
    is_ruling = np.isin(topology.pair_keys(inner[:, 2:], count), topology.pair_keys(rulings, count))
    return inner[is_ruling], inner[~is_ruling]


def _tree(hinges: Ints, vertices: Array, count: int) -> Flags:
    """Mask over rulings: those that stay joined; closed strips are cut at a short one."""
    from scipy.sparse.csgraph import minimum_spanning_tree

    size = lengths(vertices[hinges[:, 2]] - vertices[hinges[:, 3]])
    order = np.empty(len(size))
    order[np.argsort(-size, kind="stable")] = np.arange(1.0, len(size) + 1)
    low, high = hinges[:, :2].min(axis=1), hinges[:, :2].max(axis=1)
    # Of two rulings between the same polygons the longer one stays.
    by = np.lexsort((order, high, low))
    new = np.ones(len(by), bool)
    new[1:] = (low[by][1:] != low[by][:-1]) | (high[by][1:] != high[by][:-1])
    kept = by[new]
    graph = topology.edge_graph(count, low[kept], high[kept], order[kept])
    return np.isin(order, minimum_spanning_tree(graph).data)


def _unrolled(
    planes: _Planes,
    rings: list[Ints],
    vertices: Array,
    hinges: Ints,
    tree: Flags,
    faces: Ints,
    owner: Ints,
) -> tuple[Ints, Array, Ints]:
    """Return the pattern's faces, its vertices (k, 2), and the part of each polygon."""
    from scipy.sparse.csgraph import breadth_first_order

    count = len(rings)
    joined = hinges[tree]
    # Two polygons may meet along several edges.
    first = np.unique(np.sort(joined[:, :2], axis=1), axis=0, return_index=True)[1]
    number = np.arange(1.0, len(joined) + 1)[first]
    graph = topology.edge_graph(count, joined[first, 0], joined[first, 1], number)
    graph = graph + graph.T
    part = topology.label_components(count, joined[:, 0], joined[:, 1])
    turn, shift = np.ones(count, complex), np.zeros(count, complex)
    for k in np.unique(part, return_index=True)[1]:
        order, before = breadth_first_order(graph, int(k), directed=False)
        for cell in order[1:].tolist():
            last = int(before[cell])
            ends = vertices[joined[int(graph[cell, last]) - 1, 2:]]
            p, q = turn[last] * planes.local(np.array([last, last]), ends) + shift[last]
            a, b = planes.local(np.array([cell, cell]), ends)
            turn[cell] = (q - p) / (b - a)
            turn[cell] /= abs(turn[cell])
            shift[cell] = 0.5 * (p + q) - turn[cell] * 0.5 * (a + b)
    # Corners of polygons are one vertex where rulings join them.
    size = np.array([len(ring) for ring in rings])
    cell, ids = np.repeat(np.arange(count), size), np.concatenate(rings)
    key = cell * len(vertices) + ids
    order = np.argsort(key)

    def corner(of: Ints, at: Ints) -> Ints:
        return order[np.searchsorted(key[order], of * len(vertices) + at)]

    one, two = (
        np.concatenate([corner(joined[:, k], joined[:, end]) for end in (2, 3)]) for k in (0, 1)
    )
    label = topology.label_components(len(ids), one, two)
    z = turn[cell] * planes.local(cell, vertices[ids]) + shift[cell]
    uses = np.bincount(label)
    flat = np.stack([np.bincount(label, x) / uses for x in (z.real, z.imag)], axis=1)
    of = np.empty(len(flat), np.int64)
    of[label] = part[cell]
    pieces = [upright(flat[of == k]) for k in range(int(part.max()) + 1)]
    for k, piece in enumerate(beside([p[:, ::-1] * [1.0, -1.0] for p in pieces])):
        flat[of == k] = piece
    table = np.full(faces.shape, -1)
    row, place = np.nonzero(faces >= 0)
    table[row, place] = label[corner(owner[row], faces[row, place])]
    return table, flat, part


def _turns(edges: Ints, planes: _Planes) -> Array:
    """Return the angles at edges between polygons, negative for valley folds."""
    one, two = edges[:, 0], edges[:, 1]
    n = planes.normal
    angle = 2.0 * np.arcsin(np.clip(0.5 * lengths(n[one] - n[two]), 0.0, 1.0))
    away = planes.origin[two] - planes.origin[one]
    return np.where(np.einsum("kd,kd->k", n[two] - n[one], away) < 0, -angle, angle)


def _sharp(edges: Ints, planes: _Planes) -> Folds:
    return Folds(edges[:, 2:], _turns(edges, planes), np.zeros(len(edges)))


def _folds(hinges: Ints, strip: Ints, planes: _Planes, rings: list[Ints], vertices: Array) -> Folds:
    """Return the rulings of strips (r,), with radii from the distances of the next rulings."""
    angle, count = _turns(hinges, planes), len(hinges)
    cell, own = hinges[:, :2].T.ravel(), np.tile(np.arange(count), 2)
    order = np.lexsort((own, cell))
    begins = np.flatnonzero(np.diff(cell[order], prepend=-1))
    after = np.arange(1, 2 * count + 1)
    after[np.r_[begins[1:], 2 * count] - 1] = begins
    other = np.empty_like(own)
    other[order] = own[order][after]
    ends = vertices[hinges[own, 2:]]
    a, b = vertices[hinges[other, 2:]].transpose(1, 0, 2)
    off = lengths(cross(ends - a[:, None], np.broadcast_to(unit(b - a)[:, None], ends.shape)))
    for k in np.flatnonzero(other == own):
        corner = vertices[rings[cell[k]]]
        way = np.broadcast_to(unit(ends[k, 1] - ends[k, 0]), corner.shape)
        off[k] = lengths(cross(corner - ends[k, 0], way)).max()
    meeting = strip[:, None] * len(vertices) + hinges[:, 2:]
    radius = bend_radii(meeting, 0.5 * (off[:count] + off[count:]), angle)
    return Folds(hinges[:, 2:], angle, radius)


def _tangled(rings: list[Ints], planes: _Planes, vertices: Array) -> Flags:
    """Return whether quads cross themselves: two of their corners are reflex."""
    out = np.zeros(len(rings), bool)
    where = np.flatnonzero([len(ring) == 4 for ring in rings])
    if len(where):
        corner = vertices[np.array([rings[k] for k in where])]
        before, after = corner - np.roll(corner, 1, axis=1), np.roll(corner, -1, axis=1) - corner
        turns = np.einsum("kcd,kd->kc", cross(before, after), planes.normal[where])
        out[where] = (turns < 0).sum(axis=1) > 1
    return out

"""A ruled surface of planar faces, its rulings and its exact unrolling."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from gso import faults, metrics
from gso.errors import MeshError
from gso.mesh import Mesh
from gso.mesh.closest_point import Nearest
from gso.parametrization import beside, upright
from gso.pattern import Bend, Pattern
from gso.ruled.fit import Fit, Job
from gso.ruled.layout import Strips
from gso.ruled.trim import trimmed
from gso.ruled.unroll import Unrolled
from gso.ruled.vectors import cross, lengths, unit
from gso.typing import Array, Flags, Ints

#: Names of the arrays in files.
_FOLDS, _PARTS = ("rulings", "creases"), ("edges", "angles", "radii")
_PATTERN = ("flat", "faces", "vertex", "seams")
#: Spacing of the samples by which distances are measured, relative to the diagonal.
_FINE = 0.012


@dataclass(frozen=True)
class Folds:
    """Edges along which planar faces meet.

    Attributes
    ----------
    edges : ndarray of int, (r, 2)
        Their ends, as vertices of the mesh.
    angles : ndarray, (r,)
        Angles between the faces in radians: positive for mountain folds, which are convex on
        the outside of the surface, negative for valley folds.
    radii : ndarray, (r,)
        Radius of the bend that a fold stands for, at the end where it is smaller, in the
        mesh's unit; infinite where there is no fold.
    """

    edges: Ints
    angles: Array
    radii: Array

    @property
    def smallest_radius(self) -> float:
        """The smallest radius; infinite without folds."""
        return float(self.radii.min(initial=np.inf))

    @property
    def largest_angle(self) -> float:
        """The largest angle, regardless of its sign, in radians."""
        return float(np.abs(self.angles).max(initial=0.0))


@dataclass(frozen=True)
class RuledSurface:
    """An exactly developable surface: planar faces between straight rulings.

    Attributes
    ----------
    mesh : Mesh
        The surface. Faces between the same two rulings are coplanar.
    strip : ndarray of int, (m,)
        Strip that each face belongs to: strips side by side are separate parts of the pattern.
    flat : ndarray of bool, (m,)
        Whether each face belongs to a flat triangle between three strips.
    rulings : Folds
        The lines to bend along, inside the outline.
    creases : Folds
        The edges of the curves between strips side by side; empty for a single strip.
    pattern : Pattern
        The exact unrolling. Creases are cut.
    moved : ndarray, (n, 3)
        The design's vertices, moved to the nearest points of the surface.
    crossed : int
        Number of pairs of successive rulings that cross.
    """

    mesh: Mesh
    strip: Ints
    flat: Flags
    rulings: Folds
    creases: Folds
    pattern: Pattern
    moved: Array
    crossed: int

    @property
    def strips(self) -> int:
        """Number of strips side by side."""
        return int(self.strip.max()) + 1

    @cached_property
    def sound(self) -> bool:
        """Whether neither surface nor pattern is folded or meets itself, and no rulings cross."""
        sheet = self.pattern.surface(self.mesh)
        return not (
            self.crossed
            or faults.folded(self.mesh).size
            or metrics.flipped_faces(sheet, self.pattern.flat).size
            or faults.overlaps(sheet, self.pattern.flat).size
            or faults.crossings(self.mesh).size
        )

    @property
    def bends(self) -> list[Bend]:
        """The rulings in the pattern."""
        pattern = self.pattern
        inner = pattern.mesh.half_edges
        k = np.flatnonzero((inner.twin >= 0) & (inner.origin < inner.dest))
        ends = np.stack([inner.origin[k], inner.dest[k]], axis=1)
        count = len(self.mesh.vertices)
        key, rulings = (
            np.sort(e, axis=1) @ [count, 1] for e in (pattern.vertex[ends], self.rulings.edges)
        )
        order = np.argsort(rulings)
        at = order[np.minimum(np.searchsorted(rulings[order], key), len(order) - 1)]
        lines = pattern.flat[ends]
        angles, radii = self.rulings.angles.tolist(), self.rulings.radii.tolist()
        return [
            Bend(lines[n], angles[at[n]], radii[at[n]])
            for n in np.flatnonzero(np.isin(key, rulings))
        ]

    def arrays(self) -> dict[str, Array]:
        """Return the surface as arrays by name, except `moved`; see :meth:`from_arrays`."""
        out: dict[str, Any] = {
            "ruled_vertices": self.mesh.vertices,
            "ruled_faces": self.mesh.faces,
            "ruled_strip": self.strip,
            "ruled_flat": self.flat.astype(np.uint8),
            "ruled_crossed": np.array(self.crossed),
        }
        for name in _FOLDS:
            folds: Folds = getattr(self, name)
            out |= {f"ruled_{name}_{part}": getattr(folds, part) for part in _PARTS}
        return out | {f"ruled_pattern_{part}": getattr(self.pattern, part) for part in _PATTERN}

    @classmethod
    def from_arrays(cls, data: Mapping[str, Any], moved: Array) -> RuledSurface | None:
        """Return the surface that :meth:`arrays` describes; None if there is none.

        Raises
        ------
        KeyError, ValueError
            Arrays are missing or do not fit each other.
        """
        if "ruled_faces" not in data:
            return None
        mesh = Mesh(data["ruled_vertices"], data["ruled_faces"])
        pattern = Pattern(*(data[f"ruled_pattern_{part}"] for part in _PATTERN))
        folds = [Folds(*(data[f"ruled_{name}_{part}"] for part in _PARTS)) for name in _FOLDS]
        for ids, end in (
            (pattern.faces, len(pattern.flat)),
            (pattern.vertex, len(mesh.vertices)),
            (pattern.seams, len(pattern.flat)),
            *((fold.edges, len(mesh.vertices)) for fold in folds),
        ):
            if ids.dtype.kind not in "iu" or (ids.size and not -1 <= ids.min() <= ids.max() < end):
                raise ValueError("the arrays of the ruled surface do not fit each other")
        if pattern.faces.shape != mesh.faces.shape or any(
            len(data[f"ruled_{name}"]) != len(mesh.faces) for name in ("strip", "flat")
        ):
            raise ValueError("the arrays of the ruled surface do not fit each other")
        crossed = int(data["ruled_crossed"])
        flat = np.asarray(data["ruled_flat"], bool)
        rulings, creases = folds
        return cls(mesh, data["ruled_strip"], flat, rulings, creases, pattern, moved, crossed)

    def samples(self) -> tuple[Array, Array]:
        """Return points (k, 3) all over the surface, and their shares (k,) of its area.

        The last points, on the edges, have no share.
        """
        v, f = self.mesh.vertices, self.mesh.triangles
        step = _FINE * self.mesh.diagonal
        a, b, c = _by_longest_side(v, f)
        long, area = lengths(b - a), 0.5 * lengths(cross(b - a, c - a))
        rows = np.ceil(long / step).astype(np.int64)
        columns = np.ceil(2.0 * area / (long * step)).astype(np.int64)
        count = rows * columns
        at = np.repeat(np.arange(len(f)), count)
        k = np.arange(len(at)) - np.repeat(np.cumsum(count) - count, count)
        s, t = (k % rows[at] + 0.5) / rows[at], (k // rows[at] + 0.5) / columns[at]
        # A square with its far side shrunk to a point; t is chosen so that areas are equal.
        t = 1.0 - np.sqrt(1.0 - t)
        inner = a[at] + (s * (1.0 - t))[:, None] * (b - a)[at] + t[:, None] * (c - a)[at]
        edges = self.mesh.edges
        parts = np.ceil(lengths(v[edges[:, 1]] - v[edges[:, 0]]) / step).astype(np.int64)
        on = np.repeat(np.arange(len(edges)), parts)
        share = (np.arange(len(on)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[on]
        p, q = v[edges[on]].transpose(1, 0, 2)
        border = p + share[:, None] * (q - p)
        weight = np.r_[(area / count)[at], np.zeros(len(border))]
        return np.concatenate([inner, border, v]), np.r_[weight, np.zeros(len(v))] / area.sum()

    def distances(self, design: Mesh) -> metrics.Distances:
        """Measure the distances from a design, in its unit, all over both surfaces.

        "There" is from the surface to the design, "back" from the design's vertices to it. The
        largest distances include those between the boundary curves, so that a slit counts with
        its depth.
        """
        points, weight = self.samples()
        there = metrics.point_to_surface(points, design)
        back = metrics.point_to_surface(design.vertices[design.used], self.mesh)
        rim_there, rim_back = metrics.boundary_distance(design, self.mesh)
        return metrics.Distances(
            float(weight @ there),
            max(float(there.max()), rim_there),
            float(back.mean()),
            max(float(back.max()), rim_back),
        )

    def transformed(self, move: Any, scale: float, back: Any) -> RuledSurface:
        """Return the surface in another frame.

        Parameters
        ----------
        move : callable
            Maps points (k, 3) by a similarity transform.
        scale : float
            Its factor.
        back : callable
            Maps the rows of `moved` to another numbering.
        """
        return replace(
            self,
            mesh=self.mesh.replaced(move(self.mesh.vertices)),
            rulings=replace(self.rulings, radii=scale * self.rulings.radii),
            creases=replace(self.creases, radii=scale * self.creases.radii),
            pattern=replace(self.pattern, flat=scale * self.pattern.flat),
            moved=move(back(self.moved)),
        )


def _by_longest_side(v: Array, f: Ints) -> tuple[Array, Array, Array]:
    """Return the corners (t, 3) of triangles, the longest side between the first two."""
    side = lengths(v[np.roll(f, -1, axis=1)] - v[f])
    first = side.argmax(axis=1)[:, None]
    a, b, c = (v[np.take_along_axis(f, (first + k) % 3, axis=1)[:, 0]] for k in range(3))
    return a, b, c


def built(job: Job, fit: Fit) -> RuledSurface:
    """Trim and unroll strips."""
    strips, vertices = fit.strips, fit.vertices
    if not strips.is_disk:
        raise MeshError(
            "no rulings were found on this surface, as they all run into each other; it may be "
            "folded or too irregular for the formulation 'ruled': take 'curvature'"
        )
    measured = job.energy(strips, vertices, fit.width).measure(vertices)
    unrolled = Unrolled(strips, vertices, measured.up)
    cut = trimmed(job.target, strips, vertices, unrolled)
    mesh = Mesh(cut.vertices, cut.faces)
    part = unrolled.part[cut.face]
    place = Nearest.of(vertices, strips.divided(vertices)[0])
    _, _, moved = place.locate(job.target.domain.mesh.vertices)
    rulings, creases = _folds(strips, vertices, unrolled, mesh, cut.face)
    return RuledSurface(
        mesh=mesh,
        strip=part,
        flat=cut.face >= len(strips.corners) - len(strips.flats),
        rulings=rulings,
        creases=creases,
        pattern=_pattern(mesh, cut.face, part, unrolled),
        moved=moved,
        crossed=int(((measured.gap <= 0).any(axis=1) | strips.tangled(vertices)).sum()),
    )


def _folds(
    strips: Strips, vertices: Array, unrolled: Unrolled, mesh: Mesh, owner: Ints
) -> tuple[Folds, Folds]:
    he = mesh.half_edges
    k = np.flatnonzero((he.twin >= 0) & (he.origin < he.dest))
    one, two = owner[he.face[k]], owner[he.face[he.twin[k]]]
    k, one, two = k[one != two], one[one != two], two[one != two]
    edges = np.stack([he.origin[k], he.dest[k]], axis=1)
    n = unrolled.normals
    sine = lengths(n[one] - n[two])
    angle = 2.0 * np.arcsin(np.clip(0.5 * sine, 0.0, 1.0))
    middle = vertices[strips.corners].mean(axis=1)
    away = middle[two] - middle[one]
    angle = np.where(np.einsum("kd,kd->k", n[two] - n[one], away) < 0, -angle, angle)
    width = 0.5 * sum(_widths(strips, vertices, mesh.vertices[edges], face) for face in (one, two))
    with np.errstate(divide="ignore"):
        radius = np.asarray(width).min(axis=1) / (2.0 * np.sin(0.5 * np.abs(angle)))
    a, b, _ = strips.creases
    size = len(strips.corners)
    crease = np.isin(
        np.minimum(one, two) * size + np.maximum(one, two),
        np.minimum(a, b) * size + np.maximum(a, b),
    )
    every = [Folds(edges[at], angle[at], radius[at]) for at in (~crease, crease)]
    return every[0], replace(every[1], radii=np.zeros(int(crease.sum())))


def _widths(strips: Strips, vertices: Array, ends: Array, face: Ints) -> Array:
    """Return the distances (r, 2) of the ends of rulings from the other ruling of a face."""
    p, q, p1, q1 = vertices[strips.corners[face]].transpose(1, 0, 2)
    found = []
    for a, b in ((p, q), (p1, q1)):
        way = unit(b - a)
        off = ends - a[:, None]
        off = off - np.einsum("red,rd->re", off, way)[:, :, None] * way[:, None]
        found.append(lengths(off))
    # The ruling itself is at no distance.
    own = found[0].max(axis=1) < found[1].max(axis=1)
    return np.where(own[:, None], found[1], found[0])


def _pattern(mesh: Mesh, owner: Ints, part: Ints, unrolled: Unrolled) -> Pattern:
    faces = mesh.faces
    face, corner = np.nonzero(faces >= 0)
    ids = faces[face, corner]
    first, which = _copies(mesh, part)
    table = np.full_like(faces, -1)
    table[face, corner] = which
    flat = unrolled.flat(owner[face[first]], mesh.vertices[ids[first]])
    label = part[face[first]]
    pieces = [upright(flat[label == k])[:, ::-1] * [1.0, -1.0] for k in range(int(part.max()) + 1)]
    for k, piece in enumerate(beside(pieces)):
        flat[label == k] = piece
    return Pattern(flat, table, ids[first], _seams(mesh, table))


def _copies(mesh: Mesh, part: Ints) -> tuple[Ints, Ints]:
    """Number copies of the vertices: corners have the same one if inner edges join their faces.

    Returns
    -------
    first, which : ndarray of int, (n,), (c,)
        A corner of each copy, and the copy of each corner; corners are in the order of the faces.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    faces = mesh.faces
    number = np.full(faces.shape, -1)
    number[faces >= 0] = np.arange(int((faces >= 0).sum()))

    def corners(face: Ints, vertex: Ints) -> Ints:
        at = (faces[face] == vertex[:, None]).argmax(axis=1)
        return np.asarray(number[face, at])

    he = mesh.half_edges
    k = np.flatnonzero((he.twin >= 0) & (he.origin < he.dest))
    one, two = he.face[k], he.face[he.twin[k]]
    same = part[one] == part[two]
    k, one, two = k[same], one[same], two[same]
    ends = [(corners(one, v), corners(two, v)) for v in (he.origin[k], he.dest[k])]
    i, j = (np.concatenate(x) for x in zip(*ends, strict=True))
    size = int(number.max()) + 1
    graph = coo_matrix((np.ones(len(i)), (i, j)), shape=(size, size))
    _, which = connected_components(graph, directed=False)
    _, first = np.unique(which, return_index=True)
    # In the order of the parts, and of the vertices in each.
    face, corner = np.nonzero(faces >= 0)
    order = np.lexsort((faces[face, corner][first], part[face][first]))
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return first[order], rank[which]


def _seams(mesh: Mesh, table: Ints) -> Ints:
    """Return the pairs of pattern edges that are one edge of the surface."""
    he = mesh.half_edges
    k = np.flatnonzero((he.twin >= 0) & (he.origin < he.dest))
    ends = []
    for half in (k, he.twin[k]):
        rows, own = mesh.faces[he.face[half]], table[he.face[half]]
        ends.append(
            [
                np.take_along_axis(own, (rows == v[:, None]).argmax(axis=1)[:, None], 1)[:, 0]
                for v in (he.origin[k], he.dest[k])
            ]
        )
    pairs = np.stack([np.stack(e, axis=1) for e in ends], axis=1)
    return pairs[(pairs[:, 0] != pairs[:, 1]).any(axis=1)]

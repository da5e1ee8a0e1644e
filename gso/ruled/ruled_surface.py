"""A ruled surface of planar faces, its rulings and its exact unrolling."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np

from gso import faults, metrics
from gso.errors import MeshError
from gso.geometry.vectors import cross, lengths, unit
from gso.mesh import Mesh, Nearest
from gso.mesh.topology import pair_keys
from gso.pattern import Bend, Folded, Pattern
from gso.ruled.fold_lines import Folds, folds
from gso.ruled.pleat_angles import pleats
from gso.ruled.sheet import unrolled_pattern
from gso.ruled.strip_fit import Fit, Job
from gso.ruled.trim import trimmed
from gso.ruled.unroll import Unrolled
from gso.ruled.untrimmed import Untrimmed
from gso.short_repr import html_repr, short_repr
from gso.typing import Array, Flags, Ints

_Map: TypeAlias = Callable[[Array], Array]

#: Names of the arrays in files.
_FOLDS, _PARTS = ("rulings", "creases"), ("edges", "angles", "radii")
#: Spacing of the samples by which distances are measured, relative to the diagonal.
_FINE = 0.012


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
    untrimmed : Untrimmed or None
        The strips that it was cut out of; None for strips along lines of the design and between
        seams, which are not cut, for those divided for a sheet, and in files of earlier versions.
    deviation : Distances or None
        Its distances from the design, where they are known; see :meth:`distances`.
    pleats : ndarray, (strips,), or None
        The largest pleat of each strip in radians, where it is known; see
        :func:`gso.ruled.pleats`.
    strain : float or None
        The largest strain of the pattern, for a design that is kept as it is: by the equations of
        its faces, as edges of the mesh are chords of round faces. None where it is measured.
    """

    mesh: Mesh
    strip: Ints
    flat: Flags
    rulings: Folds
    creases: Folds
    pattern: Pattern
    moved: Array
    crossed: int
    untrimmed: Untrimmed | None = None
    deviation: metrics.Distances | None = None
    pleats: Array | None = None
    strain: float | None = None

    __repr__ = short_repr
    _repr_html_ = html_repr

    @property
    def strips(self) -> int:
        """Number of strips side by side."""
        return int(self.strip.max()) + 1

    @property
    def farthest(self) -> float:
        """The largest distance from the design, both ways; 0 where it is not known."""
        far = self.deviation
        return 0.0 if far is None else far.largest

    @property
    def pleat_max(self) -> float:
        """The largest pleat in degrees; 0 where it is not known."""
        return 0.0 if self.pleats is None else float(np.degrees(self.pleats.max(initial=0.0)))

    @property
    def pleated(self) -> bool:
        """Whether a strip is known to be pleated."""
        return self.pleat_max > faults.PLEATED

    @property
    def flaws(self) -> int:
        """2 for a surface that is not sound, 1 for one that is pleated, else 0."""
        return int(self.pleated) if self.sound else 2

    @property
    def strains(self) -> dict[str, float]:
        """Largest, 99th percentile and mean strain of the pattern."""
        found = metrics.strains(self.pattern.surface(self.mesh), self.pattern.flat)
        return found if self.strain is None else dict.fromkeys(found, self.strain)

    @cached_property
    def sound(self) -> bool:
        """Whether neither surface nor pattern is folded or meets itself, and no rulings cross."""
        return not self.overlaps and self.untangled

    @cached_property
    def overlaps(self) -> bool:
        """Whether the pattern overlaps itself."""
        sheet = self.pattern.surface(self.mesh)
        return faults.overlaps(sheet, self.pattern.flat).size > 0

    @cached_property
    def untangled(self) -> bool:
        """Whether it is :attr:`sound`, or would be if its pattern did not overlap itself."""
        sheet = self.pattern.surface(self.mesh)
        return not (
            self.crossed
            or faults.folded(self.mesh).size
            or metrics.flipped_faces(sheet, self.pattern.flat).size
            or faults.crossings(self.mesh).size
        )

    @cached_property
    def folded(self) -> Folded:
        """The rulings in the pattern."""
        if not len(self.rulings.edges):
            return Folded()
        pattern = self.pattern
        inner = pattern.mesh.half_edges
        k = np.flatnonzero((inner.twin >= 0) & (inner.origin < inner.dest))
        ends = np.stack([inner.origin[k], inner.dest[k]], axis=1)
        count = len(self.mesh.vertices)
        key, rulings = (pair_keys(e, count) for e in (pattern.vertex[ends], self.rulings.edges))
        order = np.argsort(rulings)
        at = order[np.minimum(np.searchsorted(rulings[order], key), len(order) - 1)]
        found = np.isin(key, rulings)
        at = at[found]
        return Folded(ends[found], self.rulings.angles[at], self.rulings.radii[at])

    def on(self, design: Mesh, *, parts: bool = False) -> RuledSurface:
        """Return the surface with a design's vertices moved to it, measured against it.

        See :meth:`distances` for `parts`.
        """
        moved = Nearest(self.mesh).locate(design.vertices)[2]
        return replace(self, moved=moved).measured(design, parts=parts)

    def measured(self, design: Mesh, *, parts: bool = False, sampled: bool = False) -> RuledSurface:
        """Return the surface with its distances from a design, and its pleats.

        See :meth:`distances` for `parts` and `sampled`.
        """
        far = self.distances(design, parts=parts, sampled=sampled)
        return replace(self, deviation=far).measured_pleats(design)

    def measured_pleats(self, design: Mesh) -> RuledSurface:
        """Return the surface with its pleats, near a design."""
        return replace(
            self, pleats=pleats(self.mesh, self.strip, self.rulings, self.creases, design)
        )

    @property
    def bends(self) -> list[Bend]:
        """The rulings in the pattern, as lines."""
        return self.folded.lines(self.pattern.flat)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the surface as arrays by name, except `moved`; see :meth:`from_arrays`."""
        out: dict[str, np.ndarray] = {
            "ruled_vertices": self.mesh.vertices,
            "ruled_faces": self.mesh.faces,
            "ruled_strip": self.strip,
            "ruled_flat": self.flat.astype(np.uint8),
            "ruled_crossed": np.array(self.crossed),
        }
        if self.strain is not None:
            out["ruled_strain"] = np.array(self.strain)
        for name in _FOLDS:
            folds: Folds = getattr(self, name)
            out |= {f"ruled_{name}_{part}": getattr(folds, part) for part in _PARTS}
        if self.untrimmed is not None:
            out |= {f"ruled_strips_{k}": x for k, x in self.untrimmed.arrays().items()}
        return out | self.pattern.arrays("ruled_pattern_")

    @classmethod
    def from_arrays(cls, data: Mapping[str, np.ndarray], moved: Array) -> RuledSurface:
        """Return the surface that :meth:`arrays` describes.

        Raises
        ------
        KeyError, ValueError
            Arrays are missing or do not fit each other.
        """
        mesh = Mesh(data["ruled_vertices"], data["ruled_faces"])
        pattern = Pattern.from_arrays(data, mesh, "ruled_pattern_")
        folds = [Folds(*(data[f"ruled_{name}_{part}"] for part in _PARTS)) for name in _FOLDS]
        for ids in (fold.edges for fold in folds):
            if ids.dtype.kind not in "iu" or (
                ids.size and not 0 <= ids.min() <= ids.max() < len(mesh.vertices)
            ):
                raise ValueError("the edges of the ruled surface point outside")
        if any(len(data[f"ruled_{name}"]) != len(mesh.faces) for name in ("strip", "flat")):
            raise ValueError("the arrays of the ruled surface do not fit each other")
        crossed = int(data["ruled_crossed"])
        flat = np.asarray(data["ruled_flat"], bool)
        rulings, creases = folds
        strips, source = data["ruled_strip"], None
        named = {k[13:]: x for k, x in data.items() if k.startswith("ruled_strips_")}
        if named:
            source = Untrimmed.from_arrays(named)
            if source.owner.shape != (len(mesh.faces),):
                raise ValueError("the arrays of the ruled surface do not fit each other")
        strain = float(data["ruled_strain"]) if "ruled_strain" in data else None
        return cls(
            mesh, strips, flat, rulings, creases, pattern, moved, crossed, source, strain=strain
        )

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

    def distances(
        self, design: Mesh, *, parts: bool = False, sampled: bool = False
    ) -> metrics.Distances:
        """Measure the distances from a design, in its unit, all over both surfaces.

        "There" is from the surface to the design, "back" from the design to it, the mean of which
        is that of the vertices. The largest distances, of all points, include those between the
        boundary curves, so that a slit counts with its depth; with `parts`, for surfaces that meet
        inside the design, only those from the design's boundary. If `sampled`, the largest ones
        are those of samples, which takes a tenth of the time.
        """
        points, weight = self.samples()
        there = metrics.point_to_surface(points, design)
        back = metrics.point_to_surface(design.vertices[design.used], self.mesh)
        most, far = float(there.max()), float(back.max())
        if not parts or design.boundary_loops:
            rim_there, rim_back = metrics.boundary_distance(design, self.mesh)
            most, far = most if parts else max(most, rim_there), max(far, rim_back)
        if not sampled:
            # What is known already spares most of the search.
            most = metrics.farthest(self.mesh, design, most)
            far = metrics.farthest(design, self.mesh, far)
        return metrics.Distances(float(weight @ there), most, float(back.mean()), far)

    def on_ruling(self, line: Array, points: Array) -> Array:
        """Move points (k, 3) to the ruling, or piece of outline, nearest to a line (2, 3)."""
        a, b = self.mesh.vertices[self.mesh.edges].transpose(1, 0, 2)
        way, size = unit(b - a), lengths(b - a)
        off = [lengths(cross(x - a, way)) for x in line]
        inside = np.einsum("kd,kd->k", line.mean(axis=0) - a, way)
        beyond = np.maximum(np.maximum(-inside, inside - size), 0.0)
        k = int((off[0] + off[1] + beyond).argmin())
        along = np.clip((points - a[k]) @ way[k], 0.0, size[k])
        return np.asarray(a[k] + along[:, None] * way[k])

    def transformed(self, move: _Map, scale: float, back: _Map) -> RuledSurface:
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
            deviation=None
            if self.deviation is None
            else metrics.Distances(*(scale * x for x in self.deviation)),
            untrimmed=None if self.untrimmed is None else self.untrimmed.transformed(move),
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
    # Strips that are wholly outside the outline have no part.
    _, part = np.unique(unrolled.part[cut.face], return_inverse=True)
    place = Nearest.of(vertices, strips.divided(vertices)[0])
    _, _, moved = place.locate(job.target.domain.mesh.vertices)
    rulings, creases = folds(strips, vertices, unrolled, mesh, cut.face)
    return RuledSurface(
        mesh=mesh,
        strip=part,
        flat=cut.face >= len(strips.corners) - len(strips.flats),
        rulings=rulings,
        creases=creases,
        pattern=unrolled_pattern(mesh, cut.face, part, unrolled),
        moved=moved,
        crossed=int(((measured.gap <= 0).any(axis=1) | strips.tangled(vertices)).sum()),
        untrimmed=Untrimmed(strips, vertices, cut.face),
    )

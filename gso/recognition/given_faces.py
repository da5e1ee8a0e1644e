"""Faces whose surface a CAD file gives: nothing is fitted to their triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.mesh import GivenSurfaces
from gso.recognition.bend_lines import BendLine, Step
from gso.recognition.facet_graph import FacetGraph
from gso.recognition.flat_images import Part
from gso.recognition.region_growing import Region, round_region
from gso.recognition.round_surface import RoundSurface
from gso.recognition.shape_face import ShapeFace
from gso.typing import Array, Flags, Ints

#: Distance of vertices from a surface, relative to the size, up to which they are on it, and of
#: corners in the plane up to which triangles are joined; parameters of equal surfaces.
_ON, _JOINED, _EQUAL = 1e-5, 1e-6, 1e-7
#: Angle in radians below which a surface is flat.
_FLAT = 1e-6


@dataclass(frozen=True, eq=False)
class GivenFaces:
    """The faces of a mesh whose surfaces are known.

    Attributes
    ----------
    given : GivenSurfaces or None
    triangles : ndarray of int, (t, 3)
        Of the mesh.
    regions : tuple of Region
        Cylinders and cones.
    torsal : tuple of ndarray of bool, (t,)
        Triangles of each torsal face.
    unknown : ndarray of bool, (t,)
        Triangles among which cylinders and cones are to be looked for.
    """

    given: GivenSurfaces | None
    triangles: Ints
    regions: tuple[Region, ...]
    torsal: tuple[Flags, ...]
    unknown: Flags

    @classmethod
    def of(cls, graph: FacetGraph, given: GivenSurfaces | None) -> GivenFaces:
        """Find the faces whose vertices still lie on the surfaces that the file gave."""
        unknown = np.ones(len(graph.triangles), bool)
        if given is None or len(given.of_face) != len(graph.triangles):
            return cls(None, graph.triangles, (), (), unknown)
        size = float(np.linalg.norm(np.ptp(graph.points, axis=0)))
        regions, torsal = _round_regions(graph, given, _ON * size), []
        for number in np.unique(given.of_face).tolist():
            surface, member = given.surfaces[number], given.of_face == number
            if surface.rulings is not None and _is_image(graph, given, member):
                # A spline may be a cylinder or a cone.
                region = round_region(graph, member)
                if region is None:
                    torsal.append(member)
                else:
                    regions.append(region)
            elif surface.kind in ("sphere", "torus"):
                # Planes may be the facets of something round.
                unknown &= ~member
        for member in (*(region.member for region in regions), *torsal):
            unknown &= ~member
        return cls(given, graph.triangles, tuple(regions), tuple(torsal), unknown)

    def torsal_faces(self, graph: FacetGraph, source: Ints, step: Step) -> list[ShapeFace]:
        """Return the torsal faces of the graph, whose triangles are parts of the mesh's."""
        return [
            self._torsal_face(graph, np.flatnonzero(member[source]), source, step)
            for member in self.torsal
        ]

    def _torsal_face(self, graph: FacetGraph, ids: Ints, source: Ints, step: Step) -> ShapeFace:
        if self.given is None:
            raise AssertionError("there are no torsal faces without surfaces")
        old = source[ids]
        rulings = self.given.surfaces[self.given.of_face[old[0]]].rulings
        if rulings is None:
            raise AssertionError("a torsal face has rulings")
        now, before = graph.triangles[ids], self.triangles[old]
        flat = self.given.unrolled[old]
        new = (now != before).any(axis=1)
        if new.any():
            share = _barycentric(graph.points[now[new]], graph.points[before[new]])
            flat[new] = share @ flat[new]
        a, b = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
        if float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()) < 0:
            flat, rulings = flat * [1, -1], rulings * [1, -1, 1, -1, 1, -1, 1, 1]
        part = Part.of(graph.points, now)
        normals = self.given.normals[old][~new].reshape(-1, 3)
        vertices, first = np.unique(now[~new], return_index=True)
        return ShapeFace(
            "torsal",
            ids,
            flat,
            seam=part.ends[_apart(part, flat)],
            bend_lines=_bend_lines(rulings, step),
            bend_angle=float(rulings[-1, 4]),
            normals=(vertices, normals[first]),
        )


def _round_regions(graph: FacetGraph, given: GivenSurfaces, near: float) -> list[Region]:
    """Return cylinders and cones; neighbours with the same equation are one."""
    found: list[Region] = []
    numbers = [k for k, surface in enumerate(given.surfaces) if surface.round is not None]
    left = np.isin(given.of_face, numbers)
    for number in numbers:
        mine = left & (given.of_face == number)
        equation = given.surfaces[number].round
        if equation is None or not mine.any():
            continue
        alike = [k for k in numbers if _are_equal(equation, given.surfaces[k].round, near)]
        label = graph.connected(left & np.isin(given.of_face, alike))
        member = np.isin(label, np.unique(label[mine]))
        left &= ~member
        surface = _centred(equation, graph.points[np.unique(graph.triangles[member])])
        if (
            np.abs(surface.distances(graph.points[graph.triangles[member]].reshape(-1, 3))).max()
            <= near
        ):
            found += [Region(surface, label == k) for k in np.unique(label[mine])]
    return found


def _are_equal(one: Array, other: Array | None, near: float) -> bool:
    if other is None or abs(one[7] - other[7]) > _EQUAL:
        return False
    axis, apart = one[3:6], other[:3] - one[:3]
    if abs(abs(float(axis @ other[3:6])) - 1) > _EQUAL**2 + 1e-15:
        return False
    height = float(apart @ axis)
    off = float(np.linalg.norm(apart - height * axis))
    same_way = float(axis @ other[3:6]) > 0 or one[7] == 0
    wider = abs(float(one[6] + one[7] * height - other[6]))
    return same_way and max(off, wider) <= _EQUAL * near / _ON


def _centred(equation: Array, points: Array) -> RoundSurface:
    """Return a round surface with its centre beside the middle of some points on it."""
    axis, slope = equation[3:6], float(equation[7])
    height = float(((points - equation[:3]) @ axis).mean())
    return RoundSurface(
        equation[:3] + height * axis, axis, float(equation[6]) + slope * height, slope
    )


def _is_image(graph: FacetGraph, given: GivenSurfaces, member: Flags) -> bool:
    """Whether edges are about as long as in the plane: vertices have not been moved."""
    corners, flat = graph.points[graph.triangles[member]], given.unrolled[member]
    if np.isnan(flat).any():
        return False
    length, plane = (
        np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2).ravel() for x in (corners, flat)
    )
    # An arc is longer than its chord.
    return bool((plane >= length - _ON * length.max()).all() and (plane <= 1.1 * length).all())


def _barycentric(points: Array, corners: Array) -> Array:
    """Return weights (k, 3, 3) of the corners of triangles for points (k, 3, 3) in them."""
    edges = corners[:, 1:] - corners[:, :1]
    inner = (points - corners[:, :1]) @ np.linalg.pinv(edges)
    return np.concatenate([1 - inner.sum(axis=2, keepdims=True), inner], axis=2)


def _apart(part: Part, flat: Array) -> Flags:
    """Which pairs of neighbours are not joined in the plane."""
    gap = np.zeros(len(part.pairs))
    for end in (0, 1):
        one, other = (flat[part.pairs[:, side], part.corner(side, end)] for side in (0, 1))
        gap = np.maximum(gap, np.abs(one - other).max(axis=1, initial=0.0))
    return np.asarray(gap > _JOINED * float(np.ptp(flat.reshape(-1, 2), axis=0).max()))


def _bend_lines(rulings: Array, step: Step) -> tuple[BendLine, ...]:
    """Choose rulings between which the surface turns by about the step for its radius there."""
    turned = rulings[:, 4]
    if turned[-1] < _FLAT:
        return ()
    radius = rulings[:, 6:8].min(axis=1)
    steps = np.array([step(r) for r in np.minimum(radius[1:], radius[:-1]).tolist()])
    count = np.append(0.0, np.cumsum(np.diff(turned) / steps))
    wanted = np.linspace(0.0, count[-1], int(np.ceil(count[-1] - 1e-9)) + 1)
    rows = np.unique([int(np.abs(count - x).argmin()) for x in wanted])
    chosen = turned[rows]
    edges = np.concatenate([chosen[:1], (chosen[1:] + chosen[:-1]) / 2, chosen[-1:]])
    return tuple(
        BendLine(
            row[:2], row[2:4], float(row[6]), float(row[7]), float(angle), bool(row[5] < 0),
            limit=k in (0, len(rows) - 1),
        )
        for k, (row, angle) in enumerate(zip(rulings[rows], np.diff(edges), strict=True))
    )  # fmt: skip

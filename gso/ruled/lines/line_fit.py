"""The solve for strips along lines: planar polygons near a design, by the package's solver."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from gso.energy import Term, Weighted, mean_weights
from gso.energy.barycentric import build as barycentric
from gso.energy.coplanarity import build as coplanarity
from gso.energy.curve import build as curve
from gso.energy.facing import build as facing
from gso.energy.fairness import residual as fairness_residual
from gso.energy.multipliers import Shifts
from gso.energy.position import build as position
from gso.energy.proximity import residual as proximity_residual
from gso.geometry.ears import divided
from gso.geometry.vectors import cross, lengths, unit
from gso.mesh import Mesh, Nearest, Polylines, vertex_normals
from gso.mesh.polyline import turns
from gso.ruled.lines.polygons import Polygons
from gso.solver import Problem, minimise
from gso.typing import Array, Ints
from gso.unknowns import Layout, free

#: Weights of the distance from the strips to the design, and of the outline.
_BACK, _OUTLINE = 0.5, 0.3
#: Factor on tangential displacements.
_TANGENTIAL = 0.02
#: Weights of coplanarity and of second differences of the displacement, by round.
_PHASES = tuple((float(1.6**k), float(0.6**k)) for k in range(0, 21, 2))
#: Least weight of these second differences: how fair creases are.
FAIR = 0.4
#: Weight of the places of the outline's corners, and the turning of the outline there, in degrees.
_CORNERS, _SHARP = 3.0, 30.0
#: Weight of coplanarity when it becomes exact, rounds of that, updates of multipliers in each, and
#: the distance at which these end.
_STIFF, _ROUNDS, _SHIFTED, _EXACT = 1e6, 3, 4, 1e-13
#: Share of second differences across creases.
_ACROSS = 0.01
#: Weight of the barrier against folds, and the least area of triangles relative to the design's.
_FACING, _LEAST = 1e-2, 0.2
#: Double area of triangles, relative to the square of the longest side, up to which their corners
#: count as points on a line. The sign of such an area is noise, and the barrier would hold it.
_THIN = 1e-3
#: Weight of the places of vertices.
_PLACES = 0.3
#: Iterations of each round.
_ITERATIONS = 3


class LineFitter:
    """Fits strips along lines to a design whose diagonal is one."""

    def __init__(self, mesh: Mesh):
        self.mesh = mesh
        self.normals = vertex_normals(mesh)
        self.near = Nearest(mesh, self.normals)
        self._loops = mesh.boundary_loops
        sharp = [
            loop[turns(unit(np.roll(way, -1, axis=0) - way)) > _SHARP]
            for loop in self._loops
            for way in [mesh.vertices[loop]]
        ]
        self._corners = np.unique(np.concatenate([np.empty(0, np.int64), *sharp]))
        corner = mesh.vertices[mesh.triangles]
        area = 0.5 * lengths(cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
        share = np.zeros(len(mesh.vertices))
        np.add.at(share, mesh.triangles.ravel(), np.repeat(area, 3) / (3.0 * area.sum()))
        self.share = share

    @cached_property
    def _lines(self) -> Polylines:
        """The design's outline, if it has one."""
        v = self.mesh.vertices
        return Polylines.join([Polylines.of(v[loop], closed=True) for loop in self._loops])

    def fit(
        self,
        polygons: Polygons,
        start: Array,
        *,
        fairness: float = FAIR,
        tangential: float = _TANGENTIAL,
    ) -> Array:
        """Fit strips, from positions (n, 3) of the mesh's vertices; return their positions.

        Vertices that are no corners stay. With more fairness, the least weight of second
        differences, folds are rarer and distances larger; with a larger factor on tangential
        displacements corners stay nearer to where they were.
        """
        used = np.unique(np.concatenate(polygons.rings))
        number = np.full(len(self.mesh.vertices), -1)
        number[used] = np.arange(len(used))
        variables = free(Layout.of(len(used), "surface"))
        triangles = number[divided(polygons.rings, start)[0]]
        planes = number[polygons.planes(start)]
        fixed = self._fixed(polygons, used, number, start, tangential)
        smooth = self._smooth(polygons, number, start)
        x = start[used].ravel()

        def solved(x: Array, planar: Term, stiff: float, fair: float) -> Array:
            items = [
                *self._distances(x.reshape(-1, 3), triangles, tangential),
                *fixed,
                Weighted(planar, stiff),
                *(Weighted(term, fair * share) for term, share in smooth),
            ]
            return minimise(
                Problem(items, variables),
                x,
                iterations=_ITERATIONS,
                tolerance=1e-6,
                method="levenberg-marquardt",
            ).x

        count = max(len(planes), 1)
        soft = coplanarity(planes, weight=1.0 / count)
        for stiff, fair in _PHASES:
            x = solved(x, soft, stiff, max(fair, fairness))
        out: Array = start.copy()
        out[used] = x.reshape(-1, 3)
        return planarised(polygons, out)

    def _distances(self, points: Array, triangles: Ints, tangential: float) -> list[Weighted]:
        """Return the distances from the design to the strips, and back."""
        mesh = self.mesh
        which, shares, _ = Nearest.of(points, triangles).locate(mesh.vertices)
        there = barycentric(
            triangles[which],
            shares,
            mesh.vertices,
            self.normals,
            self.share,
            tangential=tangential,
        )
        corner = points[triangles]
        feet = self.near.feet(corner.mean(axis=1))
        area = lengths(cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
        third = np.full((len(triangles), 3), 1.0 / 3.0)
        back = barycentric(triangles, third, feet.points, feet.normals, area / area.sum())
        return [Weighted(there, 1.0), Weighted(back, _BACK)]

    def _fixed(
        self, polygons: Polygons, used: Ints, number: Ints, start: Array, tangential: float
    ) -> list[Weighted]:
        """Return the terms of the outline, and of the places of vertices."""
        own = start[used]
        ways = unit(self.normals[used])
        factor = np.full((1, len(used)), tangential)
        places = Term(
            "proximity",
            proximity_residual,
            (("surface", np.arange(len(used))[:, None]),),
            weights=mean_weights(len(used)),
            constants=np.concatenate([own.T, ways.T, factor]),
            linear=True,
        )
        return [
            *self._outline(number),
            Weighted(places, _PLACES),
            Weighted(self._facing(polygons, number, start), _FACING),
        ]

    def _outline(self, number: Ints) -> list[Weighted]:
        """Return the terms of the corners that are on the outline, if there is one."""
        if not self._loops:
            return []
        v = self.mesh.vertices
        rim = number[np.concatenate(self._loops)]
        rim = rim[rim >= 0]
        share = 1.0 / len(rim)
        kept = self._corners[number[self._corners] >= 0]
        corners = position(number[kept], v[kept], np.full(len(kept), share))
        return [
            Weighted(corners, _CORNERS),
            Weighted(curve(rim, self._lines, weight=share), _OUTLINE),
        ]

    def _facing(self, polygons: Polygons, number: Ints, v: Array) -> Term:
        """Return the barrier against polygons that fold over."""
        corners = [ring for ring in polygons.rings if len(ring) == 4]
        quads = np.array(corners, np.int64).reshape(-1, 4)
        ids = np.concatenate(
            [
                divided(polygons.rings, v)[0],
                quads[:, [0, 1, 3]],
                quads[:, [1, 2, 3]],
                quads[:, :3],
                quads[:, [0, 2, 3]],
            ]
        )
        ids = np.unique(ids, axis=0)
        a, b, c = v[ids].transpose(1, 0, 2)
        normal, ways = cross(b - a, c - a), unit(self.normals[ids].mean(axis=1))
        area = np.einsum("kd,kd->k", normal, ways)
        longest = np.maximum.reduce([lengths(b - a), lengths(c - b), lengths(a - c)])
        kept = area > np.maximum(0.1 * lengths(normal), _THIN * longest**2)
        ids, ways = ids[kept], ways[kept] / area[kept, None]
        return facing(number[ids], ways, mean_weights(len(ids)), least=_LEAST)

    def _smooth(self, polygons: Polygons, number: Ints, start: Array) -> list[tuple[Term, float]]:
        """Return second differences of the displacement, along creases and across them."""
        out = []
        for triples, share in ((polygons.lines, 1.0), (polygons.across, _ACROSS)):
            if not len(triples):
                continue
            a, b, c = start[triples].transpose(1, 0, 2)
            before, after = lengths(b - a), lengths(c - b)
            ahead = before / np.maximum(before + after, 1e-300)
            factors = np.stack([ahead - 1.0, np.ones(len(ahead)), -ahead])
            target = sum(f[:, None] * v for f, v in zip(factors, (a, b, c), strict=True))
            term = Term(
                "fairness",
                fairness_residual,
                (("surface", number[triples]),),
                weights=mean_weights(len(triples)),
                constants=np.concatenate([factors, target.T]),
                linear=True,
            )
            out.append((term, share))
        return out


def planarised(polygons: Polygons, points: Array) -> Array:
    """Make polygons planar with the smallest displacement of their corners.

    Parameters
    ----------
    polygons : Polygons
    points : ndarray, (n, 3)
        Positions of the mesh's vertices; those that are no corners stay.
    """
    used = np.unique(np.concatenate(polygons.rings))
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    layout = Layout.of(len(used), "surface")
    out: Array = points.copy()
    for _ in range(_ROUNDS):
        hard = coplanarity(number[polygons.planes(out)])
        if _largest(hard, out[used]) <= _EXACT:
            break
        shifts = Shifts(hard)
        hard = replace(hard, refresh=shifts.constants)
        hold = position(np.arange(len(used)), out[used], np.ones(len(used)))
        items = [Weighted(hold, 1.0), Weighted(hard, _STIFF)]
        x = out[used].ravel()
        for _ in range(_SHIFTED):
            x = minimise(Problem(items, free(layout)), x, iterations=4, tolerance=1e-12).x
            if shifts.update(layout.split(x)) <= _EXACT:
                break
        out[used] = x.reshape(-1, 3)
    return out


def _largest(term: Term, points: Array) -> float:
    """Return the largest residual."""
    return Shifts(term).update({"surface": points})

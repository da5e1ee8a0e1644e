"""The solve for strips along lines: planar polygons near a design, by the package's solver."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.energy import Term, Weighted, hardened, mean_weights
from gso.energy.barycentric import build as barycentric
from gso.energy.coplanarity import build as coplanarity
from gso.energy.curve import build as curve
from gso.energy.fairness import residual as fairness_residual
from gso.energy.proximity import residual as proximity_residual
from gso.energy.spacing import build as spacing
from gso.mesh import Mesh, Nearest, Polylines, vertex_normals
from gso.ruled.lines.ears import ears
from gso.ruled.lines.strip_cells import Cells
from gso.ruled.vectors import cross, lengths, unit
from gso.solver import Problem, minimise
from gso.typing import Array, Ints
from gso.unknowns import Layout, free

#: Weights of the distance from the strips to the design, and of the outline.
_BACK, _OUTLINE = 0.5, 0.3
#: Factor on tangential displacements.
_TANGENTIAL = 0.02
#: Weights of coplanarity and of second differences of the displacement, by round.
_PHASES = tuple((float(1.6**k), max(float(0.6**k), 1e-3)) for k in range(0, 21, 2))
#: Weight of coplanarity when it becomes exact, rounds of multipliers, and the distance at which
#: these end.
_STIFF, _ROUNDS, _EXACT = 1e5, 12, 1e-14
#: Share of second differences across creases.
_ACROSS = 0.01
#: Weight of the spacing of rulings along creases, and the least one relative to the design's.
_SPACING, _LEAST = 1e-4, 0.3
#: Weight of the places of vertices.
_PLACES = 0.1
#: Iterations of each round.
_ITERATIONS = 3


@dataclass(frozen=True)
class LineFit:
    """Strips along lines, as positions of the design's vertices of which only some are used.

    Attributes
    ----------
    cells : Cells
    points : ndarray, (n, 3)
        For vertices that are left out, the points of their rulings.
    """

    cells: Cells
    points: Array


class LineFitter:
    """Fits strips along lines to a design whose diagonal is one."""

    def __init__(self, mesh: Mesh):
        self.mesh = mesh
        self.normals = vertex_normals(mesh)
        self.near = Nearest(mesh, self.normals)
        self.outline = Polylines.join(
            [Polylines.of(mesh.vertices[loop], closed=True) for loop in mesh.boundary_loops]
        )
        corner = mesh.vertices[mesh.triangles]
        area = 0.5 * lengths(cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
        share = np.zeros(len(mesh.vertices))
        np.add.at(share, mesh.triangles.ravel(), np.repeat(area, 3) / (3.0 * area.sum()))
        self.share = share

    def fit(self, cells: Cells, start: Array) -> LineFit:
        """Fit strips, from positions (n, 3) of the mesh's vertices."""
        used = np.unique(np.concatenate(cells.rings))
        number = np.full(len(self.mesh.vertices), -1)
        number[used] = np.arange(len(used))
        layout = Layout.of(len(used), "surface")
        variables = free(layout)
        triangles = number[ears(cells.rings, start)]
        planes = number[cells.planes(start)]
        fixed = self._fixed(cells, used, number)
        smooth = self._smooth(cells, number)
        x = start[used].ravel()

        def solved(x: Array, planar: Term, stiff: float, fair: float, iterations: int) -> Array:
            items = [
                *self._distances(x.reshape(-1, 3), triangles),
                *fixed,
                Weighted(planar, stiff),
                *(Weighted(term, fair * share) for term, share in smooth),
            ]
            return minimise(
                Problem(items, variables),
                x,
                iterations=iterations,
                tolerance=1e-6,
                method="levenberg-marquardt",
            ).x

        count = max(len(planes), 1)
        soft = coplanarity(planes, weight=1.0 / count)
        for stiff, fair in _PHASES:
            x = solved(x, soft, stiff, fair, _ITERATIONS)
        hard = hardened(soft)
        assert hard.multipliers is not None
        for _ in range(_ROUNDS):
            x = solved(x, hard, _STIFF, _PHASES[-1][1], 2)
            if hard.multipliers.update(layout.split(x)) <= _EXACT:
                break
        return LineFit(cells, self._filled(cells, used, x.reshape(-1, 3)))

    def _filled(self, cells: Cells, used: Ints, points: Array) -> Array:
        """Return positions of all vertices: those left out at their shares of the rulings."""
        out = self.mesh.vertices.copy()
        out[used] = points
        vertex, ruling = cells.inside
        a, b = self.mesh.vertices[cells.ends[ruling]].transpose(1, 0, 2)
        way = b - a
        share = np.einsum("kd,kd->k", self.mesh.vertices[vertex] - a, way)
        share = np.clip(share / np.einsum("kd,kd->k", way, way), 0.0, 1.0)[:, None]
        p, q = out[cells.ends[ruling]].transpose(1, 0, 2)
        out[vertex] = (1.0 - share) * p + share * q
        return out

    def _distances(self, points: Array, triangles: Ints) -> list[Weighted]:
        """Return the distances from the design to the strips, and back."""
        mesh = self.mesh
        which, shares, _ = Nearest.of(points, triangles).locate(mesh.vertices)
        there = barycentric(
            triangles[which],
            shares,
            mesh.vertices,
            self.normals,
            self.share,
            tangential=_TANGENTIAL,
        )
        corner = points[triangles]
        feet = self.near.feet(corner.mean(axis=1))
        area = lengths(cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
        third = np.full((len(triangles), 3), 1.0 / 3.0)
        back = barycentric(triangles, third, feet.points, feet.normals, area / area.sum())
        return [Weighted(there, 1.0), Weighted(back, _BACK)]

    def _fixed(self, cells: Cells, used: Ints, number: Ints) -> list[Weighted]:
        """Return the terms of the outline, and of the places of vertices."""
        mesh = self.mesh
        rim = number[np.concatenate(mesh.boundary_loops)]
        share = 1.0 / len(rim)
        own = mesh.vertices[used]
        ways = unit(self.normals[used])
        factor = np.full((1, len(used)), _TANGENTIAL)
        places = Term(
            "proximity",
            proximity_residual,
            (("surface", np.arange(len(used))[:, None]),),
            weights=mean_weights(len(used)),
            constants=np.concatenate([own.T, ways.T, factor]),
            linear=True,
        )
        return [
            Weighted(curve(rim, self.outline, weight=share), _OUTLINE),
            Weighted(places, _PLACES),
            Weighted(self._spacing(cells, number), _SPACING),
        ]

    def _spacing(self, cells: Cells, number: Ints) -> Term:
        """Return the least spacing of vertices that follow each other on creases and outlines."""
        mesh = self.mesh
        edges = mesh.edges[cells.is_crease | mesh.boundary_edges]
        way = mesh.vertices[edges[:, 1]] - mesh.vertices[edges[:, 0]]
        scaled = way / np.einsum("kd,kd->k", way, way)[:, None]
        return spacing(number[edges], scaled, mean_weights(len(edges)), least=_LEAST)

    def _smooth(self, cells: Cells, number: Ints) -> list[tuple[Term, float]]:
        """Return second differences of the displacement, along creases and across them."""
        out = []
        for triples, share in ((cells.creased, 1.0), (cells.bordered, 1.0), (cells.across, _ACROSS)):
            if not len(triples):
                continue
            a, b, c = self.mesh.vertices[triples].transpose(1, 0, 2)
            before, after = lengths(b - a), lengths(c - b)
            ahead = before / (before + after)
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

"""The energy of strips near a design: its value, gradient and second derivatives."""

from __future__ import annotations

import numpy as np

from gso.geometry.vectors import cross, lengths, unit
from gso.mesh import Nearest
from gso.ruled.conditions import Conditions, Radius, on_lines
from gso.ruled.diagonal_gap import planarity
from gso.ruled.extended import Extended
from gso.ruled.second_differences import Differences
from gso.ruled.strip_layout import Strips
from gso.ruled.strip_weights import Measured, Weights
from gso.ruled.system import System
from gso.typing import Array, Ints

#: Samples across a strip, and at least across each of several.
_SAMPLES, _LEAST = 8, 2
#: Ends of rulings count as outside the design if they are nearer to the continued outline than
#: this, relative to the margin.
_OUTSIDE = 0.8
#: Distance from the normal through the nearest point at which a point is beyond the face.
_APART = 1e-9
_NONE = Conditions()


class Energy:
    """The energy of strips of one layout near a design.

    Parameters
    ----------
    design : Extended
        The design, continued beyond its outline.
    strips : Strips
        The layout.
    start : ndarray, (n, 3)
        Positions that displacements refer to.
    points : ndarray, (p, 3)
        Points of the design whose distances are minimised.
    width : float, optional
        Mean width of the faces; that of the start when not given.
    conditions : Conditions, optional
        What the strips have to satisfy.
    """

    def __init__(
        self,
        design: Extended,
        strips: Strips,
        start: Array,
        points: Array,
        width: float | None = None,
        conditions: Conditions = _NONE,
    ):
        self.design, self.strips, self.start = design, strips, start
        #: Number of the design's points; those that are held follow them.
        self.count = len(points)
        held = conditions.points
        self.points = points if held is None else np.concatenate([points, held])
        self.system = System(strips)
        count = max(_LEAST, -(-_SAMPLES // strips.count))
        t = (np.arange(count) + 0.5) / count
        #: Shares (s, 4) of the corners in the samples half-way between two rulings.
        self._share = 0.5 * np.stack([1 - t, t, 1 - t, t], axis=1)
        self._along = np.stack([t - 1, -t, 1 - t, t], axis=1)
        if width is None:
            a, b = start[strips.sides].transpose(1, 0, 2)
            width = float(lengths(b - a).mean())
        self.width = width
        self._rulings = sum(len(i) for i in strips.index)
        c = strips.corners
        self._same = np.stack([c[:, 0] == c[:, 2], c[:, 1] == c[:, 3]], axis=1)
        self._face_places = self.system.blocks(c)
        self._triangle_places = self.system.blocks(strips.split[0])
        one, two, self._rulings_ends = strips.hinges
        self._hinge = np.stack([one, two], axis=1)
        self._hinge_places = self.system.blocks(c[self._hinge].reshape(-1, 8))
        self._outer_places = self.system.blocks(strips.outer[:, None])
        self._second = Differences(self.system, start, self.width, self._rulings)
        self._line, self._through, self._across = on_lines(conditions, strips, start)
        self._line_places = self.system.blocks(self._line[:, None])
        self._radius = None
        if conditions.radius is not None:
            self._radius = Radius(self._hinge, self._rulings_ends, design.margin, conditions.radius)
        self.mirror = conditions.mirror
        self.partners = None if self.mirror is None else self.mirror.partners(start)

    # -- measures -----------------------------------------------------------------------------

    def measure(self, vertices: Array) -> Measured:
        """Find the nearest points of the strips, and those of the design."""
        triangles, _ = self.strips.split
        which, shares, foot = Nearest.of(vertices, triangles).locate(self.points)
        corner = vertices[triangles]
        normal = unit(cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
        own = normal[which]
        away = foot - self.points
        height = np.einsum("kd,kd->k", away, own)
        beyond = np.flatnonzero(lengths(away - height[:, None] * own) > _APART)
        way = away[beyond]
        height[beyond] = lengths(way)

        corner = vertices[self.strips.corners]
        x = self._share @ corner
        vector = cross(
            self._along @ corner,
            0.5 * (corner[:, 1] - corner[:, 0] + corner[:, 3] - corner[:, 2])[:, None],
        )
        feet, up, share = self.design.feet(x.reshape(-1, 3))
        up = up.reshape(x.shape)
        back = np.einsum("fsd,fsd->fs", x - feet.reshape(x.shape), up)
        area = lengths(vector)
        weight = area * share.reshape(area.shape)
        weight /= max(float(weight.sum()), 1e-300)
        mean = unit(np.einsum("fsd,fs->fd", up, area))
        gap, side = self.gaps(vertices, mean)
        ends = vertices[self.strips.outer]
        near, tangent, out = self.design.rim_feet(ends)
        margin = lengths(out)
        depth = np.einsum("kd,kd->k", near - ends, out) / np.maximum(margin, 1e-300)
        deep = np.maximum(depth - _OUTSIDE * margin, 0.0)
        across = np.eye(3) - tangent[:, :, None] * tangent[:, None]
        off = np.einsum("kij,kj->ki", across, ends - near)
        one, two = self._face_normals(vertices)[0][self._hinge].transpose(1, 0, 2)
        ends = vertices[self._rulings_ends]
        stiff = lengths(ends[:, 1] - ends[:, 0]) / self.width
        return Measured(
            which,
            shares,
            height,
            normal,
            beyond,
            way,
            back,
            up,
            weight,
            mean,
            gap,
            side,
            off,
            across,
            deep,
            unit(out),
            one - two,
            stiff,
        )

    def _face_normals(self, vertices: Array) -> tuple[Array, Array, Array, Array]:
        """Return unit normals (f, 3), lengths of their cross products, and the diagonals."""
        p, q, p1, q1 = vertices[self.strips.corners].transpose(1, 0, 2)
        first, second = q1 - p, q - p1
        normal = cross(first, second)
        size = np.maximum(lengths(normal), 1e-300)
        return normal / size[:, None], size, first, second

    def gaps(self, vertices: Array, up: Array) -> tuple[Array, Array]:
        """Return the signed distances (f, 2) between both ends of a face's rulings.

        They are measured across the rulings, in directions (f, 3) that are also returned. A
        negative gap is a crossing. Ends that are one vertex count as far apart.

        Parameters
        ----------
        up : ndarray, (f, 3)
            Normals on the side from which gaps are positive.
        """
        p, q, p1, q1 = vertices[self.strips.corners].transpose(1, 0, 2)
        side = unit(cross(unit(q - p) + unit(q1 - p1), up))
        gap = np.stack(
            [np.einsum("fd,fd->f", p1 - p, side), np.einsum("fd,fd->f", q1 - q, side)], axis=1
        )
        return np.where(self._same, np.inf, gap), side

    # -- value and derivatives ----------------------------------------------------------------

    def value(self, vertices: Array, m: Measured, w: Weights, weight: Array, scale: float) -> float:
        """Return the energy, with the given weights of the faces' samples."""
        far, held = m.height[: self.count], m.height[self.count :]
        total = float(((np.abs(far) / scale) ** w.power).sum()) / self.count * scale**2
        total += w.hold * float(held @ held)
        total += w.back * float((weight * (np.abs(m.back) / scale) ** w.power).sum()) * scale**2
        off = np.einsum("kij,kj->ki", self._across, vertices[self._line] - self._through)
        total += w.hold * float((off**2).sum())
        if self._radius is not None:
            excess, _ = self._radius.excess(vertices, m.turn, m.gap)
            total += w.radius * float((excess**2).sum())
        total += 0.5 * self._second.energy(vertices, w)[0]
        total += w.ends / len(m.off) * float((m.off**2).sum())
        total += w.inside / len(m.off) * float(m.deep @ m.deep)
        total += w.fold * float(m.stiff @ (m.turn**2).sum(axis=1))
        short = np.minimum(m.gap - w.least * self.width, 0.0)
        total += w.gap / self._rulings * float((short**2).sum())
        if w.planar:
            value, _ = planarity(vertices[self.system.quads])
            total += w.planar / self._rulings * float((value**2).sum())
        return total

    def derivatives(
        self, vertices: Array, m: Measured, w: Weights, scale: float
    ) -> tuple[Array, Array]:
        """Return the gradient (n, 3) and the second derivatives in band storage.

        Second derivatives of the nearest points and of planarity are left out (Gauss-Newton).
        """
        gradient = np.zeros_like(vertices)
        parts = [
            self._there(gradient, m, w, scale),
            self._beyond(gradient, m, w, scale),
            self._faces(gradient, vertices, m, w, scale),
            self._folds(gradient, vertices, m, w),
        ]
        gradient += self._second.energy(vertices, w)[1]
        factor = 2.0 * w.ends / len(m.off)
        gradient[self.strips.outer] += factor * m.off
        block = factor * m.across
        factor = 2.0 * w.inside / len(m.off)
        gradient[self.strips.outer] -= factor * m.deep[:, None] * m.out
        block = block + factor * (m.deep > 0)[:, None, None] * m.out[:, :, None] * m.out[:, None]
        parts.append((self._outer_places, block))
        off = np.einsum("kij,kj->ki", self._across, vertices[self._line] - self._through)
        np.add.at(gradient, self._line, 2.0 * w.hold * off)
        parts.append((self._line_places, 2.0 * w.hold * self._across))
        return gradient, self.system.matrix(parts) + self._second.matrix(w)

    def even_step(self, step: Array) -> Array:
        """Return a symmetric step, where there is a plane of symmetry."""
        if self.mirror is None or self.partners is None:
            return step
        return self.mirror.even_step(step, self.partners)

    def even_pairs(self, pairs: Ints) -> Ints:
        """Add the mirror images of pairs (m, 2) of vertices."""
        return pairs if self.partners is None else np.concatenate([pairs, self.partners[pairs]])

    def _there(self, gradient: Array, m: Measured, w: Weights, scale: float) -> tuple[Ints, Array]:
        """Distances of the design's points from the triangles' planes."""
        triangles, _ = self.strips.split
        count = len(triangles)
        first, second = self._pulls(m, w, scale)
        at, n = m.triangle, m.normal
        first[m.beyond] = second[m.beyond] = 0.0
        share = np.ascontiguousarray(m.shares.T)
        local = np.stack([np.bincount(at, first * s, count) for s in share], axis=1)
        _add(gradient, triangles, local[:, :, None] * n[:, None])
        moments = np.empty((count, 3, 3))
        for i in range(3):
            weighted = second * share[i]
            for j in range(i, 3):
                moments[:, i, j] = np.bincount(at, weighted * share[j], count)
                moments[:, j, i] = moments[:, i, j]
        return self._triangle_places, np.einsum("tij,td,te->tidje", moments, n, n)

    def _pulls(self, m: Measured, w: Weights, scale: float) -> tuple[Array, Array]:
        """Return first and second derivatives by the distances of all points."""
        first, second = _power(m.height, w.power, scale, 1.0 / self.count)
        first[self.count :], second[self.count :] = (
            2.0 * w.hold * m.height[self.count :],
            2.0 * w.hold,
        )
        return first, second

    def _beyond(self, gradient: Array, m: Measured, w: Weights, scale: float) -> tuple[Ints, Array]:
        """Distances of points beyond the border or a ridge."""
        corners = self.strips.split[0][m.triangle[m.beyond]]
        first, second = (x[m.beyond] for x in self._pulls(m, w, scale))
        row = m.shares[m.beyond][:, :, None] * unit(m.way)[:, None]
        _add(gradient, corners, first[:, None, None] * row)
        row = row.reshape(len(corners), 9)
        return self.system.blocks(corners), second[:, None, None] * row[:, :, None] * row[:, None]

    def _faces(
        self, gradient: Array, vertices: Array, m: Measured, w: Weights, scale: float
    ) -> tuple[Ints, Array]:
        """Distances of the faces from the design, gaps and planarity."""
        corners = self.strips.corners
        first, second = _power(m.back, w.power, scale, w.back * m.back_weight)
        slope = self._share[None, :, :, None] * m.back_normal[:, :, None, :]
        slope = slope.reshape(len(corners), len(self._share), 12)
        local = np.matmul(first[:, None], slope)[:, 0]
        block = np.matmul((second[:, :, None] * slope).transpose(0, 2, 1), slope)
        short = np.minimum(m.gap - w.least * self.width, 0.0)
        factor = 2.0 * w.gap / self._rulings
        for end in (0, 1):
            k = np.flatnonzero(short[:, end] < 0.0)
            by = np.zeros((k.size, 4, 3))
            by[:, end], by[:, 2 + end] = -m.side[k], m.side[k]
            row = by.reshape(-1, 12)
            local[k] += factor * short[k, end, None] * row
            block[k] += factor * row[:, :, None] * row[:, None]
        if w.planar:
            quad = self.strips.quads
            value, by = planarity(vertices[self.system.quads])
            row = by.reshape(-1, 12)
            factor = 2.0 * w.planar / self._rulings
            local[quad] += factor * value[:, None] * row
            block[quad] += factor * row[:, :, None] * row[:, None]
        _add(gradient, corners, local.reshape(-1, 4, 3))
        return self._face_places, block

    def _folds(
        self, gradient: Array, vertices: Array, m: Measured, w: Weights
    ) -> tuple[Ints, Array]:
        """Changes of the normal at rulings; changes of the rulings' lengths are left out."""
        normal, size, first, second = self._face_normals(vertices)
        by = np.empty((len(normal), 4, 3, 3))
        by[:, 0], by[:, 1] = _skew(second), _skew(first)
        by[:, 3], by[:, 2] = -by[:, 0], -by[:, 1]
        across = (np.eye(3) - normal[:, :, None] * normal[:, None]) / size[:, None, None]
        by = np.einsum("fij,fcjk->fick", across, by).reshape(-1, 3, 12)
        one, two = self._hinge.T
        row = np.concatenate([by[one], -by[two]], axis=2)
        factor = 2.0 * w.fold * m.stiff
        local = factor[:, None] * np.einsum("hi,hik->hk", m.turn, row)
        block = np.matmul((factor[:, None, None] * row).transpose(0, 2, 1), row)
        if self._radius is not None:
            slope, second = self._radius.parts(
                *self._radius.excess(vertices, m.turn, m.gap), m.turn, m.side, row
            )
            local += w.radius * slope
            block += w.radius * second
        corners = self.strips.corners[self._hinge].reshape(-1, 8)
        _add(gradient, corners, local.reshape(-1, 8, 3))
        return self._hinge_places, block


def _skew(a: Array) -> Array:
    """Return matrices (k, 3, 3) of the cross products with vectors (k, 3) from the left."""
    zero = np.zeros(len(a))
    x, y, z = a.T
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)


def _power(height: Array, power: float, scale: float, weight: float | Array) -> tuple[Array, Array]:
    """Return first and second derivatives of weight * scale**2 * abs(height / scale)**power."""
    size = weight * (np.abs(height) / scale) ** (power - 2)
    return power * size * height, power * (power - 1) * size


def _add(gradient: Array, ids: Ints, values: Array) -> None:
    """Add values (k, c, 3) to the rows of vertices (k, c)."""
    flat = ids.ravel()
    for d in range(3):
        gradient[:, d] += np.bincount(flat, values[:, :, d].ravel(), len(gradient))

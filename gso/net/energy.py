"""The solver's energies of whole batches of grids: what the default nets are trained on.

Residuals, losses and weights are those of the tasks' terms; only the sums are made here. One
number per surface, (B,), of surfaces in the unit ball.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import torch
from torch import Tensor

from gso import geometry
from gso.net import grids
from gso.net.grids import Planes, planes
from gso.tasks import developable, flatten
from gso.terms import curvature, edges, elongation, fairness, proximity, stretch
from gso.terms.losses import Absolute, Distance, Squared

#: Designs that are flatter, by mean |K| in the unit ball, count as if they were not.
LEAST_CURVATURE = 1e-3
#: Corners of cells flatter than this carry no strain (doubled area over squared sides).
_FLAT_CORNER = 1e-5
#: Strain below which a flat image is good enough to be called exact.
_LEAST_STRAIN = 1e-3


@dataclass(eq=False)
class Developable:
    """The objective of :mod:`gso.tasks.developable`, formulation "curvature".

    What does not change while the results of one batch of designs are compared is computed
    once. The designs count as free of noise.

    Parameters
    ----------
    design : Tensor, (B, H, W, 3)
        Surfaces of the unit ball.
    options : gso.tasks.developable.Options
        Weights.
    """

    design: Tensor
    options: developable.Options

    def __post_init__(self) -> None:
        self.points = p = planes(self.design)
        self.normals = grids.normals(p)
        k = grids.to_border(grids.absolute_curvature(p))
        self.curved = k[:, 1:-1, 1:-1].mean(dim=(1, 2))
        self.spacing = fairness.spacing(*grids.side_lengths(p), p[0].shape[1:])
        self.lengths = [1.0 / geometry.norm(d).clamp_min(1e-9) for d in _edges(p)]
        self.bands = [_bands(d[0], axis) for d, axis in zip(_edges(p), (2, 1), strict=True)]
        own = [_second(p, axis, h) for axis, h in zip((1, 2), self.spacing, strict=True)]
        kept = developable.kept_bending(k)
        self.wanted = [
            tuple(c * _mean_of_three(kept, axis) for c in second)
            for axis, second in zip((1, 2), own, strict=True)
        ]
        count = sum(second[0][0].numel() for second in own)
        bending = sum(geometry.norm2(second).sum(dim=(1, 2)) for second in own) * 2.0 / count
        self.w_curvature, self.w_fairness = developable.adapted_weights(
            self.options, self.curved.clamp_min(LEAST_CURVATURE), bending
        )

    @cached_property
    def at_start(self) -> Tensor:
        """Energy (B,) of the designs themselves, at the options' eps."""
        with torch.no_grad():
            return self(self.design)

    def __call__(self, result: Tensor, eps: float | None = None) -> Tensor:
        """Energy (B,) of results (B, H, W, 3) with |K| smoothed by `eps`."""
        return sum(self.parts(result, eps).values())  # type: ignore[return-value]

    def parts(self, result: Tensor, eps: float | None = None) -> dict[str, Tensor]:
        """Energy (B,) by term."""
        o = self.options
        x = planes(result)
        absolute: Any = Absolute(o.eps if eps is None else eps)
        bent = 0.0
        for split in range(len(geometry.GRID_RINGS)):
            centre, ring = geometry.grid_star(x, split)
            (k,) = curvature.residual([centre, *ring], ())
            bent = bent + absolute.value(k).mean(dim=(1, 2)) / len(geometry.GRID_RINGS)
        fair = self._fairness(x)
        ones = torch.full_like(x[0], o.tangential)
        moved = proximity.residual([x], [*self.points, *self.normals, ones])
        distance: Any = Distance(o.near)
        near = distance.value(torch.stack(moved))[0].mean(dim=(1, 2))
        return {
            "curvature": self.w_curvature * bent,
            "fairness": self.w_fairness * fair,
            "proximity": o.w_proximity * near,
            "elongation": o.w_elongation * self._elongation(x),
        }

    def _elongation(self, x: Planes) -> Tensor:
        squared: Any = Squared()
        total, count = torch.zeros_like(self.curved), 0
        for d, inverse, band in zip(_edges(x), self.lengths, self.bands, strict=True):
            origin = tuple(torch.zeros_like(c) for c in d)
            (r,) = elongation.residual([origin, d], [inverse, *band])
            total = total + squared.value(r).sum(dim=(1, 2))
            count += r[0].numel()
        return total / count

    def _fairness(self, x: Planes) -> Tensor:
        total, count = torch.zeros_like(self.curved), 0
        for axis, h, wanted in zip((1, 2), self.spacing, self.wanted, strict=True):
            second = geometry.sub(_second(x, axis, h), wanted)
            total = total + 0.5 * geometry.norm2(second).sum(dim=(1, 2))
            count += second[0][0].numel()
        return total / (0.5 * count)


def _second(x: Planes, axis: int, spacing: Tensor) -> Planes:
    """Second derivatives along an axis, for samples (B,) that far apart."""
    n = x[0].shape[axis] - 2
    triple = [tuple(c.narrow(axis, k, n) for c in x) for k in range(3)]
    scale = (spacing**-2)[:, None, None].expand_as(triple[0][0])
    zeros = [scale.new_zeros(())] * len(x)
    return fairness.residual(triple, [scale, -2.0 * scale, scale, *zeros])


def _bands(like: Tensor, across: int) -> tuple[Tensor, Tensor]:
    """Ratios (1, ., .) between which edges (B, ., .) are free; the outer ones lie on the border."""
    bands = []
    for inside, boundary in zip(elongation.INSIDE, elongation.BOUNDARY, strict=True):
        band = torch.full_like(like[:1], inside)
        for outer in (0, like.shape[across] - 1):
            band.select(across, outer).fill_(boundary)
        bands.append(band)
    return bands[0], bands[1]


def _mean_of_three(x: Tensor, axis: int) -> Tensor:
    n = x.shape[axis] - 2
    return sum(x.narrow(axis, k, n) for k in range(3)) / 3.0  # type: ignore[return-value]


@dataclass(eq=False)
class Strain:
    """The objective of :mod:`gso.tasks.flatten`, formulation "strain", norm "mixed".

    The typical strain, by which that objective tells large strains from small ones, is the
    result's own: no optimum has to be known.

    Parameters
    ----------
    surface : Tensor, (B, H, W, 3)
        Surfaces in space, in the unit ball.
    options : gso.tasks.flatten.Options
        Weights.
    """

    surface: Tensor
    options: flatten.Options

    def __post_init__(self) -> None:
        p = planes(self.surface)
        cell = grids.corners(p)
        rest, self.sound = [], []
        for a, b, c in stretch.corners_of(4):
            frame = geometry.rest_frame(cell[a], cell[b], cell[c])
            e, f = geometry.sub(cell[b], cell[a]), geometry.sub(cell[c], cell[a])
            area = geometry.norm(geometry.cross(e, f))
            good = area > _FLAT_CORNER * (geometry.norm2(e) + geometry.norm2(f))
            rest += [torch.where(good, x, torch.zeros_like(x)) for x in frame]
            self.sound.append(good)
        self.rest = rest
        self.lengths = [1.0 / geometry.norm(d).clamp_min(1e-9) for d in _edges(p)]

    def residuals(self, flat: Tensor) -> Tensor:
        """Strain of the corners, (12, B, H-1, W-1); see :func:`gso.terms.stretch.residual`."""
        r = torch.stack(stretch.residual(grids.corners(planes(flat)), self.rest))
        good = torch.stack(self.sound)
        return torch.where(good.repeat(3, 1, 1, 1), r, torch.zeros_like(r))

    def level(self, r: Tensor) -> Tensor:
        """Root-mean-square strain (B,) from residuals."""
        squares = r.square().sum(dim=(0, 2, 3)) / torch.stack(self.sound).sum(dim=(0, 2, 3))
        return (0.5 * squares).sqrt()

    def __call__(self, flat: Tensor) -> Tensor:
        """Energy (B,) of flat images (B, H, W, 2), over their typical strain."""
        o = self.options
        r = self.residuals(flat)
        level = self.level(r.detach()).clamp_min(_LEAST_STRAIN)[:, None, None].expand_as(r[0])
        knee = o.knee * flatten.bent(level)
        # The terms' losses know elements by one axis.
        spread: Any = stretch.Spread(level.reshape(-1), knee=knee.reshape(-1))  # type: ignore[arg-type]
        cost = spread.value(r.reshape(12, -1)).reshape(4, *r.shape[1:]).mean(dim=(0, 2, 3))
        typical = level[:, 0, 0]
        absolute: Any = Absolute((0.1 * typical)[:, None, None])  # type: ignore[arg-type]
        total, count = torch.zeros_like(cost), 0
        for d, inverse in zip(_edges(planes(flat)), self.lengths, strict=True):
            origin = tuple(torch.zeros_like(c) for c in d)
            (change,) = edges.residual([origin, d], [inverse])
            total = total + absolute.value(change).sum(dim=(1, 2))
            count += change[0].numel()
        return cost / typical + o.w_edges * total / count


def _edges(p: Planes) -> list[Planes]:
    """Edges of grids in both directions."""
    return [tuple(torch.diff(c, dim=axis) for c in p) for axis in (1, 2)]

"""The solver's energies for batches of grids, on which the default nets are trained.

Residuals, losses and weights are those of the tasks' terms; only the sums are computed here.
Surfaces are in the unit ball, and energies are (B,), one number per surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from gso import geometry
from gso.energy import curvature, edges, elongation, fairness, proximity, stretch
from gso.energy.losses import Absolute, Distance, Squared
from gso.net.models import grid_geometry
from gso.net.models.grid_geometry import Planes, planes
from gso.tasks import developable, flatten
from gso.tasks.developable.analysis import kept_bending
from gso.tasks.developable.objective import adapted_weights

#: Lower bound on the mean |K| of a design in the unit ball, where weights depend on it.
LEAST_CURVATURE = 1e-3
#: Lower bound on the typical strain of a flat image, by which its energy is divided.
_LEAST_STRAIN = 1e-3
#: Shear of a corner without any: the root of its squares has no derivative at zero.
_LEAST_SHEAR = 1e-6


@dataclass(eq=False)
class Developable:
    """The objective of :mod:`gso.tasks.developable`, formulation "curvature".

    Quantities of the designs are computed once per batch. The designs are assumed to be free
    of noise.

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
        self.normals = grid_geometry.normals(p)
        k = grid_geometry.to_border(grid_geometry.absolute_curvature(p))
        self.curved = k[:, 1:-1, 1:-1].mean(dim=(1, 2))
        self.spacing = fairness.spacing(*geometry.side_lengths(p), p[0].shape[1:])
        self.lengths = [1.0 / geometry.norm(d).clamp_min(1e-9) for d in _edges(p)]
        self.bands = [_bands(d[0], axis) for d, axis in zip(_edges(p), (2, 1), strict=True)]
        own = [_second(p, axis, h) for axis, h in zip((1, 2), self.spacing, strict=True)]
        kept = kept_bending(k)
        self.wanted = [
            tuple(c * _mean_of_three(kept, axis) for c in second)
            for axis, second in zip((1, 2), own, strict=True)
        ]
        count = sum(second[0][0].numel() for second in own)
        bending = sum(geometry.norm2(second).sum(dim=(1, 2)) for second in own) * 2.0 / count
        self.w_curvature, self.w_fairness = adapted_weights(
            self.options, self.curved.clamp_min(LEAST_CURVATURE), bending
        )

    @cached_property
    def at_start(self) -> Tensor:
        """Energy (B,) of the designs themselves, at the options' eps."""
        with torch.no_grad():
            return self(self.design)

    def __call__(self, result: Tensor, eps: float | None = None) -> Tensor:
        """Compute the energy (B,) of results (B, H, W, 3), with |K| smoothed by `eps`."""
        return sum(self.parts(result, eps).values())  # type: ignore[return-value]

    def parts(self, result: Tensor, eps: float | None = None) -> dict[str, Tensor]:
        """Compute the weighted energy (B,) of each term."""
        o = self.options
        x = planes(result)
        absolute = Absolute(o.eps if eps is None else eps)
        bent = torch.zeros_like(self.curved)
        for split in range(len(geometry.GRID_RINGS)):
            centre, ring = geometry.grid_star(x, split)
            (k,) = curvature.residual([centre, *ring], ())
            bent = bent + absolute.value(k).mean(dim=(1, 2)) / len(geometry.GRID_RINGS)
        fair = self._fairness(x)
        ones = torch.full_like(x[0], o.tangential)
        moved = proximity.residual([x], [*self.points, *self.normals, ones])
        distance = Distance(o.quadratic_below)
        near = distance.value(torch.stack(moved))[0].mean(dim=(1, 2))
        return {
            "curvature": self.w_curvature * bent,
            "fairness": self.w_fairness * fair,
            "proximity": o.w_proximity * near,
            "elongation": o.w_elongation * self._elongation(x),
        }

    def _elongation(self, x: Planes) -> Tensor:
        squared = Squared()
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
    """Compute second derivatives along an axis; `spacing` (B,) is the sample distance."""
    n = x[0].shape[axis] - 2
    triple = [tuple(c.narrow(axis, k, n) for c in x) for k in range(3)]
    scale = (spacing**-2)[:, None, None].expand_as(triple[0][0])
    zeros = [scale.new_zeros(())] * len(x)
    return fairness.residual(triple, [scale, -2.0 * scale, scale, *zeros])


def _bands(like: Tensor, across: int) -> tuple[Tensor, Tensor]:
    """Return bounds (1, ., .) on length ratios within which edges have no elongation energy.

    `across` is the dimension of `like` across the edges; its first and last entries are
    boundary edges.
    """
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

    The typical strain, which scales the norm, is computed from the result itself, so that the
    optimum need not be known.

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
        cell = geometry.cell_corners(p)
        rest, sound = [], []
        for a, b, c in stretch.corners_of(4):
            frame = geometry.rest_frame(cell[a], cell[b], cell[c])
            e, f = geometry.sub(cell[b], cell[a]), geometry.sub(cell[c], cell[a])
            area = geometry.norm(geometry.cross(e, f))
            good = area > stretch.FLAT_CORNER * (geometry.norm2(e) + geometry.norm2(f))
            rest += [torch.where(good, x, torch.zeros_like(x)) for x in frame]
            sound.append(good)
        self.rest, self.sound = rest, torch.stack(sound)
        self.lengths = [1.0 / geometry.norm(d).clamp_min(1e-9) for d in _edges(p)]

    def residuals(self, flat: Tensor) -> Tensor:
        """Compute strain residuals (12, B, H-1, W-1); see :func:`gso.energy.stretch.residual`."""
        r = torch.stack(stretch.residual(geometry.cell_corners(planes(flat)), self.rest))
        return torch.where(self.sound.repeat(3, 1, 1, 1), r, torch.zeros_like(r))

    def mean(self, flat: Tensor) -> Tensor:
        """Compute the mean (B,) of the larger principal strain of the corners: ``strain_mean``."""
        scale, c, d = (r / 2.0**0.5 for r in self.residuals(flat).chunk(3))
        larger = scale.abs() + (c.square() + d.square() + _LEAST_SHEAR**2).sqrt()
        total = (larger * self.sound).sum(dim=(0, 2, 3))
        mean: Tensor = total / self.sound.sum(dim=(0, 2, 3))
        return mean

    def level(self, r: Tensor) -> Tensor:
        """Compute the root-mean-square strain (B,) from residuals."""
        squares = r.square().sum(dim=(0, 2, 3)) / self.sound.sum(dim=(0, 2, 3))
        return (0.5 * squares).sqrt()

    def __call__(self, flat: Tensor) -> Tensor:
        """Compute the energy (B,) of flat images (B, H, W, 2), divided by their typical strain."""
        return sum(self.parts(flat).values())  # type: ignore[return-value]

    def parts(self, flat: Tensor) -> dict[str, Tensor]:
        """Compute the weighted energy (B,) of each term, divided by the typical strain."""
        o = self.options
        r = self.residuals(flat)
        level = self.level(r.detach()).clamp_min(_LEAST_STRAIN)[:, None, None].expand_as(r[0])
        knee = stretch.lowered(o.knee, level)
        # The terms' losses take elements along a single axis.
        spread = stretch.TwoPowerLoss(level.reshape(-1), knee=knee.reshape(-1))  # type: ignore[arg-type]
        cost = spread.value(r.reshape(12, -1)).reshape(4, *r.shape[1:]).mean(dim=(0, 2, 3))
        typical = level[:, 0, 0]
        absolute = Absolute((0.1 * typical)[:, None, None])  # type: ignore[arg-type]
        total, count = torch.zeros_like(cost), 0
        for d, inverse in zip(_edges(planes(flat)), self.lengths, strict=True):
            origin = tuple(torch.zeros_like(c) for c in d)
            (change,) = edges.residual([origin, d], [inverse])
            total = total + absolute.value(change).sum(dim=(1, 2))
            count += change[0].numel()
        return {"strain": cost / typical, "edges": o.w_edges * total / count}


def _edges(p: Planes) -> list[Planes]:
    """Return the edge vectors of grids in both directions."""
    return [tuple(torch.diff(c, dim=axis) for c in p) for axis in (1, 2)]

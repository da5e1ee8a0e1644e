"""Input channels of :class:`gso.net.CoarseNet`, which do not depend on the surface's pose."""

from __future__ import annotations

import torch
from torch import Tensor

from gso import geometry
from gso.net.models.grid_geometry import (
    Frame,
    Planes,
    curvature,
    first_form,
    normal_curvatures,
    to_border,
)

#: Curvature above which the asinh channel is logarithmic, 1 / size^2.
_SMALL_CURVATURE = 0.03
#: Curvature at which the tanh channel saturates, 1 / size^2.
_LARGE_CURVATURE = 2.0
#: Numbers of channels of :func:`shape`, :func:`bending` and :func:`stretching`.
SHAPE, BENDING, STRETCHING = 8, 5, 4


def shape(p: Planes, frame: Frame) -> list[Tensor]:
    """Compute the first form, the position in the vertex's frame, and the place in the grid."""
    _, height, width = p[0].shape
    u, v = (
        torch.linspace(-1.0, 1.0, n, dtype=p[0].dtype, device=p[0].device).abs()
        for n in (height, width)
    )
    place = [geometry.dot(p, axis) for axis in (frame.normal, frame.along, frame.across)]
    sides = [u[:, None].expand_as(p[0]), v[None, :].expand_as(p[0])]
    return [*first_form(frame), *place, *sides]


def bending(p: Planes, frame: Frame) -> list[Tensor]:
    """Compute Gaussian curvature on two scales, and curvatures and twist of the grid lines."""
    k = to_border(curvature(p))
    gauss = [_asinh(k / _SMALL_CURVATURE) / 4.0, torch.tanh(k / _LARGE_CURVATURE)]
    return [*gauss, *(_asinh(normal_curvatures(p, frame)) / 2.0)]


def _asinh(x: Tensor) -> Tensor:
    """Compute the inverse hyperbolic sine; PyTorch's own is not vectorised on CPUs."""
    return (x.abs() + torch.hypot(x, torch.ones_like(x))).log() * torch.sign(x)


def stretching(frame: Frame, flat: Planes) -> list[Tensor]:
    """Compute how a flat image changes lengths, angle and area of the grid's parallelograms."""
    zero = torch.zeros_like(flat[0])
    x, y = flat
    image = Frame.of((x, y, zero))
    change = [b - a for a, b in zip(first_form(frame), first_form(image), strict=True)]
    area = geometry.norm(geometry.cross(frame.du, frame.dv)).clamp_min(1e-9)
    ratio = geometry.dot(geometry.cross(image.du, image.dv), (zero, zero, zero + 1.0)) / area
    return [3.0 * c.clamp(-2.0, 2.0) for c in change] + [ratio.clamp(-2.0, 4.0) - 1.0]

"""What a coarse-field net sees of a surface: channels that do not depend on its pose."""

from __future__ import annotations

import torch
from torch import Tensor

from gso import geometry
from gso.net.grids import (
    Frame,
    Planes,
    curvature,
    first_form,
    normal_curvatures,
    to_border,
)

#: Curvatures are seen on a logarithmic scale from here on ...
_SMALL_CURVATURE = 0.03
#: ... and on a bounded one up to here, 1 / size^2.
_LARGE_CURVATURE = 2.0
#: Channels of :func:`shape`, of :func:`bending`, and of :func:`stretching`.
SHAPE, BENDING, STRETCHING = 8, 5, 4


def shape(p: Planes, frame: Frame) -> list[Tensor]:
    """First form, position in the vertex's own frame, distance from both pairs of sides."""
    _, height, width = p[0].shape
    u, v = (
        torch.linspace(-1.0, 1.0, n, dtype=p[0].dtype, device=p[0].device).abs()
        for n in (height, width)
    )
    place = [geometry.dot(p, axis) for axis in (frame.normal, frame.along, frame.across)]
    sides = [u[:, None].expand_as(p[0]), v[None, :].expand_as(p[0])]
    return [*first_form(frame), *place, *sides]


def bending(p: Planes, frame: Frame) -> list[Tensor]:
    """Gaussian curvature on two scales, curvature and twist of the grid lines."""
    k = to_border(curvature(p))
    gauss = [_asinh(k / _SMALL_CURVATURE) / 4.0, torch.tanh(k / _LARGE_CURVATURE)]
    return [*gauss, *(_asinh(normal_curvatures(p, frame)) / 2.0)]


def _asinh(x: Tensor) -> Tensor:
    """Inverse hyperbolic sine, which PyTorch computes one number at a time on CPUs."""
    return (x.abs() + torch.hypot(x, torch.ones_like(x))).log().copysign(x)


def stretching(frame: Frame, flat: Planes) -> list[Tensor]:
    """How a flat image changes lengths, angle and area of the grid's parallelograms."""
    zero = torch.zeros_like(flat[0])
    x, y = flat
    image = Frame.of((x, y, zero))
    change = [b - a for a, b in zip(first_form(frame), first_form(image), strict=True)]
    area = geometry.norm(geometry.cross(frame.du, frame.dv)).clamp_min(1e-9)
    ratio = geometry.dot(geometry.cross(image.du, image.dv), (zero, zero, zero + 1.0)) / area
    return [3.0 * c.clamp(-2.0, 2.0) for c in change] + [ratio.clamp(-2.0, 4.0) - 1.0]

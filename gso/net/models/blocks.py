"""Building blocks of the nets; all take tensors (B, C, H, W)."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn.functional import silu

from gso.net.models.convolution import Convolution

#: Channels per group of the group normalisation.
_GROUP = 16
#: Slope of the LeakyReLU for negative numbers.
_LEAK = 0.05
#: Scale of positions, and additional scale per order of difference (up to two), such that the
#: scaled values of surfaces in the unit ball are of order one.
_PLACE, _SLOPE = 2.0, 32.0


class Stencils(nn.Module):
    """A 3 x 3 convolution of positions, parametrised by scaled difference stencils.

    The weights are coefficients of nine stencils: tensor products of mean, first difference
    and second difference along rows and columns. They are scaled so that all responses are of
    order one on surfaces in the unit ball with 64 vertices along a side. There, second
    differences are a thousandth of the positions. A plain kernel would need entries in the
    thousands to extract them, which training does not find and half precision cannot store.
    Beyond the border the grid is extrapolated linearly.

    >>> u = torch.linspace(-0.5, 0.5, 64)
    >>> bowl = (0.5 * u.square() + 0.5 * u.square()[:, None])[None, None]
    >>> layer = Stencils(1, 9).requires_grad_(False)
    >>> layer.weight.copy_(torch.eye(9).view(9, 1, 3, 3)).shape
    torch.Size([9, 1, 3, 3])
    >>> bent = layer(bowl)[0, [2, 6], 1:-1, 1:-1]
    >>> bool((bent - 2048 / 63**2).abs().max() < 1e-3)
    True
    """

    scale: Tensor

    def __init__(self, inside: int, outside: int):
        super().__init__()
        self.weight = nn.Conv2d(inside, outside, 3, bias=False).weight
        order = torch.arange(3)[:, None] + torch.arange(3)
        self.register_buffer("scale", _PLACE * _SLOPE ** order.clamp(max=2), persistent=False)

    def forward(self, x: Tensor) -> Tensor:
        # Differences are taken first, in the input's precision, to avoid cancellation later.
        shown = _stencilled(_stencilled(x.movedim(1, -1), 1), 2).flatten(3)
        return (shown @ (self.weight * self.scale).flatten(1).t()).movedim(-1, 1)

    def kernels(self) -> Tensor:
        """Return the equivalent convolution kernels (outside, inside, 3, 3)."""
        return torch.einsum("oiab,abkl->oikl", self.weight, self._stencils().to(self.weight))

    def factors(self, kernels: Tensor) -> Tensor:
        """Return the weights that are equivalent to the given convolution kernels."""
        inverse = torch.linalg.inv(self._stencils().reshape(9, 9)).view(3, 3, 3, 3)
        found = torch.einsum("oikl,klab->oiab", kernels.double(), inverse.to(kernels.device))
        return found.to(kernels.dtype)

    def _stencils(self) -> Tensor:
        """Return the scaled 3 x 3 kernels of the nine stencils."""
        points = torch.eye(9, dtype=torch.float64).view(1, 3, 3, 9)
        middle = _stencilled(_stencilled(points, 1), 2)[0, 1, 1]
        return torch.einsum("xab,ab->abx", middle, self.scale.double().cpu()).view(3, 3, 3, 3)


def _stencilled(x: Tensor, dim: int) -> Tensor:
    """Stack mean, first and second difference along a dimension in a new last dimension."""
    size = x.shape[dim]
    first, second = x.narrow(dim, 0, 1), x.narrow(dim, 1, 1)
    last, before = x.narrow(dim, size - 1, 1), x.narrow(dim, size - 2, 1)
    x = torch.cat([2 * first - second, x, 2 * last - before], dim=dim)
    low, here, high = (x.narrow(dim, k, size) for k in range(3))
    bend = (low - here) + (high - here)
    return torch.stack([here + bend / 3, (high - low) / 2, bend], dim=-1)


class IMDB(nn.Module):
    """Information multi-distillation block (Hui et al. 2019), without biases.

    Each of three convolutions with LeakyReLU(0.05) passes a quarter of its channels to the
    output and the rest to the next convolution. A fourth convolution computes the last quarter.
    A 1 x 1 convolution mixes the quarters, and the result is added to the input.

    >>> sum(p.numel() for p in IMDB(16).parameters())
    6448
    """

    def __init__(self, channels: int):
        super().__init__()
        kept, rest = channels // 4, channels - channels // 4
        self.sizes = (kept, rest)
        self.steps = nn.ModuleList(
            Convolution(n, channels, 3, padding=1, bias=False) for n in (channels, rest, rest)
        )
        self.last = Convolution(rest, kept, 3, padding=1, bias=False)
        self.mix = Convolution(channels, channels, 1, bias=False)
        self.active = nn.LeakyReLU(_LEAK, inplace=True)

    def forward(self, x: Tensor) -> Tensor:
        rest, parts = x, []
        for step in self.steps:
            part, rest = self.active(step(rest)).split(self.sizes, dim=1)
            parts.append(part)
        parts.append(self.last(rest))
        mixed: Tensor = x + self.mix(torch.cat(parts, dim=1))
        return mixed


class Residual(nn.Module):
    """A residual block of two group-normalised convolutions.

    A linear map of the mean over the grid is added between the two convolutions.
    """

    def __init__(self, channels: int):
        super().__init__()
        groups = max(channels // _GROUP, 1)
        self.before, self.between = (nn.GroupNorm(groups, channels) for _ in range(2))
        self.first, self.second = (Convolution(channels, channels, 3, padding=1) for _ in range(2))
        self.everywhere = nn.Linear(channels, channels)

    def forward(self, x: Tensor) -> Tensor:
        y = self.first(silu(self.before(x)))
        y = y + self.everywhere(y.mean(dim=(2, 3)))[:, :, None, None]
        changed: Tensor = x + self.second(silu(self.between(y)))
        return changed

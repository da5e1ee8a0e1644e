"""Building blocks of the nets; all work on (B, C, H, W)."""

from __future__ import annotations

from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import torch
from torch import Tensor, nn
from torch.nn.functional import silu

#: Channels that are normalised together.
_GROUP = 16
#: Whether PyTorch has oneDNN, and lets it be called.
_ONEDNN = torch.backends.mkldnn.is_available() and hasattr(torch, "mkldnn_convolution")
#: What puts weights into the order that oneDNN computes with, and computes with them; not in
#: every version of PyTorch.
_ORDER: Any = getattr(torch._C._nn, "mkldnn_reorder_conv2d_weight", None)
_CONVOLVE: Any = getattr(torch.ops.mkldnn, "_convolution_pointwise", None)


class _Ordered(NamedTuple):
    """A convolution's weights as oneDNN computes with them, and what they were made of."""

    made_of: tuple[Any, ...]
    weight: Tensor


_ORDERED: WeakKeyDictionary[Convolution, _Ordered] = WeakKeyDictionary()


class Convolution(nn.Conv2d):
    """As PyTorch's, but on CPUs single small grids take the fast way, too.

    A single grid with few values PyTorch hands to a loop of its own, which takes up to twice
    the time of the oneDNN that it uses for all others; and that puts the weights in an order of
    its own at every call, which takes up to half the time. Here they are kept in that order.

    >>> x, net = torch.ones(1, 4, 8, 8), Convolution(4, 4, 3, padding=1)
    >>> with torch.inference_mode():
    ...     alone = net(x)
    >>> bool((alone - net(x)).abs().max() < 1e-5)
    True
    """

    def forward(self, x: Tensor) -> Tensor:
        if not _slow(x, self.weight) or isinstance(self.padding, str):
            return super().forward(x)
        how = self.padding, self.stride, self.dilation, self.groups
        # Weights made in inference mode do not tell when they change.
        if _ORDER is None or _CONVOLVE is None or self.weight.is_inference():
            return torch.mkldnn_convolution(x, self.weight, self.bias, *how)
        made_of = self.weight._version, self.weight.data_ptr(), x.shape
        known = _ORDERED.get(self)
        if known is None or known.made_of != made_of:
            plain = self.weight.detach().contiguous().to_mkldnn()
            known = _ORDERED[self] = _Ordered(made_of, _ORDER(plain, *how, x.shape))
        return _CONVOLVE(x, known.weight, self.bias, *how, "none", [], "")


def _slow(x: Tensor, weight: Tensor) -> bool:
    """Whether PyTorch would not give a convolution to oneDNN although that could do it."""
    return (
        _ONEDNN
        and x.is_cpu
        and len(x) == 1
        and x.dtype == weight.dtype == torch.float32
        and not torch.is_grad_enabled()
    )


class IMDB(nn.Module):
    """Information multi-distillation block (Hui et al. 2019), without biases.

    Three convolutions with LeakyReLU(0.05) each hand a quarter of their channels to the end
    and the rest on; a fourth makes the last quarter. The quarters are mixed by a 1 x 1
    convolution and added to the input.

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
        self.active = nn.LeakyReLU(0.05, inplace=True)

    def forward(self, x: Tensor) -> Tensor:
        rest, parts = x, []
        for step in self.steps:
            part, rest = self.active(step(rest)).split(self.sizes, dim=1)
            parts.append(part)
        parts.append(self.last(rest))
        return x + self.mix(torch.cat(parts, dim=1))


class Residual(nn.Module):
    """Two normalised convolutions beside the identity; the mean over the grid joins between."""

    def __init__(self, channels: int):
        super().__init__()
        groups = max(channels // _GROUP, 1)
        self.before, self.between = (nn.GroupNorm(groups, channels) for _ in range(2))
        self.first, self.second = (Convolution(channels, channels, 3, padding=1) for _ in range(2))
        self.everywhere = nn.Linear(channels, channels)

    def forward(self, x: Tensor) -> Tensor:
        y = self.first(silu(self.before(x)))
        y = y + self.everywhere(y.mean(dim=(2, 3)))[:, :, None, None]
        return x + self.second(silu(self.between(y)))

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
#: What puts weights into the order that oneDNN computes with, and what computes with them.
_reordered: Any = getattr(torch._C._nn, "mkldnn_reorder_conv2d_weight", None)
_convolved: Any = getattr(torch.ops.mkldnn, "_convolution_pointwise", None)
#: Whether this version of PyTorch has both.
_REORDERS = _ONEDNN and _reordered is not None and _convolved is not None


class _Kept(NamedTuple):
    """A convolution's weights in oneDNN's order, what they were made of, and when."""

    made_of: Tensor
    version: int
    shape: torch.Size
    weight: Tensor


#: By convolution, and not in it, where copies and files of nets would take them along.
_KEPT: WeakKeyDictionary[Convolution, _Kept] = WeakKeyDictionary()


class Convolution(nn.Conv2d):
    """As PyTorch's, but on CPUs single small grids take the fast way, too.

    A single grid with few values PyTorch hands to a loop of its own, which takes up to twice
    the time of the oneDNN that it uses for all others; and that puts the weights in an order of
    its own at every call, which takes up to half the time. Outside of training they are kept in
    that order until they change; changes through ``weight.data`` are not seen before the next
    call of ``eval()``.

    >>> x, net = torch.ones(1, 4, 8, 8), Convolution(4, 4, 3, padding=1).eval()
    >>> with torch.inference_mode():
    ...     alone = net(x)
    >>> bool((alone - net(x)).abs().max() < 1e-5)
    True
    """

    def forward(self, x: Tensor) -> Tensor:
        if (
            not _slow(x, self.weight)
            or isinstance(self.padding, str)
            or self.padding_mode != "zeros"
        ):
            return super().forward(x)
        how = self.padding, self.stride, self.dilation, self.groups
        # Weights made in inference mode do not tell when they change.
        if not _REORDERS or self.training or self.weight.is_inference():
            return torch.mkldnn_convolution(x, self.weight, self.bias, *how)
        return _convolved(x, self._kept(x.shape).weight, self.bias, *how, "none", [], "")

    def _kept(self, shape: torch.Size) -> _Kept:
        w, known = self.weight, _KEPT.get(self)
        if (
            known is None
            or known.made_of.data_ptr() != w.data_ptr()
            or known.version != w._version
            or known.shape != shape
        ):
            made_of = w.detach()
            how = self.padding, self.stride, self.dilation, self.groups
            weight = _reordered(made_of.contiguous().to_mkldnn(), *how, shape)
            # With what they were made of, whose place in memory no other weights can take then.
            known = _KEPT[self] = _Kept(made_of, w._version, shape, weight)
        return known

    def train(self, mode: bool = True) -> Convolution:
        _KEPT.pop(self, None)
        return super().train(mode)


def _slow(x: Tensor, weight: Tensor) -> bool:
    """Whether PyTorch would not give a convolution to oneDNN although that could do it."""
    return (
        _ONEDNN
        and x.is_cpu
        and len(x) == 1
        and x.dtype == weight.dtype == torch.float32
        and not torch.is_grad_enabled()
        and not torch.jit.is_tracing()
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

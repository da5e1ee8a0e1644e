"""Convolutions of single grids on CPUs, by oneDNN itself.

A single grid with few values PyTorch hands to a loop of its own, which takes up to twice the
time of the oneDNN that it uses for all others; and that puts the weights in an order of its own
at every call, which takes up to half the time. Here it gets all grids, and weights are kept in
that order until they change; changes through ``weight.data`` are not seen before the next call of
:func:`forget`, that is, of the module's ``eval()``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import torch
from torch import Tensor, nn
from torch.nn.functional import conv2d, leaky_relu

#: Whether PyTorch has oneDNN, and lets it be called.
_CALLED = torch.backends.mkldnn.is_available() and hasattr(torch, "mkldnn_convolution")
#: What puts weights into its order, what computes with them, and what adds to what is there.
_reordered: Any = getattr(torch._C._nn, "mkldnn_reorder_conv2d_weight", None)
_convolved: Any = getattr(torch.ops.mkldnn, "_convolution_pointwise", None)
_added: Any = getattr(getattr(torch.ops.mkldnn, "_convolution_pointwise_", None), "binary", None)


class How(NamedTuple):
    """How a convolution goes over its grid; by default 3 x 3, onto the same grid."""

    padding: tuple[int, ...] = (1, 1)
    stride: tuple[int, ...] = (1, 1)
    dilation: tuple[int, ...] = (1, 1)
    groups: int = 1


_SAME = How()


class _Kept(NamedTuple):
    """Weights in oneDNN's order, what they were made of and when, and for what grids."""

    made_of: tuple[Tensor, ...]
    versions: tuple[int, ...]
    shape: torch.Size
    weights: tuple[Tensor, ...]


#: By module, and not in it, where copies and files of nets would take them along.
_KEPT: WeakKeyDictionary[nn.Module, _Kept] = WeakKeyDictionary()


def takes(x: Tensor, weight: Tensor) -> bool:
    """Whether a grid (1, C, H, W) is for oneDNN although PyTorch might not give it to that."""
    return (
        _CALLED
        and x.is_cpu
        and len(x) == 1
        and x.dtype == weight.dtype == torch.float32
        and not torch.is_grad_enabled()
        and not torch.jit.is_tracing()
    )


def keeps(module: nn.Module, *weights: Tensor) -> bool:
    """Whether weights may be kept: outside of training, where they tell when they change."""
    return reorders() and not module.training and not any(w.is_inference() for w in weights)


def kept(
    module: nn.Module,
    shape: torch.Size,
    weights: Sequence[Tensor],
    make: Callable[..., tuple[Tensor, ...]],
) -> tuple[Tensor, ...]:
    """What `make` makes of a module's weights for grids of a shape, made again when they change."""
    known = _KEPT.get(module)
    if (
        known is None
        or known.shape != shape
        or any(
            old.data_ptr() != w.data_ptr() or version != w._version
            for old, version, w in zip(known.made_of, known.versions, weights, strict=True)
        )
    ):
        # What they are made of is kept, too: no other weights can take its place in memory then.
        made_of = tuple(w.detach() for w in weights)
        versions = tuple(w._version for w in weights)
        known = _KEPT[module] = _Kept(made_of, versions, shape, make(*made_of))
    return known.weights


def forget(module: nn.Module) -> None:
    """Make a module's weights anew the next time."""
    _KEPT.pop(module, None)


def reordered(weight: Tensor, shape: torch.Size, how: How = _SAME) -> Tensor:
    """A weight in the order that suits grids of a shape."""
    return _reordered(weight.contiguous().to_mkldnn(), *how, shape)


def convolved(
    x: Tensor,
    weight: Tensor,
    bias: Tensor | None = None,
    how: How = _SAME,
    leak: float | None = None,
) -> Tensor:
    """A grid convolved by a reordered weight; with `leak`, and a LeakyReLU of that slope."""
    after = ("none", []) if leak is None else ("leaky_relu", [leak])
    return _convolved(x, weight, bias, *how, *after, "")


def add_convolved(total: Tensor, x: Tensor, weight: Tensor) -> Tensor:
    """Add a grid convolved by a reordered weight to `total`, which it changes."""
    return _added(total, x, weight, None, *_SAME, "add", None, None, [], None)


@cache
def reorders() -> bool:
    """Whether this version of PyTorch has all that weights in that order need, and as here."""
    if not _CALLED:
        return False
    weight = -torch.ones(4, 4, 3, 3, device="cpu")
    x = torch.ones(1, 4, 4, 4, device="cpu").contiguous(memory_format=torch.channels_last)
    try:
        with torch.inference_mode(), torch.autocast("cpu", enabled=False):
            expected = x + conv2d(leaky_relu(conv2d(x, weight, padding=1), 0.5), weight, padding=1)
            kept = reordered(weight, x.shape)
            found = add_convolved(x.clone(), convolved(x, kept, leak=0.5), kept)
            return torch.allclose(found, expected)
    except (AttributeError, RuntimeError, TypeError, ValueError):
        return False

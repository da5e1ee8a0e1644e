"""Convolutions of single grids on CPUs by direct calls of oneDNN.

For a single small grid PyTorch uses its own loop, which takes up to twice the time of oneDNN,
its backend for all other grids. Moreover, oneDNN reorders the weights at every call, which
takes up to half the time. This module calls oneDNN for all single grids and caches the
reordered weights until they change. Changes through ``weight.data`` are not detected; they
take effect after :func:`forget`, which the module's ``eval()`` calls.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import torch
from torch import Tensor, nn
from torch.nn.functional import conv2d, leaky_relu

#: Whether PyTorch has oneDNN and exposes it.
_CALLED = torch.backends.mkldnn.is_available() and hasattr(torch, "mkldnn_convolution")
#: oneDNN operations: reorder weights, convolve with them, and convolve and add in place.
_reordered: Any = getattr(torch._C._nn, "mkldnn_reorder_conv2d_weight", None)
_convolved: Any = getattr(torch.ops.mkldnn, "_convolution_pointwise", None)
_added: Any = getattr(getattr(torch.ops.mkldnn, "_convolution_pointwise_", None), "binary", None)


class How(NamedTuple):
    """Parameters of a convolution; by default those of 3 x 3 kernels that keep the grid size."""

    padding: tuple[int, ...] = (1, 1)
    stride: tuple[int, ...] = (1, 1)
    dilation: tuple[int, ...] = (1, 1)
    groups: int = 1


_SAME = How()


class _Kept(NamedTuple):
    """Cache entry: reordered weights, their source tensors and versions, and the grid shape."""

    made_of: tuple[Tensor, ...]
    versions: tuple[int, ...]
    shape: torch.Size
    weights: tuple[Tensor, ...]


#: Cache by module. It is not stored in the module, where copies of nets would include it.
_KEPT: WeakKeyDictionary[nn.Module, _Kept] = WeakKeyDictionary()


def takes(x: Tensor, weight: Tensor) -> bool:
    """Tell whether to call oneDNN directly for a grid (1, C, H, W)."""
    return (
        _CALLED
        and x.is_cpu
        and len(x) == 1
        and x.dtype == weight.dtype == torch.float32
        and not torch.is_grad_enabled()
        and not torch.jit.is_tracing()
    )


def keeps(module: nn.Module, *weights: Tensor) -> bool:
    """Tell whether weights may be cached: not in training, and only if their version is known."""
    return reorders() and not module.training and not any(w.is_inference() for w in weights)


def kept(
    module: nn.Module,
    shape: torch.Size,
    weights: Sequence[Tensor],
    make: Callable[..., tuple[Tensor, ...]],
) -> tuple[Tensor, ...]:
    """Return the cached result of `make` for a module's weights and a grid shape.

    `make` is called again when the weights or the shape change.
    """
    known = _KEPT.get(module)
    if (
        known is None
        or known.shape != shape
        or any(
            old.data_ptr() != w.data_ptr() or version != w._version
            for old, version, w in zip(known.made_of, known.versions, weights, strict=True)
        )
    ):
        # Keep the source tensors, so that no other weights can reuse their memory addresses.
        made_of = tuple(w.detach() for w in weights)
        versions = tuple(w._version for w in weights)
        known = _KEPT[module] = _Kept(made_of, versions, shape, make(*made_of))
    return known.weights


def forget(module: nn.Module) -> None:
    """Drop a module's cached weights."""
    _KEPT.pop(module, None)


def reordered(weight: Tensor, shape: torch.Size, how: How = _SAME) -> Tensor:
    """Reorder a weight for grids of a shape."""
    return _reordered(weight.contiguous().to_mkldnn(), *how, shape)


def convolved(
    x: Tensor,
    weight: Tensor,
    bias: Tensor | None = None,
    how: How = _SAME,
    leak: float | None = None,
) -> Tensor:
    """Convolve a grid with a reordered weight; `leak` is the slope of a LeakyReLU after it."""
    after = ("none", []) if leak is None else ("leaky_relu", [leak])
    return _convolved(x, weight, bias, *how, *after, "")


def add_convolved(total: Tensor, x: Tensor, weight: Tensor) -> Tensor:
    """Convolve a grid with a reordered weight and add the result to `total` in place."""
    return _added(total, x, weight, None, *_SAME, "add", None, None, [], None)


@cache
def reorders() -> bool:
    """Tell whether this version of PyTorch supports reordered weights, by a small computation."""
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

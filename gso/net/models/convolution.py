"""Convolutions that are fast for single grids on processors, too."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn


class Convolution(nn.Conv2d):
    """A convolution whose weights are reordered once, and not at each call.

    PyTorch computes convolutions on processors by oneDNN, which reorders the weights at each
    call. With one thread and small inputs, such as a single grid at a quarter of its resolution,
    PyTorch does not use oneDNN at all, and takes two to three times as long. Without gradients
    this class calls oneDNN with weights that it reordered before. Results agree with those of
    ``nn.Conv2d`` up to rounding errors.

    >>> layer, x = Convolution(8, 8, 3, padding=1), torch.ones(1, 8, 4, 4)
    >>> with torch.inference_mode():
    ...     bool((layer(x) - nn.Conv2d.forward(layer, x)).abs().max() < 1e-6)
    True
    """

    #: The weights' version, the weights themselves, and the reordered ones. As long as the weights
    #: are kept, no others have their address.
    _ready: tuple[int, Tensor, Tensor] | None = None

    def forward(self, input: Tensor) -> Tensor:
        if not self._served(input):
            return super().forward(input)
        made: Tensor = torch.ops.mkldnn._convolution_pointwise(
            input,
            self._reordered(input),
            self.bias,
            self.padding,
            self.stride,
            self.dilation,
            self.groups,
            "none",
            [],
            "",
        )
        return made

    def _served(self, x: Tensor) -> bool:
        """Tell whether oneDNN can be called for an input, and is faster."""
        weight = self.weight
        return bool(
            _AVAILABLE
            and not torch.is_grad_enabled()
            and self.padding_mode == "zeros"
            and not isinstance(self.padding, str)
            and x.device.type == weight.device.type == "cpu"
            and x.dtype == weight.dtype == torch.float32
            and x.numel() > 0
            # Only tensors made outside of inference mode count their changes.
            and not weight.is_inference()
            and torch.backends.mkldnn.enabled
            and not torch.is_autocast_enabled("cpu")
            and not torch.compiler.is_compiling()
        )

    def _reordered(self, x: Tensor) -> Tensor:
        weight, ready = self.weight, self._ready
        if ready is None or ready[0] != weight._version or ready[1].data_ptr() != weight.data_ptr():
            kept = weight.detach()
            made = torch.ops.mkldnn._reorder_convolution_weight(
                kept, self.padding, self.stride, self.dilation, self.groups, list(x.shape)
            )
            self._ready = ready = (weight._version, kept, made)
        return ready[2]

    def __getstate__(self) -> dict[str, Any]:
        """Leave the reordered weights out of copies."""
        return {name: value for name, value in self.__dict__.items() if name != "_ready"}


def _available() -> bool:
    """Tell whether PyTorch has oneDNN, and the operations with reordered weights."""
    names = ("_convolution_pointwise", "_reorder_convolution_weight")
    return bool(torch.backends.mkldnn.is_available()) and all(
        hasattr(torch.ops.mkldnn, name) for name in names
    )


_AVAILABLE = _available()

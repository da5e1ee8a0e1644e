"""Base class of all nets."""

from __future__ import annotations

from abc import abstractmethod
from contextlib import AbstractContextManager
from typing import Any

import torch
from torch import Tensor, nn

from gso.errors import OptionError
from gso.net.catalogue import TASKS
from gso.net.grids import planes, rectangle
from gso.spelling import choices

#: Samples along each side at which nets are trained.
SIZE = 64


class Net(nn.Module):
    """A net that moves the points of grids (B, H, W, 3) of the unit ball.

    Attributes
    ----------
    task : {"developable", "flatten", "denoise"}
        Task of the net.
    settings : dict
        Keyword arguments from which the class makes an equal net.
    passes : int
        Number of passes: how often the net is applied to its own result.
    multiple : int
        Number of which H and W must be multiples.
    bf16 : bool
        Whether convolutions run in bfloat16. Inputs, outputs and curvatures are in single
        precision in any case.
    """

    passes = 1
    multiple = 1

    def __init__(self, task: str, **settings: Any):
        super().__init__()
        if task not in TASKS:
            raise OptionError(f"no task {task!r} for a net; {choices(task, TASKS)}")
        self.task, self.settings, self.bf16 = task, {"task": task, **settings}, False

    def begin_with(self, other: Net) -> None:
        """Copy the weights of a net of this kind and size; RuntimeError if they do not fit."""
        self.load_state_dict(other.state_dict())

    @abstractmethod
    def displacements(
        self, surface: Tensor, sigma: Tensor | None = None, *, passes: int | None = None
    ) -> Tensor:
        """Compute the displacements (B, H, W, d) from :meth:`start`.

        Gradients flow through the last pass only; results of earlier passes are constants.

        Parameters
        ----------
        surface : Tensor, (B, H, W, 3)
            Grids of the unit ball.
        sigma : Tensor, (B,), optional
            Standard deviation of the noise, for nets that take it as an input.
        passes : int, optional
            Number of passes; all of the net's by default.
        """

    @abstractmethod
    def carried(
        self,
        surface: Tensor,
        fine: Tensor,
        sigma: Tensor | None = None,
        *,
        passes: int | None = None,
    ) -> Tensor:
        """Compute displacements (B, h, w, d) of `fine`, the same surfaces at another resolution."""

    def start(self, surface: Tensor) -> Tensor:
        """Return what the net displaces: the surface, or for "flatten" the initial rectangle."""
        return rectangle(planes(surface)) if self.task == "flatten" else surface

    def forward(self, surface: Tensor, sigma: Tensor | None = None) -> Tensor:
        """Compute results (B, H, W, 3), or flat images (B, H, W, 2), for grids (B, H, W, 3)."""
        return self.start(surface) + self.displacements(surface, sigma)

    def autocast(self, device: torch.device) -> torch.autocast:
        """Return the autocast context for convolutions, enabled if `bf16` is."""
        return torch.autocast(device.type, torch.bfloat16, enabled=self.bf16)


def exact(*, tuned: bool = False) -> AbstractContextManager[None]:
    """Return a context in which GPUs compute convolutions in full single precision.

    The default of GPUs (TF32) keeps only ten bits of the mantissa, which is visible in the
    curvature of results.

    Parameters
    ----------
    tuned : bool
        Whether cuDNN benchmarks its algorithms first; this pays off for many batches of one
        size.
    """
    return torch.backends.cudnn.flags(enabled=True, benchmark=tuned, allow_tf32=False)

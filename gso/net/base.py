"""What all nets have in common."""

from __future__ import annotations

from abc import abstractmethod
from contextlib import AbstractContextManager
from typing import Any

import torch
from torch import Tensor, nn

from gso.net.catalogue import TASKS
from gso.net.grids import planes, rectangle
from gso.spelling import choices
from gso.status import OptionError

#: Samples along each side that nets are trained at.
SIZE = 64


class Net(nn.Module):
    """A net that moves the points of grids (B, H, W, 3) of the unit ball.

    Attributes
    ----------
    task : {"developable", "flatten", "denoise"}
        What it was made for.
    settings : dict
        What it is made of again, with its class.
    passes : int
        How often it is applied.
    multiple : int
        What the sides of the grids are multiples of.
    bf16 : bool
        Convolutions run in bfloat16; what goes in and comes out, curvature above all, is in single
        precision all the same.
    """

    passes = 1
    multiple = 1

    def __init__(self, task: str, **settings: Any):
        super().__init__()
        if task not in TASKS:
            raise OptionError(f"no task {task!r} for a net; {choices(task, TASKS)}")
        self.task, self.settings, self.bf16 = task, {"task": task, **settings}, False

    def begin_with(self, other: Net) -> None:
        """Take the weights of another net of this kind and size; RuntimeError if they don't fit."""
        self.load_state_dict(other.state_dict())

    @abstractmethod
    def displacements(
        self, surface: Tensor, sigma: Tensor | None = None, *, passes: int | None = None
    ) -> Tensor:
        """Displacements (B, H, W, d) from the start.

        Gradients are those of the last pass: what the passes before it made is given to it.

        Parameters
        ----------
        surface : Tensor, (B, H, W, 3)
            Grids of the unit ball.
        sigma : Tensor, (B,), optional
            Standard deviation of the noise, for nets that are told.
        passes : int, optional
            How many passes; all of the net's when not given.
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
        """Displacements (B, h, w, d) of the grids `fine`, which are `surface` resampled."""

    def start(self, surface: Tensor) -> Tensor:
        """Return what is moved: the surface, or for flat images Flatten-init."""
        return rectangle(planes(surface)) if self.task == "flatten" else surface

    def forward(self, surface: Tensor, sigma: Tensor | None = None) -> Tensor:
        """Grids (B, H, W, 3), or flat images (B, H, W, 2), of grids (B, H, W, 3)."""
        return self.start(surface) + self.displacements(surface, sigma)

    def autocast(self, device: torch.device) -> torch.autocast:
        """Context for convolutions."""
        return torch.autocast(device.type, torch.bfloat16, enabled=self.bf16)


def exact(*, tuned: bool = False) -> AbstractContextManager[None]:
    """Context in which GPUs compute convolutions in all of single precision.

    Their default keeps ten bits of it where a net computes in single precision; curvature
    would show that.

    Parameters
    ----------
    tuned : bool
        Whether algorithms are tried out first: worth it for many batches of one size.
    """
    return torch.backends.cudnn.flags(enabled=True, benchmark=tuned, allow_tf32=False)

"""Base class of all nets."""

from __future__ import annotations

from abc import abstractmethod
from contextlib import AbstractContextManager

import torch
from torch import Tensor, nn

from gso.errors import OptionError
from gso.net import tasks
from gso.net.models.grid_geometry import planes, rectangle
from gso.net.models.resampling import resampled


class Net(nn.Module):
    """A net that moves the points of grids (B, H, W, 3) of the unit ball.

    Attributes
    ----------
    task : str
        Name of the net's task.
    kind : NetTask
        The task.
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
    #: Names of what :meth:`exported_outputs` returns.
    EXPORTED_OUTPUTS: tuple[str, ...] = ("displacements",)

    def __init__(self, task: str, **settings: object):
        super().__init__()
        self.kind = tasks.get(task)
        self.task, self.settings, self.bf16 = task, {"task": task, **settings}, False

    def copy_weights_from(self, other: Net) -> None:
        """Copy the weights of a net of this kind and size; RuntimeError if they do not fit."""
        self.load_state_dict(other.state_dict())

    @abstractmethod
    def displacements(
        self,
        surface: Tensor,
        sigma: Tensor | None = None,
        *,
        passes: int | None = None,
        unrolled: bool = False,
    ) -> Tensor:
        """Compute the displacements (B, H, W, d) from :meth:`initial_geometry`.

        Parameters
        ----------
        surface : Tensor, (B, H, W, 3)
            Grids of the unit ball.
        sigma : Tensor, (B,), optional
            Standard deviation of the noise, for nets that take it as an input.
        passes : int, optional
            Number of passes; all of the net's by default.
        unrolled : bool
            Whether gradients flow through all passes. Otherwise the results of all passes but
            the last are constants.
        """

    def displacements_at(
        self,
        surface: Tensor,
        fine: Tensor,
        sigma: Tensor | None = None,
        *,
        passes: int | None = None,
    ) -> Tensor:
        """Compute displacements (B, h, w, d) of `fine`, the same surfaces at another resolution."""
        moved = self.displacements(surface, sigma, passes=passes)
        return resampled(moved, fine.shape[1], fine.shape[2])

    def exported_outputs(
        self, surface: Tensor, sigma: Tensor | None = None, *, passes: int | None = None
    ) -> tuple[Tensor, ...]:
        """Compute what an exported net returns, as `EXPORTED_OUTPUTS` names it.

        It is :meth:`displacements` and, if they are spline fields, the fields' coefficients
        "coarse" and "fine" (B, d, n, m) in radii of the unit ball: components along the axes
        of the flat image, or along normal, rows and columns of :class:`gso.geometry.GridFrame`.
        Nets with a confidence also return its coefficients (B, 1, n, m).
        """
        return (self.displacements(surface, sigma, passes=passes),)

    def initial_geometry(self, surface: Tensor) -> Tensor:
        """Return what the net displaces: the surface, or for flat images a rectangle."""
        return rectangle(planes(surface)) if self.kind.flat else surface

    def forward(self, surface: Tensor, sigma: Tensor | None = None) -> Tensor:
        """Compute results (B, H, W, 3), or flat images (B, H, W, 2), for grids (B, H, W, 3)."""
        return self.initial_geometry(surface) + self.displacements(surface, sigma)

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


def device_of(name: str | None) -> torch.device:
    """Return a device by its name, or the GPU when there is one and no name is given.

    Raises
    ------
    OptionError
        There is no such device.
    """
    name = name or ("cuda" if torch.cuda.is_available() else "cpu")
    try:
        device = torch.device(name)
        torch.empty(0, device=device)
    except (RuntimeError, AssertionError):
        raise OptionError(f"there is no device {name!r}; take 'cpu'") from None
    return device

"""The published net: a U-Net of multi-distillation blocks on all vertices."""

from __future__ import annotations

from itertools import pairwise

import torch
from torch import Tensor, nn

from gso.errors import OptionError
from gso.net.models.base import Net
from gso.net.models.blocks import IMDB, Stencils
from gso.net.models.convolution import Convolution
from gso.net.models.grid_geometry import axes

_LEVELS = 3


class GSONet(Net):
    """GSO-Net (Wang et al. 2024), which maps absolute positions to displacements.

    Three levels of `blocks` multi-distillation blocks with additive skips, no biases, no
    normalisation. 16 channels and 4 blocks are the published setting: 2,820,832 parameters,
    2,820,688 for flat images.

    Parameters
    ----------
    task : str
        Task of the net.
    channels : int
        Channels at full resolution (NC), a multiple of 4; they double at each level.
    blocks : int
        Blocks per level (NB).
    tanh : bool
        Whether displacements pass through tanh, as in the paper but not in the code of its
        figures.
    sigma : bool
        Whether the noise level is an input, as a constant fourth channel.
    aligned : bool
        Whether grids are first rotated to align their lines with the axes, and displacements
        rotated back. The result is then equivariant under rotations, unlike the published net.
    stencils : bool
        Whether the first layer is parametrised by difference stencils, with as many weights as
        the published net's kernels: see :class:`gso.net.models.blocks.Stencils`.

    Raises
    ------
    OptionError
        A setting is out of range.

    Examples
    --------
    >>> sum(p.numel() for p in GSONet().parameters())
    2820832
    >>> GSONet("flatten", channels=8, blocks=2)(torch.zeros(1, 16, 16, 3)).shape
    torch.Size([1, 16, 16, 2])
    """

    multiple = 2**_LEVELS

    def __init__(
        self,
        task: str = "developable",
        *,
        channels: int = 16,
        blocks: int = 4,
        tanh: bool = False,
        sigma: bool = False,
        aligned: bool = False,
        stencils: bool = False,
    ):
        if channels % 4 or not 4 <= channels <= 256 or not 1 <= blocks <= 64:
            raise OptionError(
                f"channels {channels}, blocks {blocks}: take a multiple of 4 up to 256, and 1 to 64"
            )
        settings = {"tanh": tanh, "sigma": sigma, "aligned": aligned, "stencils": stencils}
        super().__init__(task, channels=channels, blocks=blocks, **settings)
        self.tanh, self.sigma, self.aligned = tanh, sigma, aligned
        widths = [channels << k for k in range(_LEVELS + 1)]
        steps = list(pairwise(widths))

        def level(width: int) -> list[nn.Module]:
            return [IMDB(width) for _ in range(blocks)]

        def conv(inside: int, outside: int) -> Convolution:
            return Convolution(inside, outside, 3, padding=1, bias=False)

        self.head = Stencils(3 + sigma, channels) if stencils else conv(3 + sigma, channels)
        self.down = nn.ModuleList(
            nn.Sequential(*level(a), Convolution(a, b, 2, stride=2, bias=False)) for a, b in steps
        )
        self.body = nn.Sequential(*level(widths[-1]))
        self.up = nn.ModuleList(
            nn.Sequential(nn.ConvTranspose2d(b, a, 2, stride=2, bias=False), *level(a))
            for a, b in reversed(steps)
        )
        self.tail = conv(channels, self.kind.components)
        # The initial displacement is zero; random ones would crumple the surface.
        nn.init.zeros_(self.tail.weight)

    def copy_weights_from(self, other: Net) -> None:
        """Copy weights, also from a net with the other kind of first layer.

        The converted layer is equivalent except at the border of grids.
        """
        state, mine, its = other.state_dict(), self.head, other.head
        if isinstance(its, Stencils) and not isinstance(mine, Stencils):
            state["head.weight"] = its.kernels()
        elif isinstance(mine, Stencils) and not isinstance(its, Stencils):
            state["head.weight"] = mine.factors(state["head.weight"])
        self.load_state_dict(state)

    def displacements(
        self,
        surface: Tensor,
        sigma: Tensor | None = None,
        *,
        passes: int | None = None,
        unrolled: bool = False,
    ) -> Tensor:
        turn = axes(surface) if self.aligned else None
        seen = surface if turn is None else torch.einsum("bhwi,bij->bhwj", surface, turn)
        x = seen.movedim(-1, 1)
        if self.sigma:
            if sigma is None:
                raise OptionError("this net must be told sigma")
            # In units of 0.01, so that typical values are of order one.
            level = (100.0 * sigma)[:, None, None, None].expand(-1, 1, *x.shape[2:])
            x = torch.cat([x, level.to(x.dtype)], dim=1)
        x = x.contiguous(memory_format=torch.channels_last)
        y = self.head(x)
        skips = [y]
        with self.autocast(x.device):
            for step in self.down:
                skips.append(step(skips[-1]))
            y = self.body(skips[-1])
            *coarser, (finest, last) = zip(self.up, reversed(skips[1:]), strict=True)
            for step, skip in coarser:
                y = step(y + skip)
        # Curvature amplifies rounding errors by the square of the resolution: the layers that
        # take positions or make displacements compute in single precision.
        y = self.tail(finest((y + last).to(x.dtype)) + skips[0])
        moved = (torch.tanh(y) if self.tanh else y).movedim(1, -1)
        # Flat images are already aligned with the axes of their rectangle.
        if turn is None or self.kind.flat:
            return moved
        return torch.einsum("bhwj,bij->bhwi", moved, turn)

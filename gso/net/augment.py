"""Changes of surfaces that make more of them."""

from __future__ import annotations

import torch
from torch import Tensor

from gso.net.grids import normalise_with

#: Largest off-diagonal element of the random shear.
_SHEAR = 0.3


def symmetries(grids: list[Tensor], generator: torch.Generator) -> list[Tensor]:
    """Reversed and transposed square grids (B, N, N, d): the same change for all of a row.

    Each of the eight is as likely.
    """
    count = len(grids[0])
    flips = torch.rand(3, count, generator=generator) < 0.5
    out = []
    for x in grids:
        rows, columns, turned = (f.to(x.device)[:, None, None, None] for f in flips)
        x = torch.where(rows, x.flip(1), x)
        x = torch.where(columns, x.flip(2), x)
        out.append(torch.where(turned, x.transpose(1, 2), x))
    return out


def shear(grids: list[Tensor], generator: torch.Generator) -> list[Tensor]:
    """Surfaces under a random near-diagonal shear and a random turn: the same for all of a row.

    The first ones are in the unit ball again, and the others as they lie to them.
    """
    count = len(grids[0])
    off = _SHEAR * torch.rand(count, 3, 3, generator=generator)
    eye = torch.eye(3)
    sheared = torch.where(eye.bool(), eye, off)
    turn, upper = torch.linalg.qr(torch.randn(count, 3, 3, generator=generator))
    # Signs make the distribution uniform (Stewart 1980).
    turn = turn * upper.diagonal(dim1=1, dim2=2).sign()[:, None]
    change = sheared @ turn
    out = [torch.einsum("bhwi,bij->bhwj", x, change.to(x)) for x in grids]
    return list(normalise_with(*out))

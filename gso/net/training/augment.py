"""Data augmentation of grids."""

from __future__ import annotations

import torch
from torch import Tensor

from gso.net.models.grid_geometry import normalise_with

#: Largest off-diagonal element of the random shear.
_SHEAR = 0.3


def symmetries(grids: list[Tensor], generator: torch.Generator) -> list[Tensor]:
    """Apply random symmetries of the square to grids (B, N, N, d).

    Entry b of every tensor in `grids` gets the same of the eight reversals and transpositions,
    which are equally likely.
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
    """Apply a random near-diagonal shear and a random rotation or reflection to surfaces.

    Entry b of every tensor in `grids` gets the same map. The first tensor is then normalised
    to the unit ball, and the others undergo the same similarity transform.
    """
    count = len(grids[0])
    off = _SHEAR * torch.rand(count, 3, 3, generator=generator)
    eye = torch.eye(3)
    sheared = torch.where(eye.bool(), eye, off)
    turn, upper = torch.linalg.qr(torch.randn(count, 3, 3, generator=generator))
    # The signs make the distribution of orthogonal matrices uniform (Stewart 1980).
    turn = turn * upper.diagonal(dim1=1, dim2=2).sign()[:, None]
    change = sheared @ turn
    out = [torch.einsum("bhwi,bij->bhwj", x, change.to(x)) for x in grids]
    return list(normalise_with(*out))

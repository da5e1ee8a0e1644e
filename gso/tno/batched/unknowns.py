"""The unknowns of many surfaces; the last axis of every tensor is that of the surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import torch
from torch import Tensor

from gso.tno.batched.stage_batch import StageBatch
from gso.typing import Array

T = TypeVar("T")


@dataclass(frozen=True)
class Unknowns:
    """The unknowns of many surfaces: free vertices, or one unknown for each vertex.

    Attributes
    ----------
    size : int
        Number of unknowns.
    of : Tensor of int, (N,), or None
        Unknown of each coordinate; None if the coordinates are the unknowns.
    share, offset : Tensor, (N, B), or None
        Coordinates are ``offset + share * x[of]``.
    """

    size: int
    of: Tensor | None = None
    share: Tensor | None = None
    offset: Tensor | None = None

    @classmethod
    def stacked(cls, parts: Sequence[StageBatch], device: torch.device) -> Unknowns:
        """Stack the unknowns of surfaces."""
        first = parts[0]
        if first.of is None:
            return cls(first.size)
        of = torch.as_tensor(first.of.astype(np.int64), device=device)
        shares = [part.share for part in parts if part.share is not None]
        offsets = [part.offset for part in parts if part.offset is not None]
        return cls(first.size, of, columns(shares, device), columns(offsets, device))

    def points(self, x: Tensor) -> Tensor:
        """Return the coordinates (N, B) of unknowns (n, B)."""
        if self.of is None or self.share is None or self.offset is None:
            return x
        return torch.addcmul(self.offset, self.share, x[self.of])

    def direction(self, dx: Tensor) -> Tensor:
        """Return the change of the coordinates (N, B)."""
        return dx if self.of is None or self.share is None else self.share * dx[self.of]

    def of_surfaces(self, which: Tensor) -> Unknowns:
        """Return the unknowns of some surfaces."""
        return replace(self, share=pick(self.share, which), offset=pick(self.offset, which))


def columns(parts: Sequence[Array], device: torch.device) -> Tensor:
    """Join arrays whose first axis is that of the surfaces, and make it the last axis."""
    there = [torch.from_numpy(np.require(part, requirements="W")).to(device) for part in parts]
    whole = there[0] if len(there) == 1 else torch.cat(there)
    return whole.movedim(0, -1).contiguous()


def pick(values: T, which: Tensor) -> T | Tensor:
    """Return the entries of some surfaces along the last axis; numbers are those of all."""
    return values.index_select(-1, which) if isinstance(values, Tensor) else values

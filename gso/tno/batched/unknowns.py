"""The unknowns of many surfaces; the last axis of every tensor is that of the surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gso.tno.batched.gathered import Gathered


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
    of: Any = None
    share: Any = None
    offset: Any = None

    @classmethod
    def stacked(cls, parts: Sequence[Gathered], device: torch.device) -> Unknowns:
        """Stack the unknowns of surfaces."""
        first = parts[0]
        if first.of is None:
            return cls(first.size)
        return cls(
            first.size,
            torch.as_tensor(first.of.astype(np.int64), device=device),
            columns([part.share for part in parts], device),
            columns([part.offset for part in parts], device),
        )

    def points(self, x: Tensor) -> Tensor:
        """Return the coordinates (N, B) of unknowns (n, B)."""
        return x if self.of is None else torch.addcmul(self.offset, self.share, x[self.of])

    def direction(self, dx: Tensor) -> Tensor:
        """Return the change of the coordinates (N, B)."""
        return dx if self.of is None else self.share * dx[self.of]

    def of_surfaces(self, which: Tensor) -> Unknowns:
        """Return the unknowns of some surfaces."""
        if self.of is None:
            return self
        return replace(self, share=picked(self.share, which), offset=picked(self.offset, which))


def columns(parts: Sequence[Any], device: torch.device) -> Tensor:
    """Join arrays whose first axis is that of the surfaces, and make it the last axis."""
    there = [torch.from_numpy(np.require(part, requirements="W")).to(device) for part in parts]
    whole = there[0] if len(there) == 1 else torch.cat(there)
    return whole.movedim(0, -1).contiguous()


def picked(values: Any, which: Tensor) -> Any:
    """Return the entries of some surfaces along the last axis; numbers are those of all."""
    return values.index_select(-1, which) if isinstance(values, Tensor) else values

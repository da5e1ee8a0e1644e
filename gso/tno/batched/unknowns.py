"""The unknowns of many surfaces; the last axis of every tensor is that of the surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gso.typing import Array
from gso.unknowns import Variables


class Unbatchable(Exception):
    """Surfaces cannot be solved together: their problems differ in structure."""


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
    def stacked(cls, each: Sequence[Variables], device: torch.device) -> Unknowns:
        """Stack the unknowns of surfaces.

        Raises
        ------
        Unbatchable
            A coordinate depends on several unknowns, or on none.
        """
        first = each[0]
        if first.basis is None:
            return cls(first.size)
        shares = []
        for variables in each:
            if first.single is None or variables.single is None or variables.size != first.size:
                raise Unbatchable
            of, share = variables.single
            if not np.array_equal(of, first.single[0]):
                raise Unbatchable
            shares.append(share)
        if (of >= first.size).any():
            raise Unbatchable
        return cls(
            first.size,
            torch.as_tensor(of.astype(np.int64), device=device),
            columns(shares, device),
            columns([v.offset for v in each], device),
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


def columns(arrays: Sequence[Array], device: torch.device) -> Tensor:
    """Stack arrays, one for each surface, along a new last axis."""
    return torch.as_tensor(np.stack(arrays, axis=-1), device=device)


def picked(values: Any, which: Tensor) -> Any:
    """Return the entries of some surfaces along the last axis; numbers are those of all."""
    return values.index_select(-1, which) if isinstance(values, Tensor) else values

"""Torch datasets of the arrays of a split."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch

from gso.dataset.lazy import LazyArray


class TorchData(torch.utils.data.Dataset[tuple[torch.Tensor, ...]]):
    """A torch ``Dataset`` of tuples, one tensor per array.

    Parameters
    ----------
    arrays : sequence of LazyArray
        Arrays of a split.
    dtype : torch.dtype
        Type of the tensors.
    channels_first : bool
        Whether grids are (d, H, W) instead of (H, W, d).
    in_memory : bool
        Read all surfaces now, instead of each one on access.
    """

    def __init__(
        self,
        arrays: Sequence[LazyArray],
        *,
        dtype: torch.dtype = torch.float32,
        channels_first: bool = True,
        in_memory: bool = False,
    ):
        self.dtype, self.channels_first = dtype, channels_first
        self.count = len(arrays[0])
        self.arrays: list[LazyArray | torch.Tensor] = list(arrays)
        if in_memory:
            self.arrays = [torch.from_numpy(array[:]).to(dtype) for array in arrays]

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, index: int) -> tuple[torch.Tensor, ...]:
        return tuple(self._tensor(array, index) for array in self.arrays)

    def _tensor(self, array: LazyArray | torch.Tensor, index: int) -> torch.Tensor:
        row = array[index]
        found = row if isinstance(row, torch.Tensor) else torch.from_numpy(np.asarray(row))
        if self.channels_first and found.ndim == 3:
            found = found.permute(2, 0, 1)
        return found.to(self.dtype).contiguous()

"""Sums of the rows of a tensor by segment, always in the same order."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from gso.typing import Ints


class Sums:
    """Adds rows that have the same target, without atomic operations.

    Targets are ordered by the number of their rows, most first. The k-th rows of all targets
    that have as many are then added at once, to the first rows of the result. The order of the
    additions does not depend on the device or the number of threads.

    Parameters
    ----------
    targets : ndarray of int, (p,)
        Target of each row; every target from 0 to `count` - 1 may have any number of rows.
    count : int
        Number of targets.
    device : torch.device

    Attributes
    ----------
    order : ndarray of int, (count,)
        Target of each row of the result.

    Examples
    --------
    >>> sums = Sums(np.array([1, 0, 1]), 2, torch.device("cpu"))
    >>> sums.order.tolist(), sums(torch.tensor([[1.0], [2.0], [3.0]])).ravel().tolist()
    ([1, 0], [4.0, 2.0])
    """

    def __init__(self, targets: Ints, count: int, device: torch.device):
        size = np.bincount(targets, minlength=count)
        self.order = np.argsort(-size, kind="stable")
        by_target = np.argsort(targets, kind="stable")
        first = (np.cumsum(size) - size)[self.order]
        sizes = size[self.order]
        self.count = count
        self._rows = []
        for k in range(int(sizes.max(initial=0))):
            many = int(np.searchsorted(-sizes, -k, side="left"))
            self._rows.append(torch.as_tensor(by_target[first[:many] + k], device=device))

    def __call__(self, rows: Tensor) -> Tensor:
        """Add rows (p, ...) by target, (count, ...), in the order of :attr:`order`."""
        out = rows.new_zeros((self.count, *rows.shape[1:]))
        for which in self._rows:
            out[: len(which)] += rows.index_select(0, which)
        return out

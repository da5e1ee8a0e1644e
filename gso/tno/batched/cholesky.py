"""Cholesky factorisation of many block-banded matrices at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from gso.errors import BackendError
from gso.linalg.base import Pattern
from gso.typing import Ints

#: Time per floating-point operation of a factorisation and of a triangular solve, relative to a
#: product; and that of calling them, as a number of operations. Measured on a processor.
_FACTOR, _SOLVE, _CALL = 6.0, 2.5, 3e5
#: Smallest blocks, most blocks over which the band is divided, and most bytes of one matrix.
_SMALLEST, _DEEPEST, _LARGEST = 8, 6, 2e8


@dataclass(frozen=True)
class Blocks:
    """Division of a banded matrix into square blocks.

    Attributes
    ----------
    size : int
        Rows of a block.
    count : int
        Blocks along the diagonal; the last one may have rows past the matrix.
    band : int
        Blocks below each diagonal block that may have entries.
    """

    size: int
    count: int
    band: int

    @property
    def cost(self) -> float:
        """Approximate time of a factorisation, in operations of a product."""
        p, cube = self.band, float(self.size) ** 3
        each = (_FACTOR / 3 + _SOLVE + 2 * p + p * (p + 1)) * cube + _CALL * (6 + 2 * p)
        return self.count * each

    @property
    def bytes(self) -> int:
        """Memory of one matrix."""
        return 8 * self.count * (self.band + 1) * self.size**2


def divide(pattern: Pattern) -> Blocks | None:
    """Divide a matrix into blocks such that its factorisation is fast; None if it is too large.

    On grids numbered row by row a block has the unknowns of a row.

    Parameters
    ----------
    pattern : Pattern
        Sparsity pattern of the lower triangle.
    """
    n, band = pattern.size, max(pattern.bandwidth, 1)
    # Products of blocks of odd sizes are slower.
    sizes = {8 * -(-band // (8 * k)) for k in range(1, _DEEPEST + 1)}
    # Blocks that divide the matrix evenly are those of whole rows.
    sizes |= {size for size in range(_SMALLEST, 2 * band + 1) if n % size == 0}
    found = []
    for size in sorted(min(max(size, _SMALLEST), n) for size in sizes):
        apart = int((pattern.indices // size - pattern.columns // size).max(initial=0))
        found.append(Blocks(size, -(-n // size), apart))
    best = min(found, key=lambda blocks: blocks.cost)
    return best if best.bytes <= _LARGEST else None


class BlockBanded:
    """Symmetric positive definite matrices with one block-banded pattern.

    A panel holds a column of blocks, from the diagonal one downwards.

    Parameters
    ----------
    pattern : Pattern
        Sparsity pattern of the lower triangle.
    order : ndarray of int, (nnz,)
        Entry of the pattern that each row of the values given to :meth:`factor` is.
    blocks : Blocks
        The division of the matrix.
    device : torch.device
    """

    def __init__(self, pattern: Pattern, order: Ints, blocks: Blocks, device: torch.device):
        self.blocks, self.unknowns = blocks, pattern.size
        m = blocks.size
        row, column = pattern.indices[order], pattern.columns[order]
        panel, below = column // m, row - column // m * m
        # Diagonal blocks have both triangles.
        twin = np.flatnonzero((below < m) & (row != column))
        self._twin = torch.as_tensor(twin, device=device)
        place = np.r_[below * m + column % m, ((column % m) * m + below)[twin]]
        self._panel = torch.as_tensor(np.r_[panel, panel[twin]], device=device)
        self._place = torch.as_tensor(place, device=device)
        self._panels: Tensor | None = None
        self._inverse: list[Tensor] = []

    def factor(self, values: Tensor) -> Tensor:
        """Factor matrices, and return the mask (B,) of those that are not positive definite.

        Parameters
        ----------
        values : Tensor, (nnz, B)
            Entries of the lower triangles.
        """
        m, count, band = self.blocks.size, self.blocks.count, self.blocks.band
        surfaces = values.shape[1]
        shape = (count, surfaces, (band + 1) * m, m)
        if self._panels is None or self._panels.shape != shape:
            self._panels = None
            self._panels = values.new_zeros(shape)
        else:
            self._panels.zero_()
        panels = self._panels
        flat = panels.view(count, surfaces, -1)
        flat[self._panel, :, self._place] = torch.cat([values, values.index_select(0, self._twin)])
        # Rows past the matrix are those of the identity.
        own = panels[:, :, :m]
        own[-1].diagonal(dim1=-2, dim2=-1)[:, self.unknowns - (count - 1) * m :] = 1.0
        failed = torch.zeros(surfaces, dtype=torch.int32, device=values.device)
        unit = torch.eye(m, dtype=values.dtype, device=values.device).expand(surfaces, m, m)
        self._inverse = []
        for k, panel in enumerate(panels):
            lower, info = torch.linalg.cholesky_ex(panel[:, :m])
            failed += info
            # Products are faster than triangular solves, of which this is the only one.
            inverse = torch.linalg.solve_triangular(lower, unit, upper=False)
            self._inverse.append(inverse)
            below = panel[:, m : (min(band, count - 1 - k) + 1) * m]
            if below.shape[1]:
                below.copy_(torch.bmm(below, inverse.mT))
            for e in range(below.shape[1] // m):
                rest = below[:, e * m :]
                panels[k + e + 1][:, : rest.shape[1]].baddbmm_(rest, rest[:, :m].mT, alpha=-1.0)
        return failed > 0

    def solve(self, rhs: Tensor) -> Tensor:
        """Solve for the right-hand sides (n, B), one for each matrix."""
        if self._panels is None:
            raise BackendError("there is no factorisation to solve with")
        m, count, band = self.blocks.size, self.blocks.count, self.blocks.band
        # The rows past the matrix make room for those that the last panels have.
        x = rhs.new_zeros((rhs.shape[1], (count + band) * m, 1))
        x[:, : self.unknowns, 0] = rhs.T
        for k in range(count):
            here = x[:, k * m : (k + 1) * m]
            here.copy_(torch.bmm(self._inverse[k], here))
            if k < count - 1:
                x[:, (k + 1) * m : (k + band + 1) * m].baddbmm_(
                    self._panels[k][:, m:], here, alpha=-1.0
                )
        for k in range(count - 1, -1, -1):
            here = x[:, k * m : (k + 1) * m]
            if k < count - 1:
                after = x[:, (k + 1) * m : (k + band + 1) * m]
                here.baddbmm_(self._panels[k][:, m:].mT, after, alpha=-1.0)
            here.copy_(torch.bmm(self._inverse[k].mT, here))
        return x[:, : self.unknowns, 0].T.contiguous()

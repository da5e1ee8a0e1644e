"""Weighted terms of many surfaces: residuals, gradients and matrices of their elements.

The last axis of every tensor is that of the surfaces.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import fields, replace
from functools import cached_property
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gso.energy.losses import Loss
from gso.solver.chain import by_point
from gso.tno.batched.stage_batch import TermBatch, Unbatchable
from gso.tno.batched.tensor_kernels import geometric_stiffness, kernel
from gso.tno.batched.unknowns import Unknowns, columns, pick

#: Numbers per row of a block of elements: on a processor its work arrays then stay in the cache,
#: on a graphics processor they fit into memory.
_BLOCK, _LARGE_BLOCK = 16384, 1 << 21


def stack_losses(losses: Sequence[Loss], device: torch.device) -> Loss:
    """Return one loss with the parameters of many, as tensors (B,) where they differ."""
    first: Any = losses[0]
    settings = {}
    for field in fields(first):
        values = [getattr(loss, field.name) for loss in losses]
        if any(value != values[0] for value in values):
            settings[field.name] = torch.tensor(values, dtype=torch.float64, device=device)
    stacked: Loss = replace(first, **settings)
    return stacked


def _loss_of(loss: Loss, which: Tensor) -> Loss:
    """Return a stacked loss of some surfaces."""
    whole: Any = loss
    changes = {f.name: pick(getattr(loss, f.name), which) for f in fields(whole)}
    some: Loss = replace(whole, **changes)
    return some


class Term:
    """One weighted term of many surfaces, with equal stencils.

    Parameters
    ----------
    parts : sequence of TermBatch
        The term of some surfaces each.
    unknowns : Unknowns
    device : torch.device

    Attributes
    ----------
    columns : ndarray of int, (q, e)
        Unknowns of each element.

    Raises
    ------
    Unbatchable
        Points of an element do not move with one unknown each.
    """

    def __init__(self, parts: Sequence[TermBatch], unknowns: Unknowns, device: torch.device):
        first = parts[0]
        self.name, self.shape, self.quadratic = first.name, first.shape, first.quadratic
        self._residual, self._vectors = first.residual, first.vectors
        gather = first.gather.astype(np.int64)
        self._gather = torch.as_tensor(gather, device=device)
        self.constants = columns([part.constants for part in parts], device)
        self.factor = columns([part.factor for part in parts], device)
        self.loss = stack_losses([loss for part in parts for loss in part.losses], device)
        self._slope: Tensor | None = None
        self._by_point = unknowns.of is not None
        self.columns = gather
        if unknowns.of is not None:
            own = by_point(gather, self.shape, unknowns.of.cpu().numpy(), unknowns.size)
            if own is None:
                raise Unbatchable
            self.columns = own

    @cached_property
    def count(self) -> int:
        """Number of elements."""
        return int(self._gather.shape[1])

    @property
    def pairs(self) -> int:
        """Entries of the lower triangle of an element's matrix."""
        q = len(self.columns)
        return q * (q + 1) // 2

    def of_surfaces(self, which: Tensor) -> Term:
        """Return the term of some surfaces."""
        other = copy(self)
        other.constants, other.factor = pick(self.constants, which), pick(self.factor, which)
        other.loss, other._slope = _loss_of(self.loss, which), pick(self._slope, which)
        return other

    def with_loss(self, loss: Loss) -> Term:
        """Return the term with another stacked loss."""
        other = copy(self)
        other.loss = loss
        return other

    def _blocks(self, points: Tensor) -> Iterator[tuple[slice, Tensor, Tensor]]:
        """Yield elements, their coordinates (k, b, B) and constants (c, b, B) block by block."""
        most = _BLOCK if points.device.type == "cpu" else _LARGE_BLOCK
        size = max(most // points.shape[1], 1)
        for start in range(0, self.count, size):
            at = slice(start, min(start + size, self.count))
            x = points[self._gather[:, at]]
            yield at, x, self.constants[:, at]

    def _cost(self, residual: Tensor, at: slice) -> Tensor:
        return (self.loss.value(residual) * self.factor[at]).sum(dim=(0, 1))

    def energy(self, points: Tensor) -> Tensor:
        """Return the weighted energy (B,) at coordinates (N, B); not finite where it overflows."""
        run = kernel(self._residual, self.shape, len(self.constants), False)
        total = points.new_zeros(points.shape[1])
        for at, x, c in self._blocks(points):
            total += self._cost(run(x, c)[0], at)
        return total

    def linearise(
        self, points: Tensor, share: Tensor | None, gradient: Tensor, entries: Tensor | None
    ) -> Tensor:
        """Write the elements' gradients and matrices, and return the energy (B,).

        Parameters
        ----------
        points : Tensor, (N, B)
            Coordinates.
        share : Tensor, (N, B), or None
            Of the unknowns.
        gradient : Tensor, (q, e, B)
            Is written.
        entries : Tensor, (pairs, e, B), or None
            Is written, in the order of :func:`gso.solver.assembly.products`.
        """
        key = self.shape, len(self.constants)
        known = self._slope
        run = kernel(self._residual, *key, known is None)
        vectors = self._vectors
        bend = None if vectors is None else geometric_stiffness(vectors, *key)
        total = points.new_zeros(points.shape[1])
        for at, x, c in self._blocks(points):
            residual, slope = run(x, c)
            slope = self._pull(slope, share, at) if known is None else known[:, :, at]
            total += self._cost(residual, at)
            first, second = self.loss.weights(residual)
            first = first * self.factor[at]
            torch.mul(first[0], slope[0], out=gradient[:, at])
            for k in range(1, len(first)):
                gradient[:, at].addcmul_(first[k], slope[k])
            if entries is None:
                continue
            here = entries[:, at]
            _products(slope, second * self.factor[at], here, fresh=True)
            if bend is not None:
                turned = self._pull(bend(x, c)[1], share, at)
                _products(turned, first[: bend.rows].clamp(min=0.0), here, fresh=False)
        return total

    def keep_slope(self, points: Tensor, share: Tensor | None) -> None:
        """Compute the Jacobian of a quadratic term once."""
        run = kernel(self._residual, self.shape, len(self.constants), True)
        blocks = [self._pull(run(x, c)[1], share, at) for at, x, c in self._blocks(points)]
        self._slope = torch.cat(blocks, dim=2)

    def _pull(self, slope: Tensor, share: Tensor | None, at: slice) -> Tensor:
        """Return the Jacobian by unknowns (r, q, b, B) from that by coordinates."""
        if share is None or not self._by_point:
            return slope
        dim = self.shape[0]
        moved = share[self._gather[:, at]]
        r, k, *rest = slope.shape
        parts = (slope * moved).view(r, k // dim, dim, *rest)
        return parts.sum(dim=2)


def _products(slope: Tensor, weight: Tensor, out: Tensor, *, fresh: bool) -> None:
    """Write or add the sums of weight * J_a * J_b over the residuals, for all pairs a <= b."""
    rows, q = slope.shape[:2]
    weighted = slope * weight[:, None]
    start = 0
    for a in range(q):
        part = out[start : start + q - a]
        for k in range(rows):
            if fresh and k == 0:
                torch.mul(weighted[0, a], slope[0, a:], out=part)
            else:
                part.addcmul_(weighted[k, a], slope[k, a:])
        start += q - a

"""The sum of weighted terms of many surfaces over their unknowns."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Sequence
from copy import copy
from threading import Lock
from typing import TypeAlias

import numpy as np
import torch
from torch import Tensor

from gso.energy.losses import Loss
from gso.linalg.base import Pattern
from gso.parametrization.orientation import SAFETY, degenerate
from gso.solver.assembly import assemble
from gso.tno.batched.cholesky import BlockBanded, divide
from gso.tno.batched.stage_batch import StageBatch, Unbatchable
from gso.tno.batched.sums import Sums
from gso.tno.batched.tensor_terms import Term
from gso.tno.batched.unknowns import Unknowns
from gso.typing import Ints

#: Memory for rows of all terms: whole, and term by term.
_Rows: TypeAlias = tuple[Tensor, list[Tensor]]
#: Structures that are kept for the next batch.
_KEPT = 24
_structures: OrderedDict[bytes, Structure] = OrderedDict()
_lock = Lock()


class Structure:
    """The sparsity pattern that problems share: sums of elements, and the place of each entry.

    Parameters
    ----------
    n : int
        Number of unknowns.
    varying, constant : sequence of ndarray of int, (q, e)
        Unknowns of the elements of each term, whose matrices vary or are constant.
    device : torch.device

    Raises
    ------
    Unbatchable
        An element has an unknown twice, or the matrix is too large as a dense band.
    """

    def __init__(
        self, n: int, varying: Sequence[Ints], constant: Sequence[Ints], device: torch.device
    ):
        from scipy.sparse import csc_matrix

        made = assemble(n, [*varying, *constant], csc_matrix((n, n)))
        if any(places.doubled for places in made.places):
            raise Unbatchable
        blocks = divide(made.pattern)
        if blocks is None:
            raise Unbatchable
        self.pattern: Pattern = made.pattern
        scatter = [places.scatter for places in made.places]
        split = len(varying)
        self.entries = Sums(_join(scatter[:split]), self.pattern.nnz, device)
        self.gradient = Sums(_join([c.ravel() for c in (*varying, *constant)]), n, device)
        self._fixed = Sums(_join(scatter[split:]), self.pattern.nnz, device)
        order = self.entries.order
        self._from_fixed = _inverse(self._fixed.order)[order]
        self._unknown = torch.as_tensor(_inverse(self.gradient.order), device=device)
        #: Rows of the diagonal among the values.
        self.diagonal = torch.as_tensor(_inverse(order)[made.diagonal], device=device)
        self.blocks, self._order, self._device = blocks, order, device

    def solver(self) -> BlockBanded:
        """Return a solver of matrices with these values."""
        return BlockBanded(self.pattern, self._order, self.blocks, self._device)

    def constant(self, entries: Tensor) -> Tensor:
        """Return the constant part of the values (nnz, B)."""
        return self._fixed(entries)[torch.as_tensor(self._from_fixed, device=self._device)]

    def summed(self, gradients: Tensor) -> Tensor:
        """Return the gradient (n, B) of the elements' gradients."""
        return self.gradient(gradients).index_select(0, self._unknown)


def _join(arrays: Sequence[Ints]) -> Ints:
    return np.concatenate([np.zeros(0, np.int64), *arrays])


def _inverse(order: Ints) -> Ints:
    out = np.empty(len(order), np.int64)
    out[order] = np.arange(len(order))
    return out


def _structure(n: int, terms: Sequence[Term], device: torch.device) -> Structure:
    """Return the structure of terms; the last few are kept."""
    digest = hashlib.blake2b(f"{n} {device}".encode())
    for term in terms:
        digest.update(f"{term.quadratic} {term.columns.shape}".encode())
        digest.update(np.ascontiguousarray(term.columns).data)
    key = digest.digest()
    with _lock:
        found = _structures.pop(key, None)
    if found is None:
        varying, fixed = ([t.columns for t in terms if t.quadratic is q] for q in (False, True))
        found = Structure(n, varying, fixed, device)
    with _lock:
        _structures[key] = found
        while len(_structures) > _KEPT:
            _structures.popitem(last=False)
    return found


def forget() -> None:
    """Forget the structures of former batches, to have their memory back."""
    with _lock:
        _structures.clear()


class Problem:
    """Objectives of many surfaces over their unknowns, with one structure.

    Parameters
    ----------
    parts : sequence of StageBatch
        Surfaces whose stages have one key.
    device : torch.device

    Raises
    ------
    Unbatchable
        The surfaces cannot be solved together.
    """

    def __init__(self, parts: Sequence[StageBatch], device: torch.device):
        first = parts[0]
        self.unknowns = Unknowns.stacked(parts, device)
        each = zip(*(part.terms for part in parts), strict=True)
        terms = [Term(same, self.unknowns, device) for same in each]
        # Terms with a constant matrix come last.
        self.terms = sorted(terms, key=lambda term: term.quadratic)
        self.surfaces = sum(map(len, parts))
        self.structure = _structure(self.unknowns.size, self.terms, device)
        self._limits = [torch.tensor(c, device=device) for c in first.corners]
        self._device = device
        self._constant = self._fixed_matrix(first.coordinates)

    def _fixed_matrix(self, size: int) -> Tensor | None:
        """Return the sum of the constant matrices."""
        fixed = [term for term in self.terms if term.quadratic]
        if not fixed:
            return None
        points = torch.zeros(size, self.surfaces, dtype=torch.float64, device=self._device)
        gradients, entries = self._rows(fixed)
        for term, gradient, part in zip(fixed, gradients[1], entries[1], strict=True):
            term.keep_slope(points, self.unknowns.share)
            term.linearise(points, self.unknowns.share, gradient, part)
        return self.structure.constant(entries[0])

    def _rows(self, terms: Sequence[Term]) -> tuple[_Rows, _Rows]:
        """Return memory for the elements' gradients and matrices: whole, and term by term."""
        out = []
        for sizes in ([len(t.columns) for t in terms], [t.pairs for t in terms]):
            shapes = [(size, t.count, self.surfaces) for size, t in zip(sizes, terms, strict=True)]
            rows = [a * b for a, b, _ in shapes]
            whole = torch.empty(sum(rows), self.surfaces, dtype=torch.float64, device=self._device)
            parts = [p.view(s) for p, s in zip(torch.split(whole, rows), shapes, strict=True)]
            out.append((whole, parts))
        return out[0], out[1]

    def of_surfaces(self, which: Tensor) -> Problem:
        """Return the problem of some surfaces."""
        other = copy(self)
        other.terms = [term.of_surfaces(which) for term in self.terms]
        other.unknowns = self.unknowns.of_surfaces(which)
        other.surfaces = len(which)
        if self._constant is not None:
            other._constant = self._constant.index_select(-1, which)
        return other

    def with_loss(self, name: str, loss: Loss) -> Problem:
        """Return the problem with another stacked loss of the non-quadratic terms of one name."""
        other = copy(self)
        other.terms = [
            t.with_loss(loss) if t.name == name and not t.quadratic else t for t in self.terms
        ]
        return other

    def energy(self, x: Tensor) -> Tensor:
        """Return the objectives (B,) at unknowns (n, B); infinity where they are not finite."""
        points = self.unknowns.points(x)
        total = torch.stack([term.energy(points) for term in self.terms]).sum(dim=0)
        return torch.where(torch.isfinite(total), total, float("inf"))

    def by_term(self, points: Tensor) -> dict[str, Tensor]:
        """Return the objectives (B,) by term at coordinates (N, B); infinity as in `energy`."""
        out: dict[str, Tensor] = {}
        for term in self.terms:
            value = term.energy(points)
            value = torch.where(torch.isfinite(value), value, float("inf"))
            out[term.name] = out[term.name] + value if term.name in out else value
        return out

    def linearise(self, x: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return energies (B,), gradients (n, B), and values (nnz, B) of the matrices."""
        points = self.unknowns.points(x)
        varying = [term for term in self.terms if not term.quadratic]
        (gradients, by_term), _ = self._rows(self.terms)
        _, (entries, matrices) = self._rows(varying)
        total = []
        for number, term in enumerate(self.terms):
            part = matrices[number] if number < len(varying) else None
            total.append(term.linearise(points, self.unknowns.share, by_term[number], part))
        values = self.structure.entries(entries)
        if self._constant is not None:
            values += self._constant
        energy = torch.stack(total).sum(dim=0)
        energy = torch.where(torch.isfinite(energy), energy, float("inf"))
        return energy, self.structure.summed(gradients), values

    def largest_step(self, x: Tensor, dx: Tensor) -> Tensor:
        """Return the largest steps (B,) along dx, at most 1, that cross no limit."""
        longest = x.new_ones(x.shape[1])
        if not self._limits:
            return longest
        at, along = self.unknowns.points(x), self.unknowns.direction(dx)
        for first in self._limits:
            corners, moved = ([(p[k], p[k + 1]) for k in first] for p in (at, along))
            steps = degenerate(corners, moved).amin(dim=0)
            longest = torch.minimum(longest, SAFETY * steps)
        return longest

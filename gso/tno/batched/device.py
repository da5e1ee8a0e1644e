"""Minimisation of gathered stages on one of PyTorch's devices."""

from __future__ import annotations

import time
from collections.abc import Sequence

import torch

from gso.errors import OptionError
from gso.solver import Timings
from gso.tno.batched.batch_minimiser import minimise
from gso.tno.batched.batch_problem import Problem, forget
from gso.tno.batched.stage_batch import StageBatch, StageMinima, TooLarge
from gso.tno.batched.tensor_terms import stack_losses
from gso.tno.batched.unknowns import columns
from gso.typing import Array


def check_device(device: str) -> None:
    """Raise an OptionError if there is no such device."""
    try:
        torch.zeros(1, dtype=torch.float64, device=device).item()
    except (RuntimeError, AssertionError, TypeError) as error:
        reason = str(error).splitlines()[0]
        raise OptionError(f"device {device!r} cannot be used ({reason}); take 'cpu'") from None


def solve(parts: Sequence[StageBatch], device: str) -> list[StageMinima]:
    """Minimise parts with one key together, and return the minima of each.

    Raises
    ------
    Unbatchable
        They cannot be solved together.
    TooLarge
        The device has too little memory for them.
    """
    try:
        return _solve(parts, torch.device(device))
    except torch.cuda.OutOfMemoryError:
        pass
    # Outside the handler, which would keep the tensors alive.
    forget()
    torch.cuda.empty_cache()
    raise TooLarge


def _solve(parts: Sequence[StageBatch], device: torch.device) -> list[StageMinima]:
    first, timings, clock = parts[0], Timings(), time.perf_counter()
    problem = Problem(parts, device)
    start = columns([part.start for part in parts], device)
    by_iteration = zip(*(part.continuation for part in parts), strict=True)
    losses = [
        stack_losses([loss for part in each for loss in part], device) for each in by_iteration
    ]
    timings.setup += time.perf_counter() - clock
    minima = minimise(
        problem,
        start,
        iterations=first.iterations,
        tolerance=first.tolerance,
        continuation=losses,
        continued=first.continued,
        method=first.method,
        timings=timings,
    )
    clock = time.perf_counter()
    points = problem.unknowns.points(minima.x)
    energies, steps = torch.stack(minima.energies), torch.stack(minima.steps)
    whole = [_rows(t) for t in (minima.x, points, energies, steps)]
    flat = [t.cpu().numpy() for t in (minima.energy, minima.code, minima.iterations)]
    wanted = [points]
    if first.others is not None:
        wanted.append(columns([p.others for p in parts if p.others is not None], device))
    found = [{n: v.cpu().numpy() for n, v in problem.by_term(at).items()} for at in wanted]
    timings.setup += time.perf_counter() - clock
    out, begin, total = [], 0, sum(map(len, parts))
    for part in parts:
        own = slice(begin, begin + len(part))
        begin = own.stop
        share = timings.scaled(len(part) / total)
        x, at, energy, step = (a[own] for a in whole)
        value, code, iterations = (a[own] for a in flat)
        by_term = tuple({name: each[own] for name, each in energies.items()} for energies in found)
        out.append(StageMinima(x, at, value, code, iterations, energy, step, share, by_term))
    return out


def _rows(values: torch.Tensor) -> Array:
    """Return values (k, B) as an array (B, k)."""
    return values.T.contiguous().cpu().numpy()

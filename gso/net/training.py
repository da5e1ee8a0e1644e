"""Train a net: a loop that can be killed anywhere and goes on where it was."""

from __future__ import annotations

import time
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import torch
from torch import Tensor
from torch.nn.parallel import DistributedDataParallel

from gso.net.base import exact
from gso.net.config import Config
from gso.net.objective import Objective
from gso.net.processes import interruption, processes
from gso.net.run import MODEL, Run, Tick, begin
from gso.net.schedule import place
from gso.status import OptionError

__all__ = ["MODEL", "Report", "train"]

#: Steps between two entries of the loss.
_REPORT = 20


class Report(NamedTuple):
    """How a run is going.

    Attributes
    ----------
    step : int
        Steps done.
    progress : float
        Share of the run that is done.
    left : float
        Seconds that are left, at the mean speed so far.
    loss : float
        Mean loss of the last steps.
    figures : dict of str to float
        Metrics on validation surfaces, when last measured.
    """

    step: int
    progress: float
    left: float
    loss: float
    figures: dict[str, float]


def train(
    config: Config,
    data: str | PathLike[str],
    out: str | PathLike[str],
    *,
    minutes: float | None = None,
    device: str | None = None,
    show: Callable[[Report], None] | None = None,
    tick: Tick | None = None,
) -> dict[str, Any]:
    """Train a net, or go on with a run that was ended.

    ``out/model.safetensors`` is the net with its card, renewed at each validation; a killed
    run goes on from its last checkpoint, and ends with the same weights if it counts steps
    and not minutes. Under ``torchrun`` each step's surfaces are shared among the processes.

    Parameters
    ----------
    config : Config
        What to do; see :func:`gso.net.config.read`.
    data : path
        Set of surfaces with the splits train and validation.
    out : path
        Folder of the run.
    minutes : float, optional
        Length of the run, validation included; instead of the configuration's steps.
    device : str, optional
        "cpu", "cuda" ...; where there is a GPU, that when not given.
    show : callable, optional
        Given a :class:`Report` now and then.
    tick : callable, optional
        Told what is counted before training, how many there are, how many there will be.

    Returns
    -------
    dict
        The net's card.

    Raises
    ------
    OptionError
        The configuration does not fit, or `out` holds a run with another one.
    DatasetError
        The set cannot be read or lacks what is to be learnt.
    WeightsError
        The checkpoint or a net to begin with is damaged.
    """
    if minutes is not None and not minutes > 0:
        raise OptionError(f"minutes is {minutes!r}; it must be positive")
    with processes(device) as here, exact(tuned=True):
        for phase in config.phases:
            if phase.batch % here.world:
                raise OptionError(f"batch {phase.batch} is no multiple of {here.world} processes")
        run = begin(config, Path(data), Path(out), minutes, here, tick)
        try:
            with interruption() as asked:
                _loop(run, show, asked)
        finally:
            run.close()
    return run.card


def _loop(run: Run, show: Callable[[Report], None] | None, interrupted: Callable[[], bool]) -> None:
    config, here = run.config, run.here
    objective: Any = Objective(run.net)
    if here.world > 1:
        objective = DistributedDataParallel(objective)
    start, before = time.monotonic(), run.spent
    validated = kept = run.spent
    losses: list[Tensor] = []
    while (progress := run.progress) < 1.0:
        at = place(config.phases, progress)
        batch = run.source.batch(
            config, at.phase, run.step, rank=here.rank, world=here.world, device=here.device
        )
        for optimiser in run.optimisers:
            for group in optimiser.param_groups:
                group["lr"] = at.rate
            optimiser.zero_grad(set_to_none=True)
        loss = objective(batch, at.phase, at.progress)
        loss.backward()
        norm = torch.nn.utils.clip_grad_norm_(run.net.parameters(), at.phase.clip)
        # A surface without a finite gradient costs one step, and not the run.
        if bool(norm.isfinite()):
            for optimiser in run.optimisers:
                optimiser.step()
        run.step += 1
        run.follow()
        losses.append(loss.detach())
        run.spent = before + time.monotonic() - start
        if run.step % _REPORT == 0:
            mean = float(torch.stack(losses).mean())
            losses.clear()
            if run.curves is not None:
                run.curves.add(run.step, run.spent, loss=mean, rate=at.rate, phase=at.number)
            if show is not None and here.first:
                left = run.spent / max(progress, 1e-9) * (1.0 - progress)
                show(Report(run.step, progress, left, mean, run.figures))
        if here.agreed(run.spent - validated) > config.validate_every:
            run.validate()
            validated = run.spent = before + time.monotonic() - start
        if run.spent - kept > config.checkpoint_every:
            run.keep()
            kept = run.spent
        if here.agreed(interrupted()):
            run.keep()
            raise KeyboardInterrupt
    run.validate()
    run.keep()

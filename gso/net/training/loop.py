"""Training of nets in a loop that can be interrupted and resumed."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import torch
from torch import nn
from torch.nn.parallel import DistributedDataParallel

from gso.errors import OptionError
from gso.net.models.base import exact
from gso.net.training.config import Config
from gso.net.training.data import Tick
from gso.net.training.learning_rate import place
from gso.net.training.phase_objective import Objective
from gso.net.training.processes import interruption, processes
from gso.net.training.training_curves import Means
from gso.net.training.training_run import MODEL, Run, begin
from gso.quantities import as_positive
from gso.typing import AnyPath, Json

__all__ = ["MODEL", "Report", "train"]

#: Number of steps between two records of the loss.
_REPORT = 20


class Report(NamedTuple):
    """Progress report of a run.

    Attributes
    ----------
    step : int
        Number of steps done.
    progress : float
        Completed fraction of the run.
    left : float
        Estimated remaining seconds, from the mean speed so far.
    loss : float
        Mean loss of the last steps; NaN if all of them were skipped.
    figures : dict of str to float
        Metrics of the last validation.
    """

    step: int
    progress: float
    left: float
    loss: float
    figures: dict[str, float]


def train(
    config: Config,
    data: AnyPath,
    out: AnyPath,
    *,
    minutes: float | None = None,
    device: str | None = None,
    show: Callable[[Report], None] | None = None,
    tick: Tick | None = None,
) -> Json:
    """Train a net, or resume an interrupted run.

    The net is written to ``out/model.safetensors``, with its card, at each validation, and to
    ``out/best.safetensors`` when its validation score is the best so far. A killed
    run resumes from its last checkpoint. It ends with the same weights if its length is given
    in steps, not in minutes. Under ``torchrun`` the processes share the surfaces of each step.

    Parameters
    ----------
    config : Config
        Configuration; see :func:`gso.net.training.config.read`.
    data : path
        Dataset with the splits train and validation.
    out : path
        Folder of the run.
    minutes : float, optional
        Length of the run including validation; it replaces the configuration's steps.
    device : str, optional
        "cpu", "cuda" ...; by default the GPU if there is one.
    show : callable, optional
        Callback that gets a :class:`Report` from time to time.
    tick : callable, optional
        Progress callback for the preparation, called with the name of the counted items, the
        number done and the total number.

    Returns
    -------
    dict
        The net's card.

    Raises
    ------
    OptionError
        The configuration is inconsistent, or `out` holds a run with another configuration,
        dataset or number of minutes.
    DatasetError
        The dataset cannot be read or lacks the labels.
    WeightsError
        The checkpoint, or a net named by the configuration, is missing or damaged.
    """
    if minutes is not None:
        as_positive(minutes, "minutes")
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
    objective: nn.Module = Objective(run.net)
    if here.world > 1:
        objective = DistributedDataParallel(objective)
    start, before = time.monotonic(), run.spent
    validated = kept = run.spent
    means = Means()
    while (progress := run.progress) < 1.0:
        at = place(config.phases, progress, config.warm_up)
        batch = run.source.batch(
            config, at.phase, run.step, rank=here.rank, world=here.world, device=here.device
        )
        for optimiser in run.optimisers:
            for group in optimiser.param_groups:
                group["lr"] = at.rate
            optimiser.zero_grad(set_to_none=True)
        loss, terms = objective(batch, at.phase, at.progress)
        loss.backward()
        norm = torch.nn.utils.clip_grad_norm_(run.net.parameters(), at.phase.clip)
        # A step with a non-finite gradient is skipped; it must not spoil the run.
        if bool(norm.isfinite()):
            for optimiser in run.optimisers:
                optimiser.step()
            means.add(loss=loss.detach(), **{f"loss/{name}": term for name, term in terms.items()})
        else:
            run.skipped += 1
        run.step += 1
        run.follow()
        run.spent = before + time.monotonic() - start
        if run.step % _REPORT == 0:
            values = means.taken()
            if run.curves is not None:
                rest = {"rate": at.rate, "phase": at.number, "skipped": run.skipped}
                run.curves.add(run.step, run.spent, **values, **rest)
            if show is not None and here.first:
                left = run.spent / max(progress, 1e-9) * (1.0 - progress)
                show(Report(run.step, progress, left, values.get("loss", math.nan), run.figures))
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

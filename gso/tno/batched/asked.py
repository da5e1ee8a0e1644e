"""What a batch is solved for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import torch

from gso.errors import OptionError
from gso.tasks.base import Options
from gso.tno.optimize import check

#: Formulations whose stages can be solved in batches, by task.
FORMULATIONS = {"developable": ("curvature",), "flatten": ("strain", "lengths")}


@dataclass(frozen=True)
class Asked:
    """What every surface of a batch is solved for, with checked options."""

    task: str
    formulation: str
    options: Options
    device: str
    verdict: bool


def checked(
    task: str = "developable",
    formulation: str | None = None,
    options: Any = None,
    device: str = "cpu",
    verdict: bool = False,
) -> Asked:
    """Check the arguments of :func:`optimize_batch` that do not depend on the surfaces.

    Raises
    ------
    OptionError
        Something is unknown, or has no batched solve.
    """
    _, chosen, settings = check(task, formulation, options)
    known = FORMULATIONS.get(task, ())
    if chosen not in known:
        there = "; ".join(f"{name}: {', '.join(some)}" for name, some in FORMULATIONS.items())
        raise OptionError(
            f"task {task!r} with formulation {chosen!r} is not solved in batches ({there} are); "
            "use gso.tno.optimize_many"
        )
    try:
        torch.zeros(1, dtype=torch.float64, device=device).item()
    except (RuntimeError, AssertionError, TypeError) as error:
        reason = str(error).splitlines()[0]
        raise OptionError(f"device {device!r} cannot be used ({reason}); take 'cpu'") from None
    return Asked(task, chosen, settings, str(device), verdict)

"""Time against size: optimiser with either kernels, net, hybrid."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from harness import quietly

from gso.net import tasks as net_tasks
from report import kernels, measure, store
from report.method import TASKS, Method
from report.methods import DEFAULT, methods, of
from report.settings import Settings
from report.store import Store

_SCRIPT = Path(__file__).with_name("measure.py")
#: Seconds for the repeated solves of one size.
_BUDGET = 20.0
#: Smallest side used for the exponent; below it the time hardly depends on the size.
_LEAST = 32
#: Phases, in the order in which they are shown.
PHASES = ("net", "setup", "evaluation", "assembly", "factor", "solve", "pattern", "verdict")
#: Methods that are compared; :func:`_named` maps them to the methods of each task.
METHODS = ("TNO", "TNO, NumPy", "Net", "hybrid")


@dataclass
class Timing:
    """A method at one size.

    Attributes
    ----------
    task, method, size : str, str, int
        Task, method and side of the grid.
    seconds : list of float
        Seconds of every solve.
    iterations, factorisations : int
        Numbers in one solve.
    peak_mb : float
        Peak memory of the process, including Python and its packages, MB.
    shares : dict of str to float
        Shares of the time by :data:`PHASES`.
    limit : float or None
        Seconds of one numeric factorisation per iteration, by the fastest backend.
    backend, fastest : str
        Backend of the last stage, and the fastest backend for it.
    absent : str
        Why there are no figures, or "".
    """

    task: str
    method: str
    size: int
    seconds: list[float] = field(default_factory=list)
    iterations: int = 0
    factorisations: int = 0
    peak_mb: float = 0.0
    shares: dict[str, float] = field(default_factory=dict)
    limit: float | None = None
    backend: str = ""
    fastest: str = ""
    absent: str = ""

    @property
    def median(self) -> float:
        """Median time, with the flat pattern and the verdict."""
        return float(np.median(self.seconds))

    @property
    def solve(self) -> float:
        """Median time of the solve alone."""
        rest = sum(self.shares.get(part, 0.0) for part in ("pattern", "verdict"))
        return (1.0 - rest) * self.median


def pieces(settings: Settings) -> list[tuple[str, str, int]]:
    """Return task, method and size of everything that is timed."""
    return [(task, m, size) for task in TASKS for m in METHODS for size in settings.sizes]


def timings(settings: Settings, kept: Store, tick: Callable[..., None]) -> list[Timing]:
    """Measure what is not stored yet, and return all timings."""
    found = []
    for task, name, size in pieces(settings):
        method = of(task, _named(task, name))
        timing = Timing(task, name, size, absent=_absent(name, method))
        if not timing.absent:
            place = f"timing/{task}-{name}-{size}".replace(", ", "-")
            key = method.key(0.0) | {
                "kernels": kernels.key(_choice(name)) if method.kernels else "",
                "processor": store.processor(),
                "repeats": settings.repeats,
                "script": store.source(_SCRIPT),
            }
            known = kept.find(place, key)
            if known is None:
                known = _measured(
                    task, name, method.net, size, settings.repeats, apart=settings.apart
                )
                if "absent" not in known:
                    kept.keep(place, key, known)
            timing = Timing(task, name, size, **known)
        found.append(timing)
        tick(f"{task} {name} {size}")
    return found


def _named(task: str, name: str) -> str:
    """Return the name of a method in the tables of its task."""
    if name == "Net":
        nets = [
            m.name
            for m in methods().values()
            if (m.task, m.net) == (task, net_tasks.get(task).default)
        ]
        return next(n for n in nets if n != "hybrid")
    return DEFAULT[task] if name.startswith("TNO") else name


def _choice(name: str) -> str:
    """Return the choice of the kernels; "" for the build that the run uses."""
    return kernels.NUMPY if name == "TNO, NumPy" else ""


def _absent(name: str, method: Method) -> str:
    """Return why a method is not timed, or ""."""
    if _choice(name) and not method.kernels:
        return "a closed form, which has no kernels"
    if _choice(name) and not kernels.compiled():
        return "the same as TNO, as there are no compiled kernels"
    return method.absent()


def _measured(
    task: str, method: str, model: str, size: int, repeats: int, *, apart: bool
) -> dict[str, Any]:
    asked = {"task": task, "method": method, "model": model, "size": size} | _limits(repeats)
    with kernels.chosen(_choice(method)):
        if not apart:
            return quietly(measure.main, **asked)
        command = [sys.executable, str(_SCRIPT), json.dumps(asked)]
        one = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **one})
    if done.returncode:
        return {"absent": f"failed: {(done.stderr.strip().splitlines() or ['no message'])[-1]}"}
    return json.loads(done.stdout.splitlines()[-1])


def _limits(repeats: int) -> dict[str, Any]:
    return {"repeats": repeats, "budget": _BUDGET}


def exponent(some: Iterable[Timing]) -> float | None:
    """Fit the exponent of the time as a power of the number of vertices, by least squares.

    Examples
    --------
    >>> round(exponent([Timing("", "", n, [1e-6 * n**3]) for n in (32, 64, 128)]), 6)
    1.5
    """
    known = [(t.size**2, t.median) for t in some if t.seconds and t.size >= _LEAST]
    if len(known) < 2:
        return None
    vertices, seconds = np.log(np.array(known)).T
    return float(np.polyfit(vertices, seconds, 1)[0])

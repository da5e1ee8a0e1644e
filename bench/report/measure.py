"""Time, memory and phases of one method at one size: a script that runs in its own process.

``python measure.py '{"task": "flatten", "method": "TNO", "size": 64, ...}'`` prints JSON.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from unittest.mock import patch

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import gso
from gso import linalg
from gso.dataset import bezier
from gso.solver import kernels, problem

#: Noise of the denoising task.
SIGMA = 0.005
#: Side of the largest grid of the first, untimed solve, which generates the kernels; on smaller
#: ones they would not be compiled.
_WARM = 64
#: Backends are timed if their estimated cost is at most this many times the smallest.
_HOPEFUL = 4.0


class Clock:
    """Time spent in functions, excluding timed functions that they call."""

    def __init__(self) -> None:
        self.spent: defaultdict[str, float] = defaultdict(float)
        self._inner = [0.0]

    def timed(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Wrap a function so that its time is added to `spent` under a name."""

        def run(*arguments: Any, **keywords: Any) -> Any:
            self._inner.append(0.0)
            start = time.perf_counter()
            try:
                return function(*arguments, **keywords)
            finally:
                whole = time.perf_counter() - start
                self.spent[name] += whole - self._inner.pop()
                self._inner[-1] += whole

        return run


class Factored:
    """A backend's solver that keeps the last matrix and counts factorisations."""

    def __init__(self, pattern: linalg.Pattern, solver: Any, clock: Clock):
        self.pattern, self.name, self.count = pattern, solver.name, 0
        self.values = np.empty(0)
        self._factor = clock.timed("factor", solver.factor)
        self.solve = clock.timed("solve", solver.solve)

    def factor(self, values: np.ndarray) -> None:
        """Factor a matrix."""
        self.count += 1
        self.values = values
        self._factor(values)


def peak_mb() -> float:
    """Return the peak memory of the process, MB."""
    status = Path("/proc/self/status")
    if status.exists():
        # The peak of getrusage includes that of the process that started this one.
        fields = dict(line.split(":", 1) for line in status.read_text().splitlines())
        return float(fields["VmHWM"].split()[0]) / 1e3
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    # In kilobytes, but on macOS in bytes.
    return peak / (1e6 if sys.platform == "darwin" else 1e3)


def case(task: str, size: int) -> np.ndarray:
    """Sample the surface that is used at all sizes; with noise for denoising."""
    points = bezier.generate(1, seed=77)[0].sample(size)
    if task == "denoise":
        points = points + SIGMA * np.random.default_rng(0).standard_normal(points.shape)
    return points


def solve(task: str, method: str, model: str, points: np.ndarray) -> Any:
    """Solve with a method; returns an array for nets, and a Result otherwise."""
    if method == "Net":
        return gso.net.predict(points, task=task, model=model)
    if method == "hybrid":
        return gso.hybrid.solve(points, task=task, net=model)
    return gso.tno.optimize(points, task=task)


def shares(run: Callable[[], Any]) -> dict[str, Any]:
    """Measure the share of each phase of a solve, and the time of its factorisations alone."""
    clock, stages = Clock(), list[Factored]()
    analysed = clock.timed("setup", linalg.choose)

    def chosen(pattern: linalg.Pattern, name: str | None = None) -> Factored:
        stages.append(Factored(pattern, analysed(pattern, name), clock))
        return stages[-1]

    with ExitStack() as stack:
        stack.enter_context(patch.object(linalg, "choose", chosen))
        for owner, name, phase in (
            (kernels.Kernel, "__call__", "evaluation"),
            (problem.Problem, "energy", "evaluation"),
            (problem.Problem, "linearise", "assembly"),
        ):
            function = clock.timed(phase, getattr(owner, name))
            stack.enter_context(patch.object(owner, name, function))
        start = time.perf_counter()
        result = run()
        total = time.perf_counter() - start
    spent = dict(clock.spent)
    # A net alone returns an array, and all of its time is the net's.
    known = {"net": total} if isinstance(result, np.ndarray) else result.seconds
    spent |= {name: known[name] for name in ("net", "pattern", "verdict") if name in known}
    spent["setup"] = total - sum(v for k, v in spent.items() if k != "setup")
    found = {"shares": {k: v / total for k, v in spent.items()}, "seconds": total}
    return found | limit(result, stages)


def limit(result: Any, stages: list[Factored]) -> dict[str, Any]:
    """Measure the seconds of one numeric factorisation per iteration, by the fastest backend."""
    history = getattr(result, "history", [])
    done = Counter(entry.stage for entry in history if entry.iteration > 0)
    iterations = [done[stage] for stage in sorted({entry.stage for entry in history})]
    found = {"limit": None, "factorisations": sum(stage.count for stage in stages)}
    if stages and len(iterations) == len(stages):
        used = [(n, *_fastest(stage)) for n, stage in zip(iterations, stages) if stage.count]
        found["limit"] = sum(n * seconds for n, seconds, _ in used)
        found["fastest"] = used[-1][2] if used else ""
    return found


def _fastest(stage: Factored) -> tuple[float, str]:
    """Return the seconds of one factorisation of a stage's last matrix, and the backend."""
    usable = {k: m for k, m in linalg.backends().items() if m.available()}
    least = min(m.cost(stage.pattern) for m in usable.values())
    found = []
    for name, module in usable.items():
        if module.cost(stage.pattern) > _HOPEFUL * least:
            continue
        solver = module.Solver(stage.pattern)
        with linalg.blas_threads(1):
            solver.factor(stage.values)
            spent: list[float] = []
            while len(spent) < 5 and sum(spent) < 2.0:
                start = time.perf_counter()
                solver.factor(stage.values)
                spent.append(time.perf_counter() - start)
        found.append((float(np.median(spent)), name))
    return min(found)


def main(
    task: str, method: str, model: str, size: int, repeats: int, budget: float
) -> dict[str, Any]:
    """Time up to `repeats` solves, at least two.

    A further solve begins only if it is expected to end within the budget of seconds. The shares
    are those of the last solve.
    """

    def run() -> Any:
        return solve(task, method, model, points)

    points = case(task, min(size, _WARM))
    run()
    points = case(task, size)
    seconds: list[float] = []
    while not seconds or (len(seconds) < repeats - 1 and sum(seconds) + seconds[-1] < budget):
        start = time.perf_counter()
        result = run()
        seconds.append(time.perf_counter() - start)
    found = {k: getattr(result, k, none) for k, none in (("iterations", 0), ("backend", ""))}
    found["peak_mb"] = peak_mb()
    last = shares(run)
    return found | last | {"seconds": [*seconds, last["seconds"]]}


if __name__ == "__main__":
    print(json.dumps(main(**json.loads(sys.argv[1]))))

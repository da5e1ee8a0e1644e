"""Many surfaces in one batch on tensors, compared with one after the other in processes."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from harness import energy, tabulate, timed

import gso
from gso.dataset import bezier
from gso.executors import ProcessExecutor, processors

#: Relative change of one axis by which the natural sensitivity of a solve is measured.
_STRETCH = 1e-6
#: Relative difference of energies above which a surface counts as another solution.
_OTHER = 0.01


def batches(n: int = 256, device: str = "cpu", seed: int = 31) -> dict[str, Any]:
    """Compare optimize_batch with optimize_many on n random surfaces of the dataset, 64 x 64."""
    designs = np.stack([s.sample(64) for s in bezier.generate(n, seed=seed)])
    stretched = designs * np.array([1.0 + _STRETCH, 1.0, 1.0])
    workers = processors()

    def many(task: str, points: np.ndarray) -> np.ndarray:
        every = gso.tno.optimize_many(points, task=task, workers=workers, verdict=False)
        found = {item.index: energy(item.result) for item in every}
        return np.array([found[k] for k in range(len(points))])

    def batch(task: str, points: np.ndarray) -> np.ndarray:
        return np.array([*map(energy, gso.tno.optimize_batch(points, task=task, device=device))])

    rows = {}
    for task in ("developable", "flatten"):
        # Kernels are printed and compiled at first use.
        many(task, designs[:2]), batch(task, designs[:2])
        (reference, usual), cpu = _measured(many, task, designs)
        (energies, seconds), cpu_batch = _measured(batch, task, designs)
        shaken = _off(many(task, stretched), reference)
        rows[task] = {
            "s, processes": usual,
            "s, batch": seconds,
            "ratio": seconds / usual,
            "of CPU time": cpu_batch / cpu,
            **_differences(energies, reference),
            "over 1 %": int((_off(energies, reference) > _OTHER).sum()),
            "over 1 %, stretched": int((shaken > _OTHER).sum()),
        }
    title = f"{n} surfaces 64 x 64: a batch on {device!r}, and {workers} processes; energies "
    return tabulate(title + "relative to the latter's", ["task"], rows)


def device(
    n: int = 1024, device: str = "cuda", workers: int = 0, compared: int = 32, seed: int = 31
) -> dict[str, Any]:
    """Time n surfaces of the dataset, 64 x 64, on a graphics processor, with workers that plan.

    The energies of some of them are compared with those of single solves on the processor.
    """
    designs = np.stack([s.sample(64) for s in bezier.generate(n, seed=seed)])
    rows = {}
    begun = time.perf_counter()
    with ProcessExecutor(2 * (workers or processors())) as ready:
        for task in ("developable", "flatten"):
            batch = partial(gso.tno.optimize_batch, task=task, device=device, executor=ready)
            # The workers import the package and print kernels at first use.
            begun = begun or time.perf_counter()
            batch(designs[: ready.workers])
            first, begun = time.perf_counter() - begun, 0.0
            found, seconds = timed(batch, designs)
            again, second = timed(batch, designs)
            single = [gso.tno.optimize(p, task=task, verdict=False) for p in designs[:compared]]
            rows[task] = {
                "first call, s": first,
                "ms a surface": 1e3 * min(seconds, second) / n,
                "of them set-up": _mean(again, "setup"),
                "evaluation": _mean(again, "evaluate"),
                "factorisation": _mean(again, "factor"),
                "line search": _mean(again, "search"),
                **_differences(*(np.array([*map(energy, x)]) for x in (found[:compared], single))),
            }
    title = (
        f"{n} surfaces 64 x 64 on {device!r}, planned by {workers or 'all'} processes; set-up is "
    )
    return tabulate(title + "that of the processes, which work at the same time", ["task"], rows)


def _mean(results: list[Any], phase: str) -> float:
    """Return the mean of a phase, ms."""
    return 1e3 * float(np.mean([r.seconds.get(phase, 0.0) for r in results]))


def _differences(energies: np.ndarray, reference: np.ndarray) -> dict[str, float]:
    off = 100.0 * _off(energies, reference)
    return {"median difference %": float(np.median(off)), "largest %": float(off.max())}


def _measured(function: Callable[..., Any], *given: Any) -> tuple[tuple[Any, float], float]:
    """Call a function; return its result with the seconds, and those of all processors.

    The latter depend less on what else the machine does.
    """

    def spent() -> float:
        who = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
        return sum(u.ru_utime + u.ru_stime for u in map(resource.getrusage, who))

    before = spent()
    return timed(function, *given), spent() - before


def _off(energies: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return relative differences; a design that is good already has no energy."""
    return np.abs(energies - reference) / np.where(reference > 0, reference, 1.0)


SECTIONS = (batches, device)

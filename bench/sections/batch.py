"""Many surfaces in one batch on tensors, compared with one after the other in processes."""

from __future__ import annotations

import resource
from collections.abc import Callable
from typing import Any

import numpy as np
from harness import table, timed

import gso
from gso.dataset import bezier
from gso.parallel import processors

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
        found = {
            item.index: item.result
            for item in gso.tno.optimize_many(points, task=task, workers=workers, verdict=False)
        }
        return _energies([found[k] for k in range(len(points))])

    def batch(task: str, points: np.ndarray) -> np.ndarray:
        return _energies(gso.tno.optimize_batch(points, task=task, device=device))

    out, rows = {}, []
    for task in ("developable", "flatten"):
        # Kernels are printed and compiled at first use.
        many(task, designs[:2]), batch(task, designs[:2])
        (reference, usual), cpu = _measured(many, task, designs)
        (energies, seconds), cpu_batch = _measured(batch, task, designs)
        shaken = many(task, stretched)
        off, natural = (_off(e, reference) for e in (energies, shaken))
        out[task] = {
            "s, processes": usual,
            "s, batch": seconds,
            "ratio": seconds / usual,
            "of CPU time": cpu_batch / cpu,
            "median difference %": 100.0 * float(np.median(off)),
            "largest %": 100.0 * float(off.max()),
            "over 1 %": int((off > _OTHER).sum()),
            "over 1 %, stretched": int((natural > _OTHER).sum()),
        }
        rows.append([task, *out[task].values()])
    table(
        f"{n} surfaces 64 x 64: a batch on {device!r}, and {workers} processes; energies "
        "relative to the latter's",
        ["task", *out["flatten"]],
        rows,
    )
    return out


def device(
    n: int = 1024, device: str = "cuda", workers: int = 0, compared: int = 32, seed: int = 31
) -> dict[str, Any]:
    """Time n surfaces of the dataset, 64 x 64, on a graphics processor, with workers that plan.

    The energies of some of them are compared with those of single solves on the processor.
    """
    designs = np.stack([s.sample(64) for s in bezier.generate(n, seed=seed)])
    out, rows = {}, []
    (ready, _), begun = timed(lambda: (gso.tno.BatchWorkers(workers or None), 0))
    with ready:
        for task in ("developable", "flatten"):

            def batch(points: np.ndarray, task: str = task) -> list[Any]:
                return gso.tno.optimize_batch(points, task=task, device=device, workers=ready)

            # The workers import the package and print kernels at first use.
            _, first = timed(batch, designs[: 2 * len(ready)])
            found, seconds = timed(batch, designs)
            again, second = timed(batch, designs)
            single = [gso.tno.optimize(p, task=task, verdict=False) for p in designs[:compared]]
            off = _off(_energies(found[:compared]), _energies(single))
            out[task] = {
                "first call, s": begun + first,
                "ms a surface": 1e3 * min(seconds, second) / n,
                "of them set-up": _mean(again, "setup"),
                "evaluation": _mean(again, "evaluate"),
                "factorisation": _mean(again, "factor"),
                "line search": _mean(again, "search"),
                "median difference %": 100.0 * float(np.median(off)),
                "largest %": 100.0 * float(off.max()),
            }
            rows.append([task, *out[task].values()])
            begun = 0.0
    table(
        f"{n} surfaces 64 x 64 on {device!r}, planned by {workers or 'all'} processes; set-up is "
        "that of the processes, which work at the same time",
        ["task", *out["flatten"]],
        rows,
    )
    return out


def _mean(results: list[Any], phase: str) -> float:
    """Return the mean of a phase, ms."""
    return 1e3 * float(np.mean([r.seconds.get(phase, 0.0) for r in results]))


def _measured(function: Callable[..., Any], *given: Any) -> tuple[tuple[Any, float], float]:
    """Call a function; return its result with the seconds, and those of all processors.

    The latter depend less on what else the machine does.
    """

    def spent() -> float:
        who = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
        return sum(u.ru_utime + u.ru_stime for u in map(resource.getrusage, who))

    before = spent()
    return timed(function, *given), spent() - before


def _energies(results: list[Any]) -> np.ndarray:
    return np.array([sum(result.energy.values()) for result in results])


def _off(energies: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return relative differences; a design that is good already has no energy."""
    return np.abs(energies - reference) / np.where(reference > 0, reference, 1.0)


SECTIONS = (batches, device)

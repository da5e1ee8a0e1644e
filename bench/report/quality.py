"""Quality and time of every method, surface by surface, in stored blocks."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from harness import quietly

from gso import metrics, tasks
from gso.dataset import LEVELS
from gso.executors import open_executor
from gso.linalg import blas_threads
from gso.mesh import Mesh
from gso.typing import Array
from report import kernels, store
from report.method import TASKS, Method, Solved, level_name
from report.methods import methods, of
from report.settings import Settings
from report.store import Store
from report.surfaces import Case, Surfaces

#: The record of a method on a surface: figures, seconds, iterations, or an error; seconds of
#: further runs as "again", and with NumPy kernels, where they were measured.
Record = dict[str, Any]
#: Records in the order of the surfaces, by task, level of the noise, and method.
Records = dict[tuple[str, float, str], list[Record]]
#: Callback with a method's name and the number of surfaces that are done.
Tick = Callable[[str, int], None]

#: Surfaces of a timed block by the method's pace, and of a block that is not timed.
_BLOCKS, _UNTIMED = {"fast": 16, "slow": 4, "peer": 2}, 64


@dataclass(frozen=True)
class Block:
    """Some surfaces for one method; `numpy` says that they are solved with NumPy kernels.

    They are timed in so many runs, one after the other.
    """

    task: str
    name: str
    sigma: float
    surfaces: Surfaces
    start: int
    stop: int
    timed: bool
    numpy: bool = False
    runs: int = 1

    @property
    def method(self) -> Method:
        """The method."""
        return of(self.task, self.name)

    @property
    def choice(self) -> str:
        """Choice of the kernels; "" for the build that the run uses."""
        return kernels.NUMPY if self.numpy else ""

    @property
    def place(self) -> str:
        """Name of its file in the store."""
        words = f"{self.name} {level_name(self.sigma)} {self.choice}".split()
        name = "-".join(words).replace(",", "")
        return f"quality/{self.task}/{name}/{self.start:04d}-{self.stop:04d}"

    @property
    def key(self) -> dict[str, Any]:
        """Everything that its records depend on."""
        known = self.method.key(self.sigma) | {"surfaces": self.surfaces.key}
        if self.method.kernels:
            known["kernels"] = kernels.key(self.choice)
        return known | {"processor": store.processor() if self.timed else "", "runs": self.runs}


def levels(task: str) -> tuple[float, ...]:
    """Return the levels of the noise of a task: (0.0,), except for denoising."""
    return LEVELS if task == "denoise" else (0.0,)


def blocks(settings: Settings, surfaces: Surfaces) -> Iterator[Block]:
    """Yield everything that is to be measured."""
    for method in sorted(methods().values(), key=lambda m: TASKS.index(m.task)):
        if method.absent():
            continue
        count = min(settings.counts[method.pace], len(surfaces))
        count = min(count, settings.peers) if method.peer else count
        timed, size = min(settings.timed, count), _BLOCKS[method.pace]
        both = method.kernels and kernels.compiled()
        again = min(settings.numpy.get(method.pace, 0) if both else 0, timed)
        for sigma in levels(method.task):
            whole = partial(Block, method.task, method.name, sigma, surfaces)
            runs = settings.runs if method.pace == "fast" else 1
            for begin, end, step, kind in (
                (0, timed, size, (True, False, runs)),
                (0, again, size, (True, True)),
                (timed, count, _UNTIMED, (False,)),
            ):
                for start in range(begin, end, step):
                    yield whole(start, min(start + step, end), *kind)


def measured(settings: Settings, surfaces: Surfaces, kept: Store, tick: Tick) -> Records:
    """Measure every method; records that are already stored are not measured again.

    Timed blocks run first, in one process with no other work; the rest runs in all worker
    processes.
    """
    every = list(blocks(settings, surfaces))
    found: dict[Block, list[Record]] = {}
    for block in every:
        there = kept.find(block.place, block.key)
        if there is not None:
            found[block] = there
            tick(block.name, len(there))
    for timed, workers in ((True, min(settings.workers, 1)), (False, settings.workers)):
        missing = [b for b in every if b not in found and b.timed is timed]
        with open_executor(workers, main=True) as executor:
            for done in executor.as_completed(measure, missing):
                block = missing[done.index]
                if done.error is None:
                    kept.keep(block.place, block.key, done.result)
                    found[block] = done.result
                else:
                    found[block] = [{"error": done.error}] * (block.stop - block.start)
                tick(block.name, block.stop - block.start)
    return _joined(found, every)


def _joined(found: dict[Block, list[Record]], every: list[Block]) -> Records:
    """Return the records by method; "seconds_numpy" is the time of a surface with NumPy kernels."""
    records: Records = {}
    for block in every:
        if not block.numpy:
            records.setdefault((block.task, block.sigma, block.name), []).extend(found[block])
    for block in (b for b in every if b.numpy):
        given = records[block.task, block.sigma, block.name]
        for k, again in enumerate(found[block], block.start):
            given[k] = given[k] | {"seconds_numpy": again.get("seconds")}
    return records


_warm: set[tuple[str, str, bool]] = set()


def measure(block: Block) -> list[Record]:
    """Measure the surfaces of a block."""
    method, cases = block.method, partial(block.surfaces.case, sigma=block.sigma)
    with blas_threads(1), kernels.chosen(block.choice):
        if block.timed and (block.task, block.name, block.numpy) not in _warm:
            _prepare(method, cases(block.start), block.numpy)
            _warm.add((block.task, block.name, block.numpy))
        found = [_record(method, cases(k)) for k in range(block.start, block.stop)]
        for _ in range(block.runs - 1):
            for k, record in enumerate(found, block.start):
                if "error" not in record:
                    record["again"] = [*record.get("again", ()), _solved(method, cases(k))[1]]
    return found if block.timed else [record | {"seconds": None} for record in found]


def _prepare(method: Method, case: Case, numpy: bool) -> None:
    """Solve untimed for the work of the first use: imports, kernels, a net's weights."""
    _record(method, case if method.pace == "fast" else case.small)
    if method.pace != "fast" and method.kernels and not numpy:
        # Of the small case the kernels are not compiled, unless that is chosen.
        with kernels.chosen(kernels.NUMBA if kernels.compiled() else ""):
            _record(method, case.small)


def _record(method: Method, case: Case) -> Record:
    try:
        solved, seconds = _solved(method, case)
    except Exception as error:  # a peer may raise anything; the others still run
        return {"error": f"{type(error).__name__}: {error}"}
    if not np.isfinite(solved.points).all():
        return {"error": "the result is not finite"}
    return {
        "figures": figures(method.task, case, solved.points) | solved.more(),
        "seconds": seconds,
        "iterations": solved.iterations,
    }


def _solved(method: Method, case: Case) -> tuple[Solved, float]:
    """Solve a case; return the result and the seconds."""
    if method.peer:
        case.mesh  # noqa: B018 - before the clock starts
    clock = time.perf_counter()
    solved = quietly(method, case)
    return solved, time.perf_counter() - clock


def figures(task: str, case: Case, result: Array) -> dict[str, float]:
    """Return the metrics of a result: those of its task, as named in :data:`gso.metrics.INFO`.

    Further ones: "unflipped" is 1 where no cell is flipped; "rate" is the decrease of the angle of
    the normals in percent of "theta_noisy"; "off" is the root mean square distance of the vertices
    from those without noise, in percent of the diagonal.
    """
    if task == "denoise":
        noisy, theta = (metrics.normal_angle(case.surface, x) for x in (case.given, result))
        rate, off = 100.0 * (noisy - theta) / noisy, metrics.displacement(case.surface, result)[0]
        return {"theta": theta, "theta_noisy": noisy, "rate": rate, "off": off}
    mesh = Mesh.from_grid(case.surface, weld=False)
    module, scale = tasks.get(task), metrics.unit(mesh)
    if task == "flatten":
        found = module.metrics(mesh, None, result.reshape(-1, 2), scale)
        return found | {"unflipped": float(found["flipped_cells"] == 0)}
    return module.metrics(mesh, mesh.replaced(result.reshape(-1, 3)), None, scale)

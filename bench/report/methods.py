"""The package's own methods, and the registry of all methods by task and name."""

from __future__ import annotations

import importlib
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import gso
from gso import hybrid
from gso.net import tasks as net_tasks
from gso.parametrization import rectangle
from report.method import TASKS, Method, Solved
from report.surfaces import Case

_HERE = (Path(__file__),)
_PEERS = ("peers_flatten", "peers_developable", "peers_denoise")
#: Tasks that the optimiser solves with kernels; denoising is in closed form.
KERNELS = ("developable", "flatten")
#: The method of each task that the others are compared with.
DEFAULT = {"developable": "TNO balanced", "flatten": "TNO strain", "denoise": "TNO"}


def _solved(result: gso.Result) -> Solved:
    grid = result.flat_grid if result.task == "flatten" else result.grid
    if grid is None:
        raise gso.MeshError("the result is no grid")
    return Solved(grid, result.iterations)


def _tno(task: str, case: Case, **options: Any) -> Solved:
    return _solved(gso.tno.optimize(case.given, task=task, verdict=False, **options))


def _net(task: str, case: Case, model: str) -> Solved:
    return Solved(gso.net.predict(case.given, task=task, model=model, device="cpu"))


def _hybrid(task: str, case: Case, model: str) -> Solved:
    result = hybrid.solve(case.given, task=task, net=model)
    return replace(_solved(result), more=lambda: {"warm": float(result.warm_start == "net")})


def _init(case: Case) -> Solved:
    return Solved(rectangle(case.given))


def _own() -> list[Method]:
    def tno(name: str, task: str, pace: str = "fast", note: str = "", **options: Any) -> Method:
        run = partial(_tno, task, **options)
        used = task in KERNELS
        return Method(name, task, run, pace=pace, note=note, files=_HERE, kernels=used)

    def net(name: str, task: str, model: str, note: str = "") -> Method:
        return Method(name, task, partial(_net, task), net=model, note=note, files=_HERE)

    found = [
        tno("TNO jiang2020", "developable", "slow", "joint isometry", options="jiang2020"),
        tno("TNO fast", "developable", options="fast"),
        tno("TNO balanced", "developable", note="the default"),
        tno("TNO accurate", "developable", "slow", options="accurate"),
        net("Net-S", "developable", "net-s"),
        net("Net-C", "developable", "net-c"),
        net("Net-CF", "developable", "net-cf"),
        net("Net", "developable", "developable", "the default net"),
        Method("Init", "flatten", _init, note="the rectangle nets start from", files=_HERE),
        tno("TNO jiang2020", "flatten", note="isometry of the faces", options="jiang2020"),
        tno("TNO lengths", "flatten", note="the published figure", formulation="lengths"),
        tno("TNO strain", "flatten", note="the default"),
        net("Net", "flatten", "flatten"),
        net("Net-W", "flatten", "flatten-w"),
        net("Net strain", "flatten", "flatten-strain", "the default net"),
        tno("TNO", "denoise", note="is told nothing of the noise"),
        net("Net", "denoise", "denoise", "the default net; estimates the noise"),
    ]
    for task in TASKS:
        kind = net_tasks.get(task)
        found.append(
            Method(
                "hybrid",
                task,
                partial(_hybrid, task),
                net=kind.default,
                note="the default net, then the optimiser",
                kernels=task in KERNELS,
                refused="" if kind.warm_start else "a closed form has no start to improve",
                files=_HERE,
            )
        )
    return found


@cache
def methods() -> dict[tuple[str, str], Method]:
    """Return every method by task and name."""
    every = _own()
    for module in _PEERS:
        every += importlib.import_module(f"report.{module}").METHODS
    return {(method.task, method.name): method for method in every}


def of(task: str, name: str) -> Method:
    """Return a method."""
    return methods()[task, name]

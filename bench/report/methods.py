"""The package's own methods, and the registry of all methods by task and name."""

from __future__ import annotations

import importlib
from dataclasses import replace
from functools import cache
from typing import Any

import gso
from gso.net import tasks as net_tasks
from gso.parametrization import rectangle
from report.method import TASKS, Method, Solved
from report.surfaces import Case

_PEERS = (
    "peers_flatten",
    "peers_developable",
    "peers_thinning",
    "peers_denoise",
    "peers_bilateral",
)
#: Tasks that the optimiser solves with kernels; denoising is in closed form.
KERNELS = ("developable", "flatten")
#: The method of each task that the others are compared with.
DEFAULT = {"developable": "TNO balanced", "flatten": "TNO strain", "denoise": "TNO"}


def _solved(result: gso.Result) -> Solved:
    grid = result.flat_grid if result.task == "flatten" else result.grid
    if grid is None:
        raise gso.MeshError("the result is no grid")
    return Solved(grid, result.iterations)


def _tno(name: str, task: str, note: str = "", pace: str = "fast", **options: Any) -> Method:
    def run(case: Case) -> Solved:
        return _solved(gso.tno.optimize(case.given, task=task, verdict=False, **options))

    return Method(name, task, run, pace=pace, note=note, kernels=task in KERNELS)


def _net(name: str, task: str, model: str, note: str = "") -> Method:
    def run(case: Case, model: str) -> Solved:
        return Solved(gso.net.predict(case.given, task=task, model=model, device="cpu"))

    return Method(name, task, run, net=model, note=note)


def _hybrid(task: str) -> Method:
    def run(case: Case, model: str) -> Solved:
        result = gso.hybrid.solve(case.given, task=task, net=model, verdict=False)
        return replace(_solved(result), more=lambda: {"warm": float(result.warm_start == "net")})

    kind, note = net_tasks.get(task), "the net for warm starts, then the optimiser"
    refused = "" if kind.start else "a closed form has no start to improve"
    kernels, net = task in KERNELS, kind.start or kind.default
    return Method("hybrid", task, run, net=net, note=note, kernels=kernels, refused=refused)


def _init(case: Case) -> Solved:
    return Solved(rectangle(case.given))


METHODS = [
    _tno("TNO jiang2020", "developable", "joint isometry", "slow", options="jiang2020"),
    _tno("TNO fast", "developable", options="fast"),
    _tno("TNO balanced", "developable", "the default"),
    _tno("TNO accurate", "developable", pace="slow", options="accurate"),
    _net("Net-S", "developable", "net-s"),
    _net("Net-C", "developable", "net-c"),
    _net("Net-CF", "developable", "net-cf"),
    _net("Net", "developable", "developable", "the default net"),
    Method("Init", "flatten", _init, note="the rectangle nets start from"),
    _tno("TNO jiang2020", "flatten", "isometry of the faces", options="jiang2020"),
    _tno("TNO lengths", "flatten", "the published figure", formulation="lengths"),
    _tno("TNO strain", "flatten", "the default"),
    _net("Net", "flatten", "flatten"),
    _net("Net-W", "flatten", "flatten-w"),
    _net("Net strain", "flatten", "flatten-strain", "the default net"),
    _tno("TNO", "denoise", "is told nothing of the noise"),
    _net("Net", "denoise", "denoise", "the default net; estimates the noise"),
    *map(_hybrid, TASKS),
]


@cache
def methods() -> dict[tuple[str, str], Method]:
    """Return every method by task and name."""
    every = [*METHODS]
    for module in _PEERS:
        every += importlib.import_module(f"report.{module}").METHODS
    return {(method.task, method.name): method for method in every}


def of(task: str, name: str) -> Method:
    """Return a method."""
    return methods()[task, name]

"""Predictions of nets as warm starts for the optimiser, or the reasons why there are none."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from gso import metrics
from gso.dataset.screen import CURVED
from gso.errors import MeshError, WeightsError
from gso.mesh import Mesh
from gso.net import tasks
from gso.net.catalogue import NetLike, chain, in_turn, missing_packages
from gso.tasks.developable import Options
from gso.typing import Array

#: Least side of a grid for which a net is used; other meshes need the square of it in vertices.
_SMALLEST = 8


@dataclass(frozen=True)
class Prediction:
    """A net's result for one design.

    Attributes
    ----------
    points : ndarray or None
        Vertices (n, 3) or their flat image (n, 2), in the design's numbering, unit and frame.
    seconds : float
        Time spent, with or without points; in a batch, each design's share.
    net : str
        Name of the net.
    refused : str
        Why there are no points; also empty where no net was to be used.
    """

    points: Array | None = None
    seconds: float = 0.0
    net: str = ""
    refused: str = ""


def predictions(
    designs: Sequence[Mesh],
    task: str,
    net: NetLike | None = None,
    *,
    polish: bool | int = True,
) -> list[Prediction]:
    """Apply a net to designs, in one batch for each size of grid.

    Parameters
    ----------
    designs : sequence of Mesh
    task : str
        A task of :func:`gso.tno.optimize`.
    net : str, path or Net, optional
        As `model` in :func:`gso.net.predict`. When not given, it is the task's net for warm
        starts if a whole solve follows, and otherwise the task's default.
    polish : bool or int
        As for :func:`gso.hybrid.solve`; with False the predictions are the final results.

    Raises
    ------
    OptionError
        The net is for another task.
    WeightsError
        The net that is named does not exist, or its file is damaged.
    """
    for one in in_turn(net) if task in tasks.names() else ():
        if isinstance(one, str | Path):
            chain(one, task)
    alone = polish is False
    why = _missing(task, net, polish)
    if why:
        return [Prediction(refused=why)] * len(designs)
    net = _own(task, polish) if net is None else net
    name = _name(net)
    found: list[Prediction] = [Prediction()] * len(designs)
    sizes: dict[tuple[int, ...], list[tuple[int, Array]]] = {}
    for k, design in enumerate(designs):
        clock = time.perf_counter()
        try:
            _check_size(design, task)
            if design.grid is not None:
                if not alone:
                    _check_curvature(design.grid)
                sizes.setdefault(design.grid.shape, []).append((k, design.grid))
            elif not alone:
                raise MeshError("on meshes that are not grids, nets were not found to help")
            else:
                found[k] = Prediction(_of_mesh(design, task, net), net=name)
        except MeshError as error:
            found[k] = Prediction(net=name, refused=str(error))
        found[k] = replace(found[k], seconds=time.perf_counter() - clock)
    for group in sizes.values():
        clock = time.perf_counter()
        moved = _predicted(np.stack([grid for _, grid in group]), task, net, alone)
        share = (time.perf_counter() - clock) / len(group)
        for (k, _), values in zip(group, moved, strict=True):
            clock = time.perf_counter()
            points, refused = None, ""
            if isinstance(values, str):
                refused = values
            else:
                points = np.empty((len(designs[k].vertices), values.shape[-1]))
                points[designs[k].grid_index] = values
            seconds = found[k].seconds + share + time.perf_counter() - clock
            found[k] = Prediction(points, seconds, name, refused)
    return found


def _missing(task: str, net: NetLike | None, polish: bool | int) -> str:
    """Say why no net can be used, whatever the design; empty if one can."""
    if task not in tasks.names() or not (polish is False or tasks.get(task).start):
        return f"no net makes a start for task {task!r}"
    if why := missing_packages(net):
        return why
    if net is None:
        try:
            chain(_own(task, polish), task)
        except WeightsError:
            return f"no net for task {task!r} comes with this version"
    return ""


def _own(task: str, polish: bool | int) -> str:
    """Return the name of the task's net that is used unless another is named."""
    known = tasks.get(task)
    return known.start if polish is True else known.default


def _name(net: NetLike) -> str:
    several = in_turn(net)
    return ", ".join(type(one).__name__ if hasattr(one, "task") else str(one) for one in several)


def _check_size(design: Mesh, task: str) -> None:
    """Refuse designs that are too small for a net."""
    if design.grid is not None:
        height, width = design.grid.shape[:2]
        if min(height, width) < _SMALLEST:
            raise MeshError(f"a grid {height} x {width} is solved faster than a net sees it")
        return
    count = int(design.used.sum())
    if count < _SMALLEST**2 and not tasks.get(task).noisy:
        raise MeshError(f"a mesh of {count} vertices is solved faster than a net sees it")


def _check_curvature(grid: Array) -> None:
    """Refuse surfaces that are developable, or far more curved than the training data."""
    curved = metrics.loss_gc(grid)
    if curved <= Options().developable_below:
        raise MeshError("the design is developable as it is")
    if curved > CURVED:
        raise MeshError(
            f"mean |K| in the unit ball is {curved:.3g}, and above {CURVED:.2g} is too far from "
            "what nets are taught"
        )


def _of_mesh(design: Mesh, task: str, net: NetLike) -> Array:
    """Return a net's result at the vertices of a mesh that is no grid."""
    from gso.net import predict

    moved = predict(design, task=task, model=net).vertices
    return moved[:, : tasks.get(task).components]


def _predicted(grids: Array, task: str, net: NetLike, alone: bool) -> Sequence[Array | str]:
    """Return the result (H, W, d), or the error message, for each grid."""
    from gso.net import predict

    try:
        # Where a solve follows, its energy decides whether the result is used.
        return list(predict(grids, task=task, model=net, guarded=alone))
    except MeshError as error:
        if len(grids) == 1:
            return [str(error)]
        return [_predicted(grid[None], task, net, alone)[0] for grid in grids]

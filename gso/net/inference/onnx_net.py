"""Exported nets, which ONNX Runtime applies without PyTorch."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
from scipy.special import expit

from gso import geometry
from gso.errors import OptionError, WeightsError
from gso.hierarchy import resample
from gso.net import tasks
from gso.net.catalogue import SIZE, modified, verified
from gso.parametrization import rectangle
from gso.typing import Array, Json
from gso.unknowns.spline import spline_matrix

#: ONNX Runtime's names of what computes, by names of devices.
_PROVIDERS = {"cpu": "CPUExecutionProvider", "cuda": "CUDAExecutionProvider"}


class OnnxNet:
    """An exported net; see :class:`gso.net.inference.applied_net.AppliedNet`.

    Parameters
    ----------
    path : Path
        The .onnx file, for messages.
    card : dict
        Its card.
    session : onnxruntime.InferenceSession
        The loaded net.
    """

    def __init__(self, path: Path, card: Json, session: Any):
        self.path, self._session = path, session
        self.task, self.passes = str(card["task"]), int(card["onnx"]["passes"])
        self.told = "sigma" in card["onnx"]["inputs"]
        self._flat, self._outputs = tasks.get(self.task).flat, list(card["onnx"]["outputs"])

    def start(self, unit: Array) -> Array:
        if not self._flat:
            return unit
        flat = np.stack([rectangle(grid) for grid in unit])
        return np.asarray(flat - flat.mean(axis=(1, 2), keepdims=True))

    def displacements(self, seen: Array, unit: Array, noise: Array | None, passes: int) -> Array:
        if passes != self.passes:
            raise OptionError(
                f"{self.path} was exported with {self.passes} passes, not {passes}; "
                f"export it with passes={passes}"
            )
        given = {"surface": seen} if noise is None else {"surface": seen, "sigma": noise}
        feed = {name: np.asarray(values, np.float32) for name, values in given.items()}
        if seen.shape == unit.shape or "coarse" not in self._outputs:
            (moved,) = self._session.run(["displacements"], feed)
            return np.stack([resample(v, *unit.shape[1:3]) for v in moved.astype(np.float64)])
        names = [name for name in self._outputs if name != "displacements"]
        fields = [f.astype(np.float64) for f in self._session.run(names, feed)]
        first, second, *trust = (_evaluated(field, *unit.shape[1:3]) for field in fields)
        moved = (first + second) * expit(trust[0]) if trust else first + second
        parts = tuple(np.moveaxis(moved, 1, 0))
        if not self._flat:
            parts = geometry.GridFrame.of(tuple(np.moveaxis(unit, -1, 0))).vectors(*parts)
        return np.stack(parts, axis=-1)


def _evaluated(coefficients: Array, height: int, width: int) -> Array:
    """Evaluate clamped bicubic splines, coefficients (B, d, n, m), as (B, d, height, width)."""
    n, m = coefficients.shape[-2:]
    along, across = (spline_matrix(*size).toarray() for size in ((height, n), (width, m)))
    return np.asarray(along @ coefficients @ across.T)


def onnx_net(path: Path, device: str | None) -> OnnxNet:
    """Load an exported net with its card; it is kept until the file changes.

    Parameters
    ----------
    path : Path
        The .onnx file.
    device : str, optional
        "cpu" or "cuda"; by default the GPU if the installed ONNX Runtime can use it.

    Raises
    ------
    OptionError
        There is no such device.
    WeightsError
        The file or its card is missing or damaged, or they do not belong together.
    """
    return _cached(path, device, modified(path))


@lru_cache(maxsize=16)
def _cached(path: Path, device: str | None, stamp: int) -> OnnxNet:
    there = onnxruntime.get_available_providers()
    wanted = [_PROVIDERS.get(str(device))] if device else [*reversed(_PROVIDERS.values())]
    providers = [name for name in wanted if name in there]
    if not providers:
        raise OptionError(f"ONNX Runtime has no device {device!r} here; take 'cpu'")
    card, data = verified(path)
    settings = onnxruntime.SessionOptions()
    # Its warnings on the optimisation of graphs help nobody.
    settings.log_severity_level = 3
    # ONNX Runtime does not read the variable that sets the threads of PyTorch and NumPy.
    if os.environ.get("OMP_NUM_THREADS", "").isdigit():
        settings.intra_op_num_threads = int(os.environ["OMP_NUM_THREADS"])
    try:
        session = onnxruntime.InferenceSession(data, settings, providers=providers)
        net = OnnxNet(path, card, session)
        fits = [i.name for i in session.get_inputs()] == card["onnx"]["inputs"]
        fits &= [o.name for o in session.get_outputs()] == card["onnx"]["outputs"]
        fits &= session.get_inputs()[0].shape[1:] == [SIZE, SIZE, 3]
    # ONNX Runtime's errors have no class in common but Exception.
    except Exception as error:
        raise WeightsError(f"{path} holds no exported net of this package: {error}") from None
    if not fits:
        raise WeightsError(f"{path} has other inputs and outputs than its card says")
    return net

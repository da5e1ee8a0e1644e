"""Training curves: a file of JSON lines, and TensorBoard events if it is installed."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from gso.io.atomic import write_bytes

NAME = "curves.jsonl"


class Curves:
    """Writer of values by step.

    Parameters
    ----------
    folder : Path
        Folder for ``curves.jsonl``, and for event files if ``tensorboard`` is installed.
    step : int
        Step at which the run is resumed: entries of later steps are dropped.
    """

    def __init__(self, folder: Path, step: int = 0):
        self.path = folder / NAME
        kept = [row for row in read(folder) if row["step"] <= step]
        self._known = {_what(row) for row in kept if row["step"] == step}
        write_bytes(self.path, "".join(json.dumps(row) + "\n" for row in kept).encode())
        self._writer: Any = None
        if find_spec("tensorboard") is not None:
            from torch.utils.tensorboard import SummaryWriter

            self._writer = SummaryWriter(str(folder), purge_step=step + 1)

    def add(self, step: int, seconds: float, **values: float) -> None:
        """Write values of a step at `seconds` into the run, unless they are already written."""
        row = {"step": step, "seconds": round(seconds, 3), **values}
        if _what(row) in self._known:
            return
        with self.path.open("a") as file:
            file.write(json.dumps(row) + "\n")
        if self._writer is not None:
            for name, value in values.items():
                self._writer.add_scalar(name, value, step)

    def close(self) -> None:
        """Close the event files."""
        if self._writer is not None:
            self._writer.close()


class Means:
    """Means of values over the steps since they were last taken.

    >>> means = Means()
    >>> means.add(loss=torch.tensor(1.0))
    >>> means.add(loss=torch.tensor(2.0), fair=torch.tensor(5.0))
    >>> means.taken(), means.taken()
    ({'loss': 1.5, 'fair': 5.0}, {})
    """

    def __init__(self) -> None:
        self._values: dict[str, list[Tensor]] = {}

    def add(self, **values: Tensor) -> None:
        """Add the values of a step; each is averaged over the steps that have it."""
        for name, value in values.items():
            self._values.setdefault(name, []).append(value)

    def taken(self) -> dict[str, float]:
        """Return the means, and begin anew."""
        means = {name: float(torch.stack(each).mean()) for name, each in self._values.items()}
        self._values.clear()
        return means


def _what(row: dict[str, float]) -> tuple[float, frozenset[str]]:
    return row["step"], frozenset(row)


def read(folder: Path) -> list[dict[str, float]]:
    """Read the rows of a run; lines that are not valid JSON (cut off) are left out."""
    rows = []
    try:
        lines = (folder / NAME).read_text().splitlines()
    except OSError:
        return []
    for line in lines:
        try:
            rows.append(json.loads(line))
        except ValueError:
            continue
    return rows

"""What a method is: a name, a function, and what its results depend on."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gso.net import catalogue
from report import store
from report.surfaces import Case

Array = NDArray[np.float64]

TASKS = ("developable", "flatten", "denoise")
#: Parameters of the peers by task, method and level of noise; made by ``--tune``.
TUNED = Path(__file__).with_name("tuned.json")

#: What makes the inputs and measures the results.
_MEASURED = tuple(Path(__file__).with_name(name) for name in ("quality.py", "surfaces.py"))
_CORE = ("numpy", "scipy", "casadi", "libigl", "cvxopt", "pypardiso")


@dataclass(frozen=True)
class Solved:
    """A result: a surface (H, W, 3) or a flat image (H, W, 2).

    `more` gives figures that the method itself knows, such as what is left of an objective; it is
    called when the clock has stopped.
    """

    points: Array
    iterations: int | None = None
    more: Callable[[], dict[str, float]] = dict


@dataclass(frozen=True)
class Method:
    """A method of the package, or a peer.

    Attributes
    ----------
    name : str
        What it is called in the report; unique in its task.
    task : str
        What it does.
    run : callable
        ``run(case, **parameters)`` returns a :class:`Solved`.
    peer : bool
        It is not the package's.
    pace : {"fast", "slow", "peer"}
        How many surfaces it gets: all, some, few.
    note : str
        What the reader must know: what it is told, what it minimises.
    needs : tuple of str
        Packages that must be installed, beside the package's own.
    net : str
        Net that it uses.
    candidates : tuple of dict
        Parameters of which the best are taken, for each level of the noise, on surfaces that
        nothing is reported of.
    files : tuple of Path
        Files that a peer is written in.
    solver : bool
        It is a peer, but its results depend on the package's solver all the same.
    refused : str
        Why there is no such thing.
    """

    name: str
    task: str
    run: Callable[..., Solved]
    peer: bool = False
    pace: str = "fast"
    note: str = ""
    needs: tuple[str, ...] = ()
    net: str = ""
    candidates: tuple[dict[str, Any], ...] = ()
    files: tuple[Path, ...] = ()
    solver: bool = False
    refused: str = ""

    def __call__(self, case: Case) -> Solved:
        """Solve a case."""
        return self.run(case, **self.parameters(case.sigma))

    def parameters(self, sigma: float) -> dict[str, Any]:
        """The parameters that were found best, and the net."""
        found = {"model": self.net} if self.net else {}
        if self.candidates:
            found |= self._tuned()[level_name(sigma)] or {}
        return found

    def _tuned(self) -> dict[str, Any]:
        return tuned().get(self.task, {}).get(self.name, {})

    def absent(self) -> str:
        """Why it cannot run, or nothing."""
        if self.refused or self.missing():
            return self.refused or f"not installed: pip install {' '.join(self.missing())}"
        if self.net and self.net not in shipped():
            return "no weights shipped"
        if self.candidates and not self._tuned():
            return "not tuned: python bench/run_all.py --tune"
        if self.candidates and not all(self._tuned().values()):
            return f"with none of {len(self.candidates)} settings better than its input"
        return ""

    def missing(self) -> list[str]:
        """Packages that it needs and that are not installed."""
        return [name for name, found in store.installed(self.needs).items() if not found]

    def key(self, sigma: float) -> dict[str, Any]:
        """What its results depend on."""
        key = {
            "method": self.name,
            "sigma": sigma,
            "parameters": self.parameters(sigma),
            "packages": store.installed((*_CORE, *self.needs)),
            "measures": store.measures() if self.peer and not self.solver else store.solver(),
            "files": store.source(*self.files, *_MEASURED),
        }
        if self.net:
            needs = store.installed(("torch", "safetensors"))
            key |= {"net": _weights(self.net), "code": store.nets(), "needs": needs}
        return key


def level_name(sigma: float) -> str:
    """A level of the noise, as keys of JSON name it.

    >>> level_name(0.005), level_name(0.0)
    ('0.005', '')
    """
    return f"{sigma:.3f}" if sigma else ""


@lru_cache(maxsize=1)
def tuned() -> dict[str, Any]:
    """The parameters that were found best; none where the input was better."""
    return json.loads(TUNED.read_text())["values"] if TUNED.exists() else {}


def shipped() -> list[str]:
    """Nets that come with the package; none where torch is not installed."""
    return catalogue.available() if all(store.installed(("torch", "safetensors")).values()) else []


def _weights(name: str) -> list[str]:
    """Checksums of a net's files."""
    parts = catalogue.CHAINS.get(name, (name,))
    return [catalogue.read_card(catalogue.located(part))["sha256"] for part in parts]

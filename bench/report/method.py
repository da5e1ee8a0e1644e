"""Methods that are compared: a name, a function, and everything that the results depend on."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from pathlib import Path
from typing import Any

from gso.net import catalogue
from gso.typing import Array
from report import store
from report.surfaces import Case

TASKS = ("developable", "flatten", "denoise")
#: Parameters of the peers by task, method and level of noise; made by ``--tune``.
TUNED = Path(__file__).with_name("tuned.json")

#: Parts of the package that the metrics of a peer's result depend on.
_MEASURES = ("geometry", "mesh", "metrics", "tasks")
#: Files that define the inputs and the metrics of the results.
_MEASURED = tuple(Path(__file__).with_name(name) for name in ("quality.py", "surfaces.py"))
_CORE = ("numpy", "scipy", "casadi", "libigl", "cvxopt", "pypardiso")
_TORCH = ("torch", "safetensors")


@dataclass(frozen=True)
class Solved:
    """A result: a surface (H, W, 3) or a flat image (H, W, 2).

    `more` returns further figures of the method, such as the remaining objective; it is called
    outside the timing.
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
        Name in the report; unique in its task.
    task : str
        Task that it solves.
    run : callable
        ``run(case, **parameters)`` returns a :class:`Solved`.
    peer : bool
        Whether it is not a method of this package.
    pace : {"fast", "slow", "peer"}
        How many surfaces it gets: all, some, few.
    note : str
        Note for the reader: its inputs, the energy that it minimises.
    needs : tuple of str
        Packages that must be installed, in addition to those that gso needs.
    net : str
        Net that it uses.
    candidates : tuple of dict
        Parameters from which the best are chosen, for each level of the noise, on surfaces that
        are not part of the report.
    solver : bool
        Whether the results of a peer depend on the package's solver.
    kernels : bool
        Whether the solver's kernels do much of the work, so that compiled ones change the time.
    refused : str
        Why the method does not exist for its task, or "".
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
    solver: bool = False
    kernels: bool = False
    refused: str = ""

    def __call__(self, case: Case) -> Solved:
        """Solve a case."""
        return self.run(case, **self.parameters(case.sigma))

    def parameters(self, sigma: float) -> dict[str, Any]:
        """Return the tuned parameters, and the net."""
        found = {"model": self.net} if self.net else {}
        if self.candidates:
            found |= self._tuned()[level_name(sigma)] or {}
        return found

    def _tuned(self) -> dict[str, Any]:
        return tuned().get(self.task, {}).get(self.name, {})

    def absent(self) -> str:
        """Return why it cannot run, or ""."""
        if self.refused or self.missing():
            return self.refused or f"not installed: pip install {' '.join(self.missing())}"
        if self.net and self.net not in shipped():
            return "no weights shipped"
        if self.candidates and not self._tuned():
            return "not tuned: python bench/run_all.py --tune"
        if self.candidates and not all(self._tuned().values()):
            return f"with none of {len(self.candidates)} settings better than its input"
        return ""

    @property
    def files(self) -> tuple[Path, ...]:
        """Source files: that of the function, and the objective for other solvers."""
        file = Path(getattr(self.run, "func", self.run).__code__.co_filename)
        return (file, file.with_name("energy.py")) if self.solver else (file,)

    def missing(self) -> list[str]:
        """Return the packages that it needs and that are not installed."""
        return [name for name, found in store.installed(self.needs).items() if not found]

    def key(self, sigma: float) -> dict[str, Any]:
        """Return everything that its results depend on."""
        apart = self.peer and not self.solver
        key = {
            "method": self.name,
            "sigma": sigma,
            "parameters": self.parameters(sigma),
            "packages": store.installed((*_CORE, *self.needs)),
            "measures": store.package(*_MEASURES) if apart else store.solver(),
            "files": store.source(*self.files, *_MEASURED),
        }
        if self.net:
            needs, code = store.installed(_TORCH), store.package("net", "hybrid")
            key |= {"net": _weights(self.net), "code": code, "needs": needs}
        return key


def combinations(**ranges: Any) -> tuple[dict[str, Any], ...]:
    """Return parameters for every combination; what is no tuple is the same in all of them.

    >>> combinations(order=3, window=(5, 7))
    ({'order': 3, 'window': 5}, {'order': 3, 'window': 7})
    """
    choices = (values if isinstance(values, tuple) else (values,) for values in ranges.values())
    return tuple(dict(zip(ranges, chosen, strict=True)) for chosen in product(*choices))


def level_name(sigma: float) -> str:
    """Format a level of the noise as a key of JSON.

    >>> level_name(0.005), level_name(0.0)
    ('0.005', '')
    """
    return f"{sigma:.3f}" if sigma else ""


@lru_cache(maxsize=1)
def tuned() -> dict[str, Any]:
    """Return the tuned parameters; None where no setting was better than the input."""
    return json.loads(TUNED.read_text())["values"] if TUNED.exists() else {}


def shipped() -> list[str]:
    """Return the nets that come with the package; none where torch is not installed."""
    return catalogue.available() if all(store.installed(_TORCH).values()) else []


def _weights(name: str) -> list[str]:
    """Return the checksums of a net's files."""
    parts = catalogue.CHAINS.get(name, (name,))
    return [catalogue.read_card(catalogue.located(part))["sha256"] for part in parts]

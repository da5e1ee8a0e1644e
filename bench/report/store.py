"""Stored results, so that an interrupted run can resume.

A piece is a file whose name ends in a digest of everything that its content depends on. When
any of that changes, the piece is not found and is measured again.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import platform
import resource
import zipfile
from collections.abc import Callable, Iterable
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

import gso
from gso.io import replacing

PACKAGE = Path(gso.__file__).parent
#: Parts of the package that do not affect the optimiser's figures: strips and pieces are in no
#: stored table.
_ASIDE = ("cli", "dataset", "exact", "hybrid", "io", "mesh_facts", "net", "plot", "recognition")
_ASIDE += ("ruled", "rulings", "seams", "serving", "sheet_metal", "unfolding", "workshop")
#: Packages whose versions are reported.
_PACKAGES = ("numpy", "scipy", "casadi", "libigl", "trimesh", "gso", "numba", "cvxopt")
_PACKAGES += ("pypardiso", "torch", "matplotlib", "pymeshlab", "vtk")


class Store:
    """Pieces in a folder.

    Examples
    --------
    >>> import tempfile
    >>> store = Store(tempfile.mkdtemp())
    >>> store.value("figures/one", {"n": 3}, lambda: {"mean": 0.5})
    {'mean': 0.5}
    >>> store.find("figures/one", {"n": 3}), store.find("figures/one", {"n": 4})
    ({'mean': 0.5}, None)
    """

    def __init__(self, folder: str | os.PathLike[str]):
        self.folder = Path(folder)

    def find(self, name: str, key: dict[str, Any]) -> Any:
        """Return a stored piece, or None."""
        try:
            return json.loads(self._path(name, key, ".json").read_bytes())["value"]
        except (OSError, ValueError, KeyError):
            return None

    def keep(self, name: str, key: dict[str, Any], value: Any) -> None:
        """Write a piece atomically."""
        with replacing(self._path(name, key, ".json")) as file:
            file.write(json.dumps({"key": key, "value": value}).encode())

    def value(self, name: str, key: dict[str, Any], make: Callable[[], Any]) -> Any:
        """Return a piece; compute and store it if it is missing."""
        found = self.find(name, key)
        if found is None:
            found = make()
            self.keep(name, key, found)
        return found

    def arrays(
        self, name: str, key: dict[str, Any], make: Callable[[], dict[str, np.ndarray]]
    ) -> dict[str, np.ndarray]:
        """Return arrays; compute and store them if they are missing."""
        path = self._path(name, key, ".npz")
        try:
            with np.load(path, allow_pickle=False) as data:
                return dict(data)
        except (OSError, ValueError, EOFError, zipfile.BadZipFile):
            found = make()
        with replacing(path) as file:
            np.savez(file, **found)  # type: ignore[arg-type]
        return found

    def _path(self, name: str, key: dict[str, Any], suffix: str) -> Path:
        path = self.folder / f"{name}-{digest(key)}{suffix}"
        path.parent.mkdir(parents=True, exist_ok=True)
        return path


def digest(key: Any) -> str:
    """Return a digest of twelve characters of an object that JSON can represent."""
    text = json.dumps(key, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def solver() -> str:
    """Digest of the code that the optimiser's results and all metrics depend on."""
    return package(*_solver_parts())


@lru_cache(maxsize=1)
def _solver_parts() -> tuple[str, ...]:
    """Return the files and folders of the package but those in :data:`_ASIDE`."""
    parts = {path.relative_to(PACKAGE).parts[0] for path in PACKAGE.rglob("*.py")}
    return tuple(sorted(parts.difference(_ASIDE)))


@lru_cache(maxsize=8)
def package(*names: str) -> str:
    """Digest of files and folders of the package; an error if one is gone, or was renamed."""
    places = [PACKAGE / name for name in names]
    found = [[place] if place.is_file() else [*place.rglob("*.py")] for place in places]
    if not all(found):
        raise FileNotFoundError(f"{PACKAGE} does not have all of {names}")
    return source(*(path for some in found for path in some))


@lru_cache(maxsize=32)
def source(*paths: Path) -> str:
    """Digest of some files."""
    content = hashlib.sha256()
    for path in sorted(paths):
        content.update(_code(path))
    return content.hexdigest()[:12]


def _code(path: Path) -> bytes:
    """Content of a file; of Python, what runs: comments and docstrings change no figure."""
    if path.suffix != ".py":
        return path.read_bytes()
    tree = ast.parse(path.read_bytes())
    for node in ast.walk(tree):
        documented = isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        if documented and ast.get_docstring(node):
            node.body = node.body[1:]
    return ast.dump(tree).encode()


def installed(names: Iterable[str]) -> dict[str, str]:
    """Return the versions of packages; "" for one that is not installed."""
    return {name: _version(name) for name in names}


@lru_cache(maxsize=64)
def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def machine() -> dict[str, Any]:
    """Describe the machine and the versions of packages."""
    return {
        "python": platform.python_version(),
        "machine": platform.machine(),
        "cores": os.cpu_count(),
        "packages": installed(_PACKAGES),
        "peak_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
        "processor": processor(),
    }


@lru_cache(maxsize=1)
def processor() -> str:
    """Return the name of the processor and the number of cores."""
    about, name = Path("/proc/cpuinfo"), platform.processor() or platform.machine()
    lines = about.read_text().splitlines() if about.exists() else []
    name = next((line.split(":")[1].strip() for line in lines if line[:10] == "model name"), name)
    return f"{name}, {os.cpu_count()} cores"

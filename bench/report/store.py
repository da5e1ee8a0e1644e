"""Stored results, so that an interrupted run can resume.

A piece is a file whose name ends in a digest of everything that its content depends on. When
any of that changes, the piece is not found and is measured again.
"""

from __future__ import annotations

import ast
import hashlib
import io
import json
import os
import platform
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
#: Parts of the package that do not affect the optimiser's figures.
_ASIDE = ("cli", "dataset", "hybrid", "io", "net", "plot", "rulings")
#: Parts that the metrics of a peer's result depend on.
_MEASURES = ("geometry", "mesh", "metrics", "tasks")


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
        path = self._path(name, key, ".json")
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as file:
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
        path.parent.mkdir(parents=True, exist_ok=True)
        memory = io.BytesIO()
        np.savez(memory, **found)  # type: ignore[arg-type]
        with replacing(path) as file:
            file.write(memory.getvalue())
        return found

    def _path(self, name: str, key: dict[str, Any], suffix: str) -> Path:
        return self.folder / f"{name}-{digest(key)}{suffix}"


def digest(key: Any) -> str:
    """Return a digest of twelve characters of an object that JSON can represent."""
    text = json.dumps(key, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


@lru_cache(maxsize=1)
def solver() -> str:
    """Digest of the code that the optimiser's results and all metrics depend on."""
    aside = set(_present(_ASIDE))
    return _content(
        path
        for path in PACKAGE.rglob("*.py")
        if path not in aside and not aside & set(path.parents)
    )


@lru_cache(maxsize=1)
def measures() -> str:
    """Digest of the code that all metrics depend on."""
    return _content(
        path
        for place in _present(_MEASURES)
        for path in ([place] if place.is_file() else place.rglob("*.py"))
    )


@lru_cache(maxsize=1)
def nets() -> str:
    """Digest of the code of nets and warm starts, without the optimiser's."""
    return _content(path for place in _present(("net", "hybrid")) for path in place.rglob("*.py"))


@lru_cache(maxsize=32)
def source(*paths: Path) -> str:
    """Digest of some files."""
    return _content(paths)


def _present(names: Iterable[str]) -> list[Path]:
    """Return paths of the package; raise if one is missing, or it would drop out of a digest."""
    places = [PACKAGE / name for name in names]
    for place in places:
        if not place.exists():
            raise FileNotFoundError(f"{place}: gone; name in {__file__} what it became")
    return places


def _content(paths: Iterable[Path]) -> str:
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
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(
            node
        ):
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


@lru_cache(maxsize=1)
def processor() -> str:
    """Return the name of the processor and the number of cores."""
    name = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    name = next((line.split(":")[1].strip() for line in lines if line[:10] == "model name"), name)
    return f"{name}, {os.cpu_count()} cores"

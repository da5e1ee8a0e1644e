"""Functions compiled by Numba, kept on disk for each user.

Numba keeps compiled functions beside their source, so each source is written to a file of its own.
Numba reads its files with pickle. They are therefore only used in a folder that belongs to the user
and that nobody else can write to; elsewhere functions are compiled again by each process.
"""

from __future__ import annotations

import hashlib
import inspect
import logging
import os
import sys
import tempfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

from gso.solver.arctan2 import arctan2

_log = logging.getLogger("gso")
_HEAD = """from __future__ import annotations

import numpy as np
from numba import njit


@njit(error_model="numpy")
{arctan2}

@njit(error_model="numpy", nogil=True, cache={cache})
"""


def compile_source(source: str) -> Callable[..., None]:
    """Compile a function called ``kernel``, or load it if an earlier process has compiled it.

    Parameters
    ----------
    source : str
        Its source; ``np`` is NumPy, and ``arctan2`` is :func:`gso.solver.arctan2.arctan2`.
    """
    folder = _folder()
    if folder is not None:
        text = _head(cache=True) + source
        path = folder / f"kernel_{_digest(text)}.py"
        try:
            new = _write(path, text)
        except OSError:
            pass
        else:
            if new:
                _say()
            return _load(path)
    _say()
    scope: dict[str, Any] = {}
    exec(compile(_head(cache=False) + source, "<gso kernel>", "exec"), scope)
    kernel: Callable[..., None] = scope["kernel"]
    return kernel


def _head(*, cache: bool) -> str:
    return _HEAD.format(arctan2=inspect.getsource(arctan2), cache=cache)


@lru_cache(maxsize=1)
def _say() -> None:
    _log.warning("compiling the solver's loops, which takes some seconds the first time")


@lru_cache(maxsize=1)
def _folder() -> Path | None:
    """Return the folder for this user; None where it is not safe, or cannot be written to."""
    try:
        folder = _caches() / "gso" / "kernels"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.stat()
    except (OSError, RuntimeError):
        return None
    if hasattr(os, "getuid") and (found.st_uid != os.getuid() or found.st_mode & 0o022):
        return None
    return folder if os.access(folder, os.W_OK) else None


def _caches() -> Path:
    given = os.environ.get("XDG_CACHE_HOME")
    if given:
        return Path(given)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    return Path.home() / ("Library/Caches" if sys.platform == "darwin" else ".cache")


def _digest(text: str) -> str:
    import numba

    said = f"{numba.__version__} {sys.version} {text}"
    return hashlib.blake2b(said.encode(), digest_size=16).hexdigest()


def _write(path: Path, text: str) -> bool:
    """Write a file unless it is there; return whether it was written."""
    if path.exists() and path.read_text(encoding="utf-8") == text:
        return False
    # Several processes may write it at the same time: each replaces it as a whole.
    with tempfile.NamedTemporaryFile(
        "w", encoding="utf-8", dir=path.parent, suffix=".tmp", delete=False
    ) as file:
        file.write(text)
    os.replace(file.name, path)
    return True


def _load(path: Path) -> Callable[..., None]:
    name = f"gso_{path.stem}"
    if name not in sys.modules:
        module = ModuleType(name)
        module.__file__ = str(path)
        # Numba looks for it by name when it loads what an earlier process has compiled.
        sys.modules[name] = module
        try:
            exec(compile(path.read_text(encoding="utf-8"), str(path), "exec"), module.__dict__)
        except BaseException:
            del sys.modules[name]
            raise
    kernel: Callable[..., None] = sys.modules[name].kernel
    return kernel

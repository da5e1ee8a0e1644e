"""The designs of a fabrication: read from files, and divided into components."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from gso import io
from gso.components import split
from gso.mesh import Mesh


def designs_of(given: Any) -> tuple[list[str], list[Mesh]]:
    """Read designs, and divide them into components; return their names too."""
    many = given if isinstance(given, list | tuple) and not _is_mesh(given) else [given]
    names: list[str] = []
    meshes: list[Mesh] = []
    for number, one in enumerate(many, start=1):
        path = isinstance(one, str | os.PathLike)
        suffix = number if len(many) > 1 else ""
        stem = Path(os.fsdecode(one)).stem if path else f"design{suffix}"
        mesh = io.as_mesh(one)
        components = split(mesh)
        for k, part in enumerate(components, start=1):
            names.append(f"{stem}-{k}" if len(components) > 1 else stem)
            meshes.append(part.mesh)
    if len(set(names)) < len(names):
        names = [f"{name}.{k}" for k, name in enumerate(names, start=1)]
    return [_spelled(name) for name in names], meshes


def _is_mesh(given: Any) -> bool:
    """Whether a tuple is vertices and faces rather than several designs."""
    return isinstance(given, tuple) and len(given) == 2 and not isinstance(given[0], str | Mesh)


def _spelled(name: str) -> str:
    """Return a name that can be part of a file's name."""
    return "".join(c if c.isalnum() or c in "-_." else "_" for c in name) or "design"

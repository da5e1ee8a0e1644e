"""Datasets of surfaces for training and comparison: building, reading and exporting."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gso.dataset.builder import build
    from gso.dataset.npy_folder import export
    from gso.dataset.recipe import Recipe
    from gso.dataset.store import Dataset, Split, open

# Imported on first use, so that reading a dataset does not load the solver.
_NAMES = {
    "Dataset": "gso.dataset.store",
    "Recipe": "gso.dataset.recipe",
    "Split": "gso.dataset.store",
    "build": "gso.dataset.builder",
    "export": "gso.dataset.npy_folder",
    "open": "gso.dataset.store",
}

__all__ = ["Dataset", "Recipe", "Split", "build", "export", "open"]


def __getattr__(name: str) -> object:
    if name not in _NAMES:
        raise AttributeError(f"module 'gso.dataset' has no attribute {name!r}")
    return getattr(importlib.import_module(_NAMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)

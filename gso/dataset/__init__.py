"""Datasets of surfaces for training and comparison: building, reading and exporting."""

from __future__ import annotations

import importlib
from typing import Any

# Imported on first use, so that reading a dataset does not load the solver.
_NAMES = {
    "Dataset": "gso.dataset.store",
    "Recipe": "gso.dataset.recipe",
    "Split": "gso.dataset.store",
    "build": "gso.dataset.builder",
    "export": "gso.dataset.npy_folder",
    "open": "gso.dataset.store",
}

__all__ = list(_NAMES)


def __getattr__(name: str) -> Any:
    if name not in _NAMES:
        raise AttributeError(f"module 'gso.dataset' has no attribute {name!r}")
    return getattr(importlib.import_module(_NAMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)

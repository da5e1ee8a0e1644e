"""Neural networks that approximate the optimiser's results in a forward pass (GSO-Net)."""

from __future__ import annotations

import importlib
from typing import Any

# Imported on first use, so that torch is loaded only when a net is used.
_NAMES = {
    "CoarseNet": "gso.net.models.coarse",
    "GSONet": "gso.net.models.gsonet",
    "add_kind": "gso.net.weights",
    "add_task": "gso.net.tasks",
    "available": "gso.net.catalogue",
    "load": "gso.net.weights",
    "predict": "gso.net.inference.prediction",
    "save": "gso.net.weights",
    "train": "gso.net.training.loop",
}

__all__ = list(_NAMES)


def __getattr__(name: str) -> Any:
    if name not in _NAMES:
        raise AttributeError(f"module 'gso.net' has no attribute {name!r}")
    value = getattr(importlib.import_module(_NAMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)

"""Datasets of surfaces for training and comparison: building, reading and exporting."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso.first_use import at_first_use

if TYPE_CHECKING:
    from gso.dataset.bezier import BezierSurface, generate
    from gso.dataset.builder import build
    from gso.dataset.drawing import draw_broad, draw_many
    from gso.dataset.labels import LABELS
    from gso.dataset.noise import LEVELS
    from gso.dataset.npy_folder import export
    from gso.dataset.recipe import Recipe
    from gso.dataset.screen import CURVATURE, select
    from gso.dataset.store import Dataset, Split, open
    from gso.dataset.summary import INTERVALS, PUBLISHED, PUBLISHED_FLAT, summarise

__all__ = [
    "CURVATURE",
    "INTERVALS",
    "LABELS",
    "LEVELS",
    "PUBLISHED",
    "PUBLISHED_FLAT",
    "BezierSurface",
    "Dataset",
    "Recipe",
    "Split",
    "build",
    "draw_broad",
    "draw_many",
    "export",
    "generate",
    "open",
    "select",
    "summarise",
]

# Reading a dataset does not load the solver.
__getattr__, __dir__ = at_first_use(
    __name__,
    {
        "bezier": "BezierSurface generate",
        "builder": "build",
        "drawing": "draw_broad draw_many",
        "labels": "LABELS",
        "noise": "LEVELS",
        "npy_folder": "export",
        "recipe": "Recipe",
        "screen": "CURVATURE select",
        "store": "Dataset Split open",
        "summary": "INTERVALS PUBLISHED PUBLISHED_FLAT summarise",
    },
)

"""The architectures of nets."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso.first_use import at_first_use

if TYPE_CHECKING:
    from gso.net.models.base import SIZE, Net, exact
    from gso.net.models.coarse import CoarseNet
    from gso.net.models.grid_geometry import (
        Planes,
        axes,
        ball,
        normalise,
        normalise_with,
        normals,
        planes,
        points,
        rectangle,
    )
    from gso.net.models.gsonet import GSONet

__all__ = [
    "SIZE",
    "CoarseNet",
    "GSONet",
    "Net",
    "Planes",
    "axes",
    "ball",
    "exact",
    "normalise",
    "normalise_with",
    "normals",
    "planes",
    "points",
    "rectangle",
]

__getattr__, __dir__ = at_first_use(
    __name__,
    {
        "base": "SIZE Net exact",
        "coarse": "CoarseNet",
        "grid_geometry": (
            "Planes axes ball normalise normalise_with normals planes points rectangle"
        ),
        "gsonet": "GSONet",
    },
)

"""The architectures of nets."""

from gso.net.models.base import Net
from gso.net.models.convolution import Convolution
from gso.net.models.grid_geometry import axes, ball, normalise, normals, planes, points, rectangle

__all__ = [
    "Convolution",
    "Net",
    "axes",
    "ball",
    "normalise",
    "normals",
    "planes",
    "points",
    "rectangle",
]

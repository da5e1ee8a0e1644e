"""Trimmed spline surfaces: parts of B-splines inside outlines."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gso.spline.bspline import BSplineSurface
from gso.typing import Array

#: A closed chain of smooth curves, each given by points (k, 2) in the parameters of a spline.
Loop = tuple[Array, ...]


@dataclass(frozen=True)
class TrimmedSpline:
    """A B-spline surface and the parts of it that are inside outlines.

    Attributes
    ----------
    spline : BSplineSurface
    faces : tuple of tuple of Loop
        For each connected part its outline, anticlockwise in the parameters, and then the
        outlines of its holes, clockwise. A loop is a closed chain of smooth curves (k, 2), each
        of which starts where the one before ends.
    """

    spline: BSplineSurface
    faces: tuple[tuple[Loop, ...], ...]

    def outlines(self) -> list[Array]:
        """Return the points (k, 3) of all loops, on the surface."""
        out = []
        for loop in (loop for face in self.faces for loop in face):
            uv = np.concatenate([curve[:-1] for curve in loop])
            out.append(self.spline.evaluate(uv[:, 0], uv[:, 1]))
        return out

    def moved(self, scale: float, shift: Array | float = 0.0) -> TrimmedSpline:
        """Copy it with every point multiplied by `scale`, then moved by `shift`."""
        return replace(self, spline=self.spline.moved(scale, shift))

"""Polylines in space as OBJ files."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import MeshError
from gso.io.atomic import check_writable, replacing
from gso.io.text import write_rows
from gso.typing import AnyPath, Array


def save_lines(lines: Sequence[ArrayLike], path: AnyPath) -> None:
    """Write polylines as a Wavefront OBJ file, which CAD and modelling programs read.

    Parameters
    ----------
    lines : sequence of array_like (k, 3)
        Points of each line, two or more.
    path : str or PathLike
        A file whose name ends in .obj. It is replaced only when the new one is complete.

    Raises
    ------
    MeshError
        A line does not have this shape or is not finite, or the file cannot be written.

    Examples
    --------
    >>> import tempfile, os
    >>> path = os.path.join(tempfile.mkdtemp(), "lines.obj")
    >>> save_lines([[[0, 0, 0], [1, 0, 0]], [[0, 1, 0], [1, 1, 0], [2, 2, 0]]], path)
    >>> print(open(path).read())
    v 0 0 0
    v 1 0 0
    v 0 1 0
    v 1 1 0
    v 2 2 0
    l 1 2
    l 3 4 5
    """
    check_writable(path, (".obj",))
    points = [polyline(line, k, 3) for k, line in enumerate(lines)]
    number = count(1)
    with replacing(path) as file:
        for line in points:
            write_rows(file, "v %.17g %.17g %.17g\n", line)
        for line in points:
            file.write(f"l {' '.join(str(next(number)) for _ in line)}\n".encode("ascii"))


def polyline(line: ArrayLike, number: int, dimension: int) -> Array:
    """Convert a line to an array (k, dimension) of two or more finite points.

    Raises
    ------
    MeshError
        The line is not such an array. The message has its `number`.
    """
    try:
        points = np.array(line, dtype=np.float64)
    except (TypeError, ValueError):
        points = np.empty(0)
    if points.ndim != 2 or points.shape[1] != dimension or len(points) < 2:
        raise MeshError(
            f"line {number} must be an array (k, {dimension}) of two points or more, "
            f"not {points.shape}"
        )
    if not np.isfinite(points).all():
        raise MeshError(f"line {number} has coordinates that are not finite")
    return points

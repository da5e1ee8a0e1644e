"""Operations of the geometry library that are repeated with rounded coordinates where they fail."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gso.errors import MeshError

#: Grids to which coordinates are rounded where an operation fails, relative to the width.
_GRIDS = (1e-12, 1e-10, 1e-8)


def steady(operation: Callable[..., Any], *shapes: Any) -> Any:
    """Return the result of an operation; where it fails, that of shapes with rounded coordinates.

    Parameters
    ----------
    operation : callable
        Takes the shapes.
    *shapes : Geometry or array of them

    Raises
    ------
    MeshError
        It fails on all grids, as with coordinates that are not finite.
    """
    import shapely

    try:
        return operation(*shapes)
    except shapely.GEOSException as error:
        why = error
    every = np.concatenate([np.ravel(np.asarray(shape, object)) for shape in shapes])
    box = shapely.total_bounds(every)
    width = float(max(box[2] - box[0], box[3] - box[1]))
    for grid in _GRIDS:
        try:
            return operation(*(shapely.set_precision(shape, grid * width) for shape in shapes))
        except shapely.GEOSException as error:
            why = error
    raise MeshError(f"the outlines of the parts cannot be processed: {why}; take an evener mesh")

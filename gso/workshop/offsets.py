"""Outlines moved outwards or inwards: kerf and allowance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso.errors import MeshError
from gso.geometry.flat_region import moved, region
from gso.typing import Array
from gso.workshop.part import Part
from gso.workshop.polygons import rings

#: Largest length of a mitred corner, in widths of the offset.
_MITRE = 3.0


def offset(part: Part, by: float) -> Part:
    """Return a part whose outline is moved outwards by a distance, and holes inwards.

    Parameters
    ----------
    part : Part
    by : float
        In millimetres; half the kerf for a cutter that runs outside.

    Raises
    ------
    MeshError
        Nothing is left of the outline, or it falls apart.
    """
    if by == 0.0:
        return part
    outline = _moved(part, part.outline, by)
    holes = [_moved(part, hole[::-1], -by, gone=True) for hole in part.holes]
    return replace(
        part,
        outline=outline,
        holes=tuple(hole[::-1] for hole in holes if len(hole)),
    )


def with_allowance(part: Part, by: float) -> Part:
    """Return a part with an allowance about its outline; the outline becomes a seam line."""
    if by == 0.0:
        return part
    closed = np.concatenate([part.outline, part.outline[:1]])
    notches = tuple(replace(n, at=n.at - by * n.inward) for n in part.notches)
    wide = replace(part, outline=_moved(part, part.outline, by))
    return replace(wide, seams=(*part.seams, closed), notches=notches)


def _moved(part: Part, polygon: Array, by: float, *, gone: bool = False) -> Array:
    """Return a polygon offset by a distance, anticlockwise; empty if it may be gone."""
    shape = moved(region(polygon), by, _MITRE)
    if shape.is_empty and gone:
        return np.empty((0, 2))
    if shape.geom_type != "Polygon" or shape.is_empty:
        what = "nothing is left of it" if shape.is_empty else "it falls apart"
        raise MeshError(
            f"part {part.name}: its outline cannot be moved by {by:g} mm, as {what}; take less"
        )
    return rings(shape)[0]

"""Checks of every surface and pattern: no folds, self-intersections, overlaps, short edges."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gso import faults, metrics
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.typing import Array, Ints
from gso.wording import places


def against_surface(design: Mesh, surface: Mesh) -> Iterator[str]:
    """Check a surface for folds, self-intersections and collapsed edges.

    Folds and self-intersections that the design has already are ignored, if the surface has its
    faces.
    """
    same = np.array_equal(design.faces, surface.faces)
    bad = faults.folded(surface)
    if same and bad.size:
        bad = np.setdiff1d(bad, faults.folded(design))
    if bad.size:
        yield f"the surface is folded onto itself at {places('face', bad)}"
    pairs = faults.crossings(surface)
    if same and pairs.size:
        pairs = pairs[~_known(design, pairs)]
    if pairs.size:
        yield f"the surface passes through itself at {places('face', np.unique(pairs))}"
    if same:
        yield from _collapsed(design, surface.vertices, "the surface")


def against_pattern(surface: Mesh, pattern: Pattern, *, lengths: bool = True) -> Iterator[str]:
    """Check the pattern of a surface for inverted faces and overlaps.

    Edges are checked for collapse if the pattern should preserve `lengths`.
    """
    surface, flat = pattern.surface(surface), pattern.flat
    bad = metrics.flipped_faces(surface, flat)
    if bad.size:
        yield f"the pattern is inverted at {places('face', bad)}"
    bad = np.setdiff1d(faults.overlaps(surface, flat), bad)
    if bad.size:
        yield (f"the pattern lies on itself at {places('face', bad)}: cut the surface into pieces")
    if lengths:
        yield from _collapsed(surface, flat, "the pattern", pattern.vertex)


def _collapsed(before: Mesh, after: Array, what: str, names: Ints | None = None) -> Iterator[str]:
    """Check for collapsed edges; `names` are the vertex numbers to show to the user."""
    edges = faults.collapsed(before, after)
    if names is not None:
        edges = names[edges]
    if len(edges):
        share = f"{100 * faults.SHORT:.0f} %"
        named = [f"{a}-{b}" for a, b in edges]
        yield f"{what} has edges of less than {share} of their length: {places('edge', named)}"


def _known(design: Mesh, pairs: Ints) -> NDArray[np.bool_]:
    """Mark the pairs of faces where the design intersects itself already."""
    before = faults.crossings(design)
    if not before.size:
        return np.zeros(len(pairs), bool)
    # A self-intersection may have moved by up to two rings of faces.
    near = np.zeros(len(design.faces), bool)
    near[before.ravel()] = True
    he = design.half_edges
    for _ in range(2):
        touched = np.zeros(len(design.vertices), bool)
        touched[he.origin[near[he.face]]] = True
        near[he.face[touched[he.origin]]] = True
    return near[pairs[:, 0]] & near[pairs[:, 1]]

"""Checks of every surface and pattern: no folds, self-intersections, overlaps, short edges."""

from __future__ import annotations

import numpy as np

from gso import faults, metrics
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.typing import Array, Flags, Ints
from gso.verdict.codes import Code
from gso.verdict.compare import Measurement

Measured = dict[Code, Measurement]

#: Cosines of the angles at an edge that is sharp in the design, and at one that is folded over.
_EDGE, _OVER = 0.0, -0.87


def crossed(surface: Mesh, part: Ints | None = None) -> Measured:
    """Find the faces of a surface that pass through others; of other parts (m,), if given."""
    pairs = faults.crossings(surface)
    if part is not None:
        pairs = pairs[part[pairs[:, 0]] != part[pairs[:, 1]]]
    return {Code.CROSSES_ITSELF: Measurement.count("face", np.unique(pairs))}


def of_surface(design: Mesh, surface: Mesh, *, built: bool = True) -> Measured:
    """Find folds, self-intersections and collapsed edges of a surface.

    Folds that the design has already are ignored, and edges are measured, if the surface has its
    faces. A surface that is not to be `built` may pass through itself where the design does.
    """
    same = np.array_equal(design.faces, surface.faces)
    bad = faults.folded(surface)
    if same and bad.size:
        bad = _new_folds(design, surface, bad)
    found = {Code.FOLDED: Measurement.count("face", bad), **crossed(surface)}
    if same and not built and found[Code.CROSSES_ITSELF].value:
        pairs = faults.crossings(surface)
        new = np.unique(pairs[~_known(design, pairs)])
        found[Code.CROSSES_ITSELF] = Measurement.count("face", new)
    if same:
        found[Code.COLLAPSED] = _shortest(design, surface.vertices)
    return found


def of_pattern(surface: Mesh, pattern: Pattern, *, lengths: bool = True) -> Measured:
    """Find inverted faces and overlaps of the pattern of a surface.

    Edges are measured if the pattern should preserve `lengths`.
    """
    surface, flat = pattern.surface(surface), pattern.flat
    bad = metrics.flipped_faces(surface, flat)
    found = {
        Code.PATTERN_INVERTED: Measurement.count("face", bad),
        Code.PATTERN_OVERLAPS: Measurement.count(
            "face", np.setdiff1d(faults.overlaps(surface, flat), bad)
        ),
    }
    if lengths:
        found[Code.PATTERN_COLLAPSED] = _shortest(surface, flat, pattern.vertex)
    return found


def _new_folds(design: Mesh, surface: Mesh, bad: Ints) -> Ints:
    """Return the faces at folds of a surface that are no sharp edges of the design already.

    An edge of more than 90 degrees in the design may turn by more than 120, but not by 150.
    """
    new = np.setdiff1d(bad, faults.folded(design, below=_EDGE))
    if len(new) == len(bad):
        return new
    over = np.setdiff1d(faults.folded(surface, below=_OVER), faults.folded(design))
    return np.union1d(new, over)


def _shortest(before: Mesh, after: Array, names: Ints | None = None) -> Measurement:
    """Measure the edges that have collapsed; `names` are the vertex numbers to show to the user."""
    edges = faults.collapsed(before, after)
    a, b = edges.T
    was, now = (np.linalg.norm(x[a] - x[b], axis=1) for x in (before.vertices, after))
    named = edges if names is None else names[edges]
    return Measurement(now / was, "edge", [f"{a}-{b}" for a, b in named])


def _known(design: Mesh, pairs: Ints) -> Flags:
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

"""The flat image of the solve by isometry: its start, its refinement, its place."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gso import metrics as measure
from gso import parametrization
from gso.hierarchy import prolong_displacement
from gso.mesh import Mesh
from gso.mesh.cut import Cut
from gso.typing import Array
from gso.unknowns import Layout, Variables

#: Relative error of lengths up to which a flat image counts as isometric.
_KEPT = 2e-3


def layout_of(mesh: Mesh, cut: Cut | None = None) -> Layout:
    """Return the layout of the surface and its flat image, which has the vertices of a cut mesh."""
    count = len(mesh.vertices)
    flat = count if cut is None else len(cut.vertex)
    return Layout((("surface", count, 3), ("flat", flat, 2)))


def open_surface(mesh: Mesh, cut: Cut | None, points: Array) -> Mesh:
    """Return the surface with vertices (n, 3), cut open if there is a cut."""
    return mesh.replaced(points) if cut is None else cut.mesh.replaced(points[cut.vertex])


def initial(surface: Mesh) -> Array:
    """Compute an initial flat image of an open surface, in its numbering."""
    ready, order = parametrization.by_rows(surface)
    flat = np.empty((len(order), 2))
    flat[order] = parametrization.begin(ready).flat
    return flat


def with_flat(mesh: Mesh, cut: Cut | None, coordinates: Array) -> Array:
    """Add an initial flat image to a surface, given by the first 3n coordinates."""
    points = coordinates[: 3 * len(mesh.vertices)].reshape(-1, 3)
    flat = initial(open_surface(mesh, cut, points))
    return layout_of(mesh, cut).pack({"surface": points, "flat": flat})


def cold_start(levels: list[Mesh], cut: Cut | None) -> Array:
    """Return the design (the last level) and an image interpolated from that of the first level."""
    coordinates = with_flat(levels[0], cut, levels[0].vertices.ravel())
    for coarse, fine in pairwise(levels):
        coordinates = refine(coarse, fine, coordinates)
    return coordinates


def refine(coarse: Mesh, fine: Mesh, coordinates: Array) -> Array:
    """Interpolate the displacement and the flat image of a coarse grid to a finer one."""
    blocks = layout_of(coarse).split(coordinates)
    points = prolong_displacement(coarse, fine, blocks["surface"])
    flat = parametrization.refine(coarse, fine.replaced(points), blocks["flat"])
    return layout_of(fine).pack({"surface": points, "flat": flat})


def is_isometric(mesh: Mesh, cut: Cut | None, threshold: float, coordinates: Array) -> bool:
    blocks = layout_of(mesh, cut).split(coordinates)
    surface = open_surface(mesh, cut, blocks["surface"])
    return measure.isometry_energy(surface, blocks["flat"]) <= threshold


def length_notes(surface: Mesh, flat: Array) -> list[str]:
    """Return a note if a flat image (n, 2) does not preserve the lengths of its surface."""
    # The diagonals of the faces may preserve their lengths while the edges do not.
    faces = 0.5 * measure.isometry_energy(surface, flat) ** 0.5
    off = max(faces, measure.edge_length_error(surface, flat))
    if off <= _KEPT:
        return []
    return [
        f"the flat image keeps lengths only to {off:.1%} on average: the surface is not "
        "developable, or it closes around itself and must be cut open"
    ]


def notes(mesh: Mesh, cut: Cut | None, coordinates: Array) -> list[str]:
    blocks = layout_of(mesh, cut).split(coordinates)
    return length_notes(open_surface(mesh, cut, blocks["surface"]), blocks["flat"])


def place(mesh: Mesh, cut: Cut | None, coordinates: Array) -> Array:
    blocks = layout_of(mesh, cut).split(coordinates)
    ready, order = parametrization.by_rows(open_surface(mesh, cut, blocks["surface"]))
    flat = np.empty_like(blocks["flat"])
    flat[order] = parametrization.place(ready, blocks["flat"][order], None)
    return layout_of(mesh, cut).pack({"surface": blocks["surface"], "flat": flat})


def only_flat(layout: Layout, coordinates: Array) -> Variables:
    """Make the flat image the unknowns, and keep the surface."""
    from scipy.sparse import identity

    start, count, _ = layout.where("flat")
    basis = identity(layout.size, format="csc")[:, start : start + 2 * count].tocsr()
    offset = coordinates.copy()
    offset[start : start + 2 * count] = 0.0
    return Variables(layout, basis, offset)

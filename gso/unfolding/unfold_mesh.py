"""Nets of surfaces of flat faces (``gso.unfold``)."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from gso import io
from gso.errors import MeshError, OptionError
from gso.geometry.polygon import rectangle
from gso.io.polygons import face_rows
from gso.mesh import Mesh
from gso.mesh.topology import label_components
from gso.mesh.validation import checked_vertices
from gso.pattern import Folded, Pattern
from gso.quantities import Length, as_positive, as_sheet
from gso.typing import Array, Ints, MeshLike, Unwelded
from gso.unfolding.edge_lines import edges_along
from gso.unfolding.manifold import edges_between
from gso.unfolding.patch_joining import Joined, join_patches
from gso.unfolding.planar_faces import PlanarFaces
from gso.unfolding.polyhedral_net import Net

#: A surface, or vertices and polygons with any number of corners.
Polygons: TypeAlias = "MeshLike | tuple[ArrayLike, Sequence[Sequence[int]]]"

#: Angle in radians up to which an edge is exactly flat.
_LEVEL = 1e-10
#: Angle in radians up to which faces may meet for a smooth surface. Number of inner vertices on
#: cuts, and their share of all inner ones, from which on a note says that the surface is smooth.
_SMOOTH, _CUT, _SHARE = np.radians(10.0), 200, 0.5
#: Gap between parts that are laid side by side, as a share of the largest.
_GAP = 0.05


def unfold(
    mesh: Polygons,
    *,
    keep: ArrayLike | None = None,
    cut: ArrayLike | None = None,
    sheet: tuple[Length, Length] | None = None,
    larger: bool = False,
    unit: str = "mm",
    scale: float = 1.0,
    flat_angle: float = 0.01,
    effort: float = 1.0,
    seed: int = 0,
) -> Net:
    """Unfold a surface of flat faces: few parts that do not overlap, short cuts, small outlines.

    The shape stays as it is, and no length changes. Faces in one plane are one. They are joined
    along the longest edges first wherever nothing overlaps; then a search (simulated annealing)
    takes subtrees of the parts off and joins them elsewhere, so that parts can be united. At last,
    cuts are exchanged for shorter ones, and for others as long with a smaller rectangle. The
    result does not depend on the numbering of the mesh or its place in space, but for symmetric
    ones, whose nets are then congruent.

    Parameters
    ----------
    mesh : Mesh, (vertices, polygons), str or PathLike
        Anything that :func:`gso.as_mesh` takes, and polygons with any number of corners, concave
        ones, too. Surfaces may be closed, of several components, or not manifold: then they are
        divided, and `notes` says so.
    keep, cut : array_like of int, (k, 2), optional
        Edges, by their vertices, that are not cut in any case, and that are. One edge that is cut
        inside a part opens nothing. Edges along the polylines (``l``) of an OBJ file are cut, too.
    sheet : (float, float), optional
        Length and width of a sheet that every part must fit on, in millimetres, or texts such as
        "3m".
    larger : bool
        Whether faces that are larger than the sheet are parts of their own.
    unit : str
        Unit of the coordinates.
    scale : float
        Factor by which the surface is scaled before anything else.
    flat_angle : float
        Angle in degrees up to which an edge is no fold, and is not cut where that can be avoided.
    effort : float
        Factor of the time of the search, which is about 1 s for 500 faces and in proportion to
        them; 0 for none.
    seed : int
        Of the search.

    Returns
    -------
    Net

    Raises
    ------
    MeshError
        The surface cannot be read, is one-sided, or has faces without area.
    OptionError
        Edges in `keep` cannot all be kept, a face is larger than the sheet and must not be, or an
        option is wrong.

    Examples
    --------
    >>> import itertools
    >>> corners = list(itertools.product([0.0, 100.0], repeat=3))
    >>> sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    >>> net = unfold((corners, sides))
    >>> len(net), net.angles.round(9).tolist(), round(net.cut_length, 6)
    (1, [90.0, 90.0, 90.0, 90.0, 90.0], 700.0)
    >>> bool(net.misfit() < 1e-10)
    True
    """
    as_positive(flat_angle, "flat_angle", zero=True)
    as_positive(effort, "effort", zero=True)
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise OptionError(f"seed is {seed!r}; it must be a whole number of 0 or more")
    as_positive(scale, "scale")
    faces = _faces(mesh)
    drawn, notes = edges_along(faces.mesh.vertices, faces.edges, polylines_of(mesh))
    if scale != 1.0:
        faces = replace(faces, mesh=faces.mesh.replaced(scale * faces.mesh.vertices))
    size = as_sheet(sheet, unit)
    joined = join_patches(
        faces.mesh.vertices,
        faces.mesh.triangles,
        keep=edges_between(faces.mesh, faces.vertex, keep, "keep"),
        cut=np.concatenate([edges_between(faces.mesh, faces.vertex, cut, "cut"), drawn]),
        sheet=size,
        larger=larger,
        flat_angle=flat_angle,
        seed=int(seed),
        effort=effort,
    )
    return net_of(faces, joined, flat_angle, tuple(notes))


def polylines_of(given: object) -> list[Array]:
    """Return the polylines (k, 3) of a surface that is read from an OBJ file."""
    source = given.surface if isinstance(given, Unwelded) else given
    return io.polylines(source) if isinstance(source, str | os.PathLike) else []


def _faces(given: Polygons) -> PlanarFaces:
    """Return the triangles of what was given."""
    if isinstance(given, str | os.PathLike):
        surface = io.read_surface(given)
        try:
            if surface.faces is None:
                return _of_mesh(surface.mesh())
            table = np.asarray(surface.faces)
            return _of_table(checked_vertices(surface.vertices), table, surface.notes)
        except MeshError as error:
            raise MeshError(f"{os.fspath(given)}: {error}") from None
    if isinstance(given, tuple | list) and len(given) == 2:
        points, polygons = given
        if np.ndim(points) == 2:
            return PlanarFaces.of(checked_vertices(points), _rows(polygons))
    return _of_mesh(io.as_mesh(given))


def _of_mesh(mesh: Mesh) -> PlanarFaces:
    return _of_table(mesh.vertices, mesh.faces, mesh.given_notes)


def _of_table(points: Array, table: Ints, notes: tuple[str, ...]) -> PlanarFaces:
    return PlanarFaces.of(points, face_rows(table), notes)


def _rows(polygons: object) -> list[list[int]]:
    """Return polygons as lists of integers; rows of arrays end in -1 where they are shorter."""
    try:
        rows = [[int(c) for c in row] for row in polygons]  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        raise MeshError("faces must be rows of vertex numbers") from None
    return [row[:-1] if row and row[-1] == -1 else row for row in rows]


def net_of(
    faces: PlanarFaces, joined: Joined, flat_angle: float, notes: tuple[str, ...] = ()
) -> Net:
    """Make the net of faces from the parts that they were joined to."""
    triangles, edges = faces.mesh.triangles, joined.edges
    one, other = edges.corners()
    corner = label_components(
        3 * len(triangles), one[joined.whole].ravel(), other[joined.whole].ravel()
    )
    # An edge whose both ends are joined around it is not cut, whatever was asked for.
    whole = (corner[one] == corner[other]).all(axis=1)
    _, first = np.unique(corner, return_index=True)
    flat = _laid(joined.flat, joined.part).reshape(-1, 2)[first]
    seams = np.stack([corner[one[~whole]], corner[other[~whole]]], axis=1)
    pattern = Pattern(flat, corner.reshape(-1, 3), triangles.ravel()[first], seams)
    bent = whole & (np.abs(edges.angles) > _LEVEL)
    folded = Folded(corner[one[bent]], edges.angles[bent], np.zeros(int(bent.sum())))
    notes = (*faces.mesh.notes, *notes)
    if opened := int((~whole & (np.abs(edges.angles) <= np.radians(flat_angle))).sum()):
        notes += (f"{opened} edges in flat faces were cut, as asked for or to save parts",)
    corners = triangles.ravel()
    sharp = corners[one[np.abs(edges.angles) > _SMOOTH]]
    notes += _smooth_notes(faces.mesh, corners[one[~whole]], sharp)
    return Net(
        faces.mesh, faces.face, faces.vertex, pattern, joined.part, folded, flat_angle, notes
    )


def _smooth_notes(mesh: Mesh, cut: Ints, sharp: Ints) -> tuple[str, ...]:
    """Return a note if a surface without sharp edges is cut at most of its inner vertices.

    A surface that is exactly developable need not be cut there. `cut` and `sharp` are the vertices
    of edges that are cut, and of those that are sharp.
    """
    inner = mesh.used & ~mesh.half_edges.boundary_vertex
    is_cut = np.zeros(len(inner), bool)
    is_cut[cut] = True
    is_cut[sharp] = False
    count, every = int((inner & is_cut).sum()), int(inner.sum())
    if count < max(_CUT, _SHARE * every):
        return ()
    return (
        "the surface is smooth, but doubly curved or not exactly developable: its faces are laid "
        f"flat one by one, with cuts at {count} of {every} inner vertices; gso strips, gso pieces "
        "or gso fabricate make developable parts near it",
    )


def _laid(flat: Array, part: Ints) -> Array:
    """Turn parts (t, 3, 2) long side along x, and lay them side by side in rows."""
    out = np.empty_like(flat)
    sizes, boxes = [], []
    for number in range(int(part.max()) + 1):
        own = flat[part == number]
        angle = -rectangle(own.reshape(-1, 2))[0]
        c, s = np.cos(angle), np.sin(angle)
        own = own @ np.array([[c, s], [-s, c]])
        own -= own.min(axis=(0, 1))
        boxes.append(own)
        sizes.append(own.max(axis=(0, 1)))
    size = np.array(sizes)
    gap = _GAP * float(size.max())
    wide = max(float(size[:, 0].max()), 1.3 * float(np.sqrt((size + gap).prod(axis=1).sum())))
    x = y = high = 0.0
    for number in np.argsort(-size[:, 1], kind="stable").tolist():
        if x > 0 and x + size[number, 0] > wide:
            x, y, high = 0.0, y + high + gap, 0.0
        out[part == number] = boxes[number] + [x, y]
        x += float(size[number, 0]) + gap
        high = max(high, float(size[number, 1]))
    return out

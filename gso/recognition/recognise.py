"""Recognition of the developable faces of a mesh."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import OptionError
from gso.geometry.vectors import fold_angles
from gso.io import as_mesh
from gso.mesh import Mesh
from gso.quantities import Length, Strain, as_length, as_strain
from gso.recognition.bend_lines import Step, bend_step_of, lines_of_round, lines_of_strip
from gso.recognition.facet_graph import SMOOTH, FacetGraph
from gso.recognition.flat_and_torsal import Patch, other_patches
from gso.recognition.flat_images import Part, developed, plane_image, round_image
from gso.recognition.given_faces import GivenFaces
from gso.recognition.region_growing import Region, known_region, round_regions
from gso.recognition.round_surface import RoundSurface
from gso.recognition.ruling_cut import cut_along, opening_angle
from gso.recognition.shape_face import Recognised, ShapeFace
from gso.recognition.smooth_torsal import smooth_image
from gso.recognition.tangent_rulings import divide_at_tangents
from gso.typing import Array, Flags, Ints, MeshLike

#: Fold, in radians, above which single rows of facets may be faces of their own.
_ROW = np.radians(5.0)
#: Triangles of a smooth face at least, where more than this share of the area is free.
_FEW, _MOSTLY = 12, 0.5


def recognise(
    mesh: MeshLike,
    *,
    max_deviation: Length | None = None,
    max_strain: Strain = 2e-3,
    bend_step: Length | None = None,
    unit: str = "mm",
    rows: bool = False,
    parts: ArrayLike | None = None,
) -> Recognised:
    """Divide a mesh into planes, cylinders, cones, torsal surfaces and free surfaces.

    Parameters
    ----------
    mesh : MeshLike
        Triangles, quads or both, in any order.
    max_deviation : float or str, optional
        Distance from its surface that a vertex may have; by default what the rounding of the
        coordinates explains.
    max_strain : float or str
        Largest strain of the flat image of a face whose edges do not follow its rulings, and of
        which no equation is known.
    bend_step : float or str, optional
        Largest angle between neighbouring bend lines of cylinders and cones, in degrees (a number,
        or "15deg"), or how far chords between them may be from the surface, as a length ("0.5mm").
        By default 2 to 15 degrees, by the radius.
    unit : str
        Unit of the coordinates.
    rows : bool
        Whether single rows of facets between circles are cones and cylinders, too, where the folds
        between them are larger than 5 degrees.
    parts : array_like of int, (m,), optional
        Number of the cylinder or cone that each triangle is on, -1 where it is not known. Only for
        meshes of triangles.

    Returns
    -------
    Recognised

    Raises
    ------
    MeshError
        It is no mesh.
    OptionError
        An option is out of range.

    Notes
    -----
    A mesh is either a polyhedron with folds, or a smooth surface that is tessellated: facets are
    one cylinder or cone if their vertices lie on it, if at least three follow each other
    around the axis, if half of the triangles span at most 30 degrees, and none more than 8 degrees
    and more than three times the upper quartile. Eight flat sides with folds of 45 degrees
    therefore stay folds, and twelve with 30 degrees are a tube. One row of facets between
    circles with smooth folds is no proof of straight rulings: a sphere consists of such rows.
    With `rows` it is taken for a cone.
    Vertices of holes that were cut into the facets are inside the surface, by an error of chords at
    most; their places in the plane are those of the nearest points of the surface. Triangles
    across the ruling where a cylinder or cone is tangent to a plane or to a cylinder are divided
    there.
    Faces of STEP and IGES files have the equations that the file gives them, if their vertices
    still lie on them.

    Examples
    --------
    >>> angle, height = np.meshgrid(np.linspace(0, np.pi, 31), [0.0, 20.0, 40.0])
    >>> half = np.stack([10 * np.cos(angle), 10 * np.sin(angle), height], axis=-1)
    >>> (face,) = recognise(half).faces
    >>> face.kind, round(face.radius, 6), round(float(np.ptp(face.flat[..., 0])), 4)
    ('cylinder', 10.0, 31.4159)
    """
    surface = as_mesh(mesh)
    allowed = (
        0.0
        if max_deviation is None
        else as_length(max_deviation, "max_deviation", diagonal=surface.diagonal, unit=unit)
    )
    limit = as_strain(max_strain, "max_strain")
    graph = FacetGraph.of(surface, allowed, _ROW if rows else SMOOTH)
    step = bend_step_of(bend_step, surface.diagonal, unit)
    given = None if surface.attributes is None else surface.attributes.surfaces
    known = GivenFaces.of(graph, given)
    regions = list(known.regions)
    if parts is not None:
        regions += _regions_of(graph, np.asarray(parts))
    unknown = known.unknown.copy()
    for region in regions:
        unknown &= ~region.member
    regions += round_regions(graph, unknown)
    divided = np.arange(len(graph.triangles))
    if given is None:
        graph, divided, regions = divide_at_tangents(graph, regions)
    rest = np.ones(len(graph.triangles), bool)
    for member in (*(region.member for region in regions), *known.torsal):
        rest &= ~member
    patches = other_patches(graph, rest)
    graph, source, seams = _opened(graph, regions)
    faces = [
        _round_face(graph, np.flatnonzero(region.member[source]), region.surface, seam, step)
        for region, seam in zip(regions, seams, strict=True)
    ]
    faces += _other_faces(graph, patches, source, limit)
    faces += known.torsal_faces(graph, source, step)
    faces.sort(key=lambda face: int(face.triangles[0]))
    return Recognised(graph.points, graph.triangles, divided[source], tuple(faces), graph.tolerance)


def has_rows(mesh: Mesh) -> bool:
    """Return whether single rows of facets may be faces: whether folds are of 5 to 30 degrees.

    Elsewhere `rows` of :func:`recognise` makes no difference.

    >>> angle, height = np.meshgrid(np.linspace(0, 3, 31), [0.0, 20.0, 40.0])
    >>> has_rows(as_mesh(np.stack([10 * np.cos(angle), 10 * np.sin(angle), height], axis=-1)))
    True
    """
    folds = np.abs(FacetGraph.of(mesh).folds)
    return bool(((folds > _ROW) & (folds <= SMOOTH)).any())


def _regions_of(graph: FacetGraph, parts: Ints) -> list[Region]:
    """Return the cylinders and cones among parts with known triangles."""
    if parts.shape != (len(graph.triangles),):
        raise OptionError(
            f"parts has {parts.size} numbers for {len(graph.triangles)} triangles; give one for "
            "each, and a mesh of triangles"
        )
    found = (known_region(graph, parts == k) for k in np.unique(parts[parts >= 0]))
    return [region for region in found if region is not None]


def _opened(
    graph: FacetGraph, regions: list[Region]
) -> tuple[FacetGraph, Ints, list[float | None]]:
    """Choose where to open faces that close around an axis; refine the mesh along these rulings.

    Also return the source of each triangle, and the angle of each region's seam.
    """
    source = np.arange(len(graph.triangles))
    seams: list[float | None] = []
    for region in regions:
        part = Part.of(graph.points, graph.triangles[region.member[source]])
        opening = opening_angle(part, region.surface, graph.tolerance)
        seams.append(None if opening is None else opening[0])
        if opening is not None and opening[1]:
            points, triangles, old = cut_along(
                part, region.surface, opening[0], graph.triangles, graph.tolerance
            )
            graph, source = graph.refined(points, triangles, old), source[old]
    return graph, source, seams


def _round_face(
    graph: FacetGraph, ids: Ints, surface: RoundSurface, seam: float | None, step: Step
) -> ShapeFace:
    part = Part.of(graph.points, graph.triangles[ids])
    image = round_image(part, surface, seam)
    toward = np.abs(np.einsum("td,td->t", surface.normals(graph.middles[ids]), graph.normals[ids]))
    vertices = np.unique(part.triangles)
    return ShapeFace(
        "cone" if surface.slope else "cylinder",
        ids,
        image.flat,
        surface,
        surface.axis,
        surface.apex,
        float(np.abs(surface.distances(graph.points[vertices])).max()),
        float(np.arccos(np.clip(toward, 0.0, 1.0)).max()),
        seam=part.ends[~image.together],
        bend_lines=lines_of_round(part, surface, image, step(surface.radius)),
        bend_angle=float(np.ptp(image.angle)) * float(np.cos(surface.half_angle)),
    )


def _other_faces(
    graph: FacetGraph, patches: list[Patch], source: Ints, limit: float
) -> list[ShapeFace]:
    """Make faces of patches, whose triangles are sources of those of the graph."""
    owner = np.full(int(source.max()) + 1, -1)
    for k, patch in enumerate(patches):
        owner[patch.triangles] = k
    order = np.argsort(owner[source], kind="stable")
    bounds = np.searchsorted(owner[source][order], np.arange(len(patches) + 1))
    ids = [order[a:b] for a, b in pairwise(bounds)]
    free = sum(
        float(graph.areas[i].sum())
        for i, patch in zip(ids, patches, strict=True)
        if patch.kind == "free"
    )
    # A few triangles of a free surface can always be laid flat.
    fewest = _FEW if free > _MOSTLY * graph.areas.sum() else 0
    return [
        ShapeFace("free", i)
        if patch.kind == "free" and len(i) < fewest
        else _other_face(graph, patch, i, limit)
        for i, patch in zip(ids, patches, strict=True)
    ]


def _other_face(graph: FacetGraph, patch: Patch, ids: Ints, limit: float) -> ShapeFace:
    if patch.kind == "free":
        smooth = smooth_image(graph.points, graph.triangles[ids], limit)
        if smooth is None:
            return ShapeFace("free", ids)
        return ShapeFace(
            "torsal",
            ids,
            smooth.flat,
            strain=smooth.strain,
            bend_lines=smooth.bend_lines,
            bend_angle=sum(line.angle for line in smooth.bend_lines),
        )
    part = Part.of(graph.points, graph.triangles[ids])
    if patch.kind == "plane":
        return _plane(graph, part, ids)
    facet = graph.facet[ids]
    every = np.ones(len(part.pairs), bool)
    flat, together = developed(part, every)
    if not together.all():
        flat, together = developed(part, ~_longest_ruling(part, facet))
    fold = _folds(graph, part, ids)
    face = ShapeFace(
        "cone" if patch.kind == "cone" else "torsal", ids, flat, None, patch.axis, patch.apex
    )
    lines = lines_of_strip(part, flat, facet, fold, together)
    turned = sum(line.angle for line in lines)
    return replace(face, seam=part.ends[~together], bend_lines=lines, bend_angle=turned)


def _plane(graph: FacetGraph, part: Part, ids: Ints) -> ShapeFace:
    normal = graph.areas[ids] @ graph.normals[ids]
    normal = normal / np.linalg.norm(normal)
    points = graph.points[np.unique(part.triangles)]
    off = np.abs((points - points.mean(axis=0)) @ normal).max()
    turned = np.arccos(np.clip(graph.normals[ids] @ normal, -1.0, 1.0)).max()
    return ShapeFace("plane", ids, plane_image(part), None, normal, None, float(off), float(turned))


def _longest_ruling(part: Part, facet: Ints) -> Flags:
    """Pairs whose edges are on the ruling with the most edges: a seam that meets no hole."""
    low, high = np.sort(facet[part.pairs], axis=1).T
    length = np.linalg.norm(part.points[part.ends[:, 0]] - part.points[part.ends[:, 1]], axis=1)
    key = np.where(low == high, -1, low * (int(facet.max()) + 1) + high)
    _, group = np.unique(key, return_inverse=True)
    total = np.bincount(group.ravel(), np.where(key < 0, 0.0, length))
    return np.asarray(group.ravel() == int(np.argmax(total >= 0.999 * total.max())))


def _folds(graph: FacetGraph, part: Part, ids: Ints) -> Array:
    """Fold angles at the pairs of a part, positive where the surface is convex."""
    a, b = graph.normals[ids[part.pairs[:, 0]]], graph.normals[ids[part.pairs[:, 1]]]
    along = part.points[part.ends[:, 1]] - part.points[part.ends[:, 0]]
    return fold_angles(a, b, along)

"""The pattern of a design that is flat or developable as it is: nothing is moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gso.exact.fold_edges import FOLD, fold_edges, seam_angles
from gso.exact.low_poly import facets, is_low_poly, without_coarse_zones
from gso.exact.rolled_faces import fold
from gso.exact.ruled_bends import joined_bends, ruled_bends, zones_of
from gso.exact.sliced_pattern import SlicedPattern, shape_size
from gso.mesh import Mesh
from gso.pattern import Folded, Pattern, Zone
from gso.quantities import Length, Strain
from gso.recognition import Recognised, has_rows, recognise
from gso.typing import Array, Ints
from gso.unfolding import join_patches
from gso.unfolding.dual_edges import dual_edges
from gso.unfolding.folding import misfit
from gso.wording import percent

#: Strain up to which a pattern is exact.
EXACT = 1e-6
#: Difference of lengths, relative to the size, up to which edges are equally long.
_SAME = 1e-7
#: How many parts exact rows of facets may be more than parts that are only near the design.
_MORE = 1
#: Number of faces from which on no mesh consists of single rows of facets.
_FINE = 20_000
#: Angle between normals at both ends of an edge, in radians, up to which it is along a ruling.
_TURNED = 1e-3


@dataclass(frozen=True, eq=False)
class FoldedPattern:
    """A design in the plane, with the lines to fold, bend and roll it along.

    Attributes
    ----------
    surface : Mesh
        The design in triangles, with more vertices where bend lines cross edges.
    pattern : Pattern
        Its pattern. On cylinders and cones lengths are those of the round surface.
    folded : Folded
        Edges of the pattern on bend lines; the radius of a fold is 0. There are very small ones
        between facets that are nearly in one plane, see :attr:`bends`. Zones are numbers of faces.
    zones : tuple of Zone
        How each face is bent.
    recognised : Recognised
        The faces of the design.
    parts : int
        Number of parts.
    strain : float
        Largest strain of a face that has no equation.
    face : ndarray of int, (t,)
        The face in `recognised` of each triangle.
    seam_angles : ndarray, (s,)
        Angle between the faces at each seam edge of the pattern, as of a bend; 0 where the surface
        is smooth.
    """

    surface: Mesh
    pattern: Pattern
    folded: Folded
    zones: tuple[Zone, ...]
    recognised: Recognised
    parts: int
    strain: float
    face: Ints
    seam_angles: Array

    @property
    def bends(self) -> Folded:
        """The bends that are drawn: not folds of less than 0.05 degrees."""
        return self.folded.taken((self.folded.radii > 0) | (np.abs(self.folded.angles) > FOLD))

    def fold(self) -> Array:
        """Fold and roll the parts by their bends alone.

        Returns
        -------
        ndarray, (p, 3)
            Positions of the pattern's vertices, each part in a place of its own: cylinders and
            cones have the radii of their bends, and all other triangles stay flat.
        """
        is_round = np.array([face.surface is not None for face in self.recognised.faces])
        return fold(self.pattern, self.folded, np.where(is_round[self.face], self.face, -1))

    def misfit(self, design: Mesh) -> float:
        """Return how far the folded parts are from the design's vertices at most."""
        pattern, points = self.pattern, self.surface.vertices[self.pattern.vertex]
        part = pattern.mesh.components
        given = np.flatnonzero(pattern.vertex < len(design.vertices))
        return misfit(self.fold()[given], points[given], part[given])


def keeps_rows(own: int, others: float) -> bool:
    """Tell whether a design whose rows of facets are cones stays as it is.

    Rows of a surface that is curved both ways are cones, too, but more than other parts.

    Parameters
    ----------
    own : int
        Number of its parts, which are exact.
    others : float
        Number of other parts within the largest distance.

    Examples
    --------
    >>> keeps_rows(4, 3), keeps_rows(8, 3)
    (True, False)
    """
    return own <= others + _MORE


def folded_pattern(
    mesh: Mesh,
    *,
    max_strain: Strain = 1e-3,
    max_deviation: Length | None = None,
    cut: ArrayLike = (),
    keep: ArrayLike = (),
    sheet: tuple[float, float] | None = None,
    larger: bool = False,
    bend_step: Length | None = None,
    unit: str = "mm",
    press_radius: tuple[float, float] | None = None,
    rows: bool = False,
    parts: ArrayLike | None = None,
) -> FoldedPattern | None:
    """Unfold a design that consists of flat, rolled and conical faces.

    Parameters
    ----------
    mesh : Mesh
    max_strain : float or str
        Largest strain of a face that has no equation.
    max_deviation : float or str, optional
        Largest distance of vertices from the cylinder or cone that they are counted to; the
        accuracy of the coordinates when not given.
    cut, keep : array_like of int, (k, 2)
        Edges that are cut in any case, and that are not.
    sheet : (float, float), optional
        Length and width that a part may have, in the mesh's unit.
    larger : bool
        Whether faces that are larger than the sheet are parts of their own.
    bend_step : float or str, optional
        Largest angle between neighbouring bend lines, in degrees (a number, or "15deg"), or how
        far chords between them may be from the surface, as a length ("0.5mm").
    press_radius : (float, float), optional
        Largest radii of cylinders that are bent by a press, at one line in the middle, where the
        surface is convex and where it is concave. Cylinders that turn by more than 180 degrees
        are rolled in any case.
    rows : bool
        Whether single rows of facets with smooth folds between them are cones and cylinders: they
        may be rows of a surface that is curved both ways, too. Only in meshes with folds of 5 to 30
        degrees and up to 20,000 faces: others have none.
    parts : array_like of int, (m,), optional
        As of :func:`gso.recognition.recognise`.

    Returns
    -------
    FoldedPattern or None
        None if some face is not developable, unless the design is a polyhedron of few triangles
        with sharp edges.

    Examples
    --------
    >>> box = [[x, y, z] for z in (0, 2) for x, y in ((0, 0), (4, 0), (4, 3), (0, 3))]
    >>> sides = [[k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4] for k in range(4)]
    >>> found = folded_pattern(Mesh(box, [*sides, [3, 2, 1, 0], [4, 5, 6, 7]]))
    >>> found.parts, len(found.folded.edges), float(np.degrees(found.folded.angles).round(6).max())
    (1, 5, 90.0)
    """
    if rows and (len(mesh.faces) > _FINE or not has_rows(mesh)):
        return None
    shape = recognise(
        mesh,
        max_deviation=max_deviation,
        max_strain=max_strain,
        bend_step=bend_step,
        unit=unit,
        rows=rows,
        parts=parts,
    )
    if not shape.developable.all():
        if not is_low_poly(shape):
            return None
        shape = facets(shape)
    if mesh.attributes is None or mesh.attributes.surfaces is None:
        shape = without_coarse_zones(shape)
    flat = shape.flat()
    joined = join_patches(
        shape.vertices,
        shape.triangles,
        shape.face,
        flat,
        cut=np.concatenate([np.reshape(cut, (-1, 2)).astype(int), _apart(shape, flat)]),
        keep=keep,
        sheet=sheet,
        larger=larger,
    )
    sliced = SlicedPattern.of(shape, joined)
    bends = ruled_bends(sliced, shape.faces, flat, press_radius, shape.tolerance)
    folded = joined_bends([bends, fold_edges(sliced, shape)])
    surface = Mesh(sliced.points, sliced.vertex[sliced.faces])
    # In the order of the surface's vertices, as patterns that are not cut have it.
    order = np.argsort(sliced.vertex, kind="stable")
    rank = np.argsort(order)
    pattern = Pattern(
        sliced.flat[order], rank[sliced.faces], sliced.vertex[order], rank[sliced.seams]
    )
    return FoldedPattern(
        surface,
        pattern,
        folded._replace(edges=rank[folded.edges]),
        zones_of(shape.faces, press_radius),
        shape,
        int(joined.part.max()) + 1,
        max(face.strain for face in shape.faces),
        sliced.label,
        seam_angles(sliced, shape),
    )


def as_it_is(strain: float) -> str:
    """Say that a design is kept, and by how much its pattern strains if it is not exact.

    >>> as_it_is(0.0)
    'the design is developable as it is: nothing was moved'
    >>> print(as_it_is(5e-4))
    the design is nearly developable: nothing was moved, and the pattern strains by 0.0500 % at most
    """
    if strain <= EXACT:
        return "the design is developable as it is: nothing was moved"
    said = f"nothing was moved, and the pattern strains by {percent(strain)} at most"
    return f"the design is nearly developable: {said}"


def _apart(shape: Recognised, flat: Array) -> Ints:
    """Find edges that must be cut.

    Those that are not equally long in the flat images of both sides, and those between two faces
    that cross the rulings of one: a sheet cannot be folded there.
    """
    edges = dual_edges(shape.triangles, shape.vertices)
    corners = flat.reshape(-1, 2)
    one, other = (
        np.linalg.norm(corners[ends[:, 0]] - corners[ends[:, 1]], axis=1)
        for ends in edges.corners()
    )
    apart = np.abs(one - other) > _SAME * shape_size(shape)
    sides = shape.face[edges.triangles]
    for number, face in enumerate(shape.faces):
        border = (sides == number).any(axis=1) & (sides[:, 0] != sides[:, 1])
        ends = edges.ends[border]
        a, b = shape.vertices[ends].transpose(1, 0, 2)
        if face.surface is not None:
            # Not at the ends, of which one may be an apex.
            n, m = (face.surface.normals(a + share * (b - a)) for share in (0.25, 0.75))
        elif face.normals is not None:
            n, m = face.normals_at(ends).transpose(1, 0, 2)
        else:
            continue
        apart[border] |= np.linalg.norm(n - m, axis=1) > _TURNED
    return np.asarray(edges.ends[apart])

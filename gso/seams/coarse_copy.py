"""A copy of a design at the scale of an allowed distance, on which seams are searched for.

Everything finer than the distance is noise to the search. The copy is smoothed within a share of
the distance, then thinned to triangles of about that size, so that the work depends on the distance
and not on the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import diags

from gso import metrics
from gso.hierarchy.thinning import flipped, thinned
from gso.linalg import spd
from gso.mesh import Mesh
from gso.mesh.cut import cut
from gso.mesh.slicing import divided
from gso.seams.crease_lines import crease_lines
from gso.seams.distance_estimate import largest_curvatures
from gso.seams.kinds import Creases
from gso.seams.potential import Potential
from gso.seams.wanted import Wanted, without_specks
from gso.typing import Ints

#: Area over the whole below which nobody would cut a piece.
TINY = 0.003
#: Share of the distance that smoothing may use.
_SMOOTH = 0.3
#: Edge of the copy over the distance, and least and most vertices of a copy.
_EDGE, _FEWEST, _MOST = 1.35, 500, 1700
#: Range of distances over the diagonal.
_LEAST, _LARGEST = 1e-6, 0.1
#: Number of vertices of a copy over those of a coarse design.
_FINER = 3
#: Factor on the number of vertices where the surface is round, and the curvature over that of a
#: ball of the distance from which on it is.
_FINE, _ROUND = 3, 0.4
#: Length of a crease over the distance from which on seams prefer it.
_CREASE = 8.0
#: Edges longer than this, over those of the copy, are divided.
_LONG = 1.6
#: Angle in degrees above which an edge is not flipped after that, since the shape stays.
_BENT = 0.5
#: Width of the smoothing over the distance.
_WIDTH = 0.5
#: Factor on the weight of the position of vertices on creases.
_HELD = 1e4


@dataclass(frozen=True, eq=False)
class CoarseCopy:
    """A design with a coarse copy of it.

    Attributes
    ----------
    base : Mesh
        The design in triangles; long edges are divided.
    smooth : Mesh
        The base with smoothed vertices.
    creases : ndarray of int, (k, 2)
        Edges of the base on creases, and on other lines that seams prefer.
    wanted : Wanted
        What is asked of the seams of the base.
    mesh : Mesh
        The copy: a coarser mesh of some vertices of the smooth one.
    ids : ndarray of int, (n,)
        For each vertex of the copy, that of the base.
    lines : ndarray of int, (l, 2)
        Edges of the copy on creases.
    """

    base: Mesh
    smooth: Mesh
    creases: Ints
    wanted: Wanted
    mesh: Mesh
    ids: Ints
    lines: Ints

    @cached_property
    def wanted_of_copy(self) -> Wanted:
        """What is asked of the seams of the copy."""
        wanted, lines = self.wanted, self.lines
        kept, along = (lines[np.isin(self.ids, own)[lines].all(axis=1)] for own in wanted.lines)
        kept = without_specks(self.mesh, kept, TINY)
        return Wanted(kept, along, wanted.avoided[self.ids])

    @classmethod
    def of(cls, design: Mesh, distance: float, wanted: Wanted | None = None) -> CoarseCopy:
        """Make the copy of a design for an allowed distance.

        Parameters
        ----------
        design : Mesh
        distance : float
        wanted : Wanted, optional
            What is asked of its seams.

        Examples
        --------
        >>> y, x = np.mgrid[0:1:60j, 0:1:60j]
        >>> sheet = Mesh.from_grid(np.dstack([x, y, 0.2 * x * y]))
        >>> copy = CoarseCopy.of(sheet, 0.05)
        >>> len(copy.mesh.vertices) < 0.5 * len(sheet.vertices), len(copy.lines)
        (True, 0)
        """
        # Beyond that the copy would be no surface; the search measures by what was asked for.
        distance = float(np.clip(distance, _LEAST * design.diagonal, _LARGEST * design.diagonal))
        triangles = Mesh(design.vertices, design.triangles, attributes=design.attributes)
        area = metrics.area(triangles)
        count = int(np.clip(area / (0.866 * (_EDGE * distance) ** 2), _FEWEST, _MOST))
        count = min(count, max(_FEWEST, _FINER * int(design.used.sum())))
        step = float(np.sqrt(area / (0.866 * count)))
        if wanted is None:
            wanted = Wanted.nothing(triangles)
        base, wanted = with_short_edges(triangles, _LONG * step, wanted)
        creases = crease_lines(base, _CREASE * distance)
        creases = np.concatenate([creases, wanted.kept, wanted.along])
        creases = np.unique(np.sort(creases, axis=1), axis=0)
        smooth = smoothed_within(base, _WIDTH * distance, _SMOOTH * distance, creases)
        thin = thinned(smooth.vertices, smooth.faces, _FINE * count, lines=creases)
        fine = Mesh(smooth.vertices[thin.ids], thin.faces)
        # Edges that are long for the distance cut surfaces that are less round, but no nearly flat
        # ones, for which the copy would have all vertices of the design.
        radius = min((step / _EDGE) ** 2 / distance, step)
        own = thinned(
            fine.vertices, fine.faces, count, _narrow(fine, thin.lines, radius), thin.lines
        )
        mesh, ids = Mesh(fine.vertices[own.ids], own.faces), thin.ids[own.ids]
        return cls(base, smooth, creases, wanted, mesh, ids, own.lines)


def _narrow(mesh: Mesh, creases: Ints, radius: float) -> Ints:
    """Return the vertices where the surface is so round that coarser triangles would cut it."""
    bent = largest_curvatures(cut(mesh, creases).mesh) * radius > _ROUND
    return np.setdiff1d(mesh.faces[bent], creases)


def with_short_edges(mesh: Mesh, longest: float, wanted: Wanted) -> tuple[Mesh, Wanted]:
    """Divide the edges of a triangle mesh that are longer than a length; the shape stays."""
    for _ in range(20):
        long = mesh.edge_lengths > longest
        if not long.any():
            break
        edges = mesh.edges[long]
        wanted = wanted.through(edges, len(mesh.vertices))
        mesh, _ = divided(mesh, edges, np.full(len(edges), 0.5))
        stay = np.concatenate([Creases(_BENT).edges(mesh), *wanted.lines])
        faces = flipped(mesh.vertices, mesh.faces, np.sort(stay, axis=1))
        mesh = Mesh(mesh.vertices, faces, attributes=mesh.attributes)
    return mesh, wanted


def smoothed_within(mesh: Mesh, width: float, distance: float, held: Ints) -> Mesh:
    """Smooth a triangle mesh over a width; no vertex moves farther than a distance.

    It minimises the displacement and the squared Laplacian of the coordinates; vertices on the held
    edges (k, 2) stay.
    """
    field = Potential(mesh)
    area = field.mass
    bending = field.stiffness @ diags(1.0 / area) @ field.stiffness
    weight = np.where(np.isin(np.arange(len(area)), held), _HELD, 1.0) * area
    solve = spd(diags(weight) + width**4 * bending)
    moved = np.stack([solve(weight * x) for x in mesh.vertices.T], axis=1) - mesh.vertices
    size = np.linalg.norm(moved, axis=1, keepdims=True)
    moved *= np.minimum(1.0, distance / np.maximum(size, 1e-300))
    moved[~mesh.used] = 0.0
    return mesh.replaced(mesh.vertices + moved)

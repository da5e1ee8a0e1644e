"""Pieces laid flat, with what a cutter asks of them: strain, overlaps, necks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gso import faults, metrics
from gso.geometry.flat_region import region
from gso.geometry.polygon import mean_width, rectangle
from gso.mesh import Mesh, Paths
from gso.pattern import Folded
from gso.pipeline import lay_out
from gso.short_repr import short_repr
from gso.typing import Array, Ints
from gso.verdict import Code, Measurement

if TYPE_CHECKING:
    from shapely import Geometry

#: Smallest share of a piece's area on both sides of a neck.
_SHARE = 0.02
#: Strain (99 %) up to which the objective of the other formulation may give less.
_ISOMETRIC = 3e-3


@dataclass(frozen=True, eq=False)
class Sheet:
    """The flat pattern of one piece.

    Attributes
    ----------
    mesh : Mesh
        The piece in space, a disk, or a disk with holes where the design is kept as it is.
    flat : ndarray, (n, 2)
        Its pattern, in the same unit.
    folded : Folded
        Edges to bend along, of gores and where the design is kept as it is.
    exact_strain : float or None
        The largest strain by the equations of the design's faces, where these are kept: edges of
        the mesh are chords of round faces.
    """

    mesh: Mesh
    flat: Array
    folded: Folded = field(default_factory=Folded)
    exact_strain: float | None = None

    __repr__ = short_repr

    @cached_property
    def strains(self) -> dict[str, float]:
        """Largest, 99th percentile and mean strain of the corner triangles."""
        found = metrics.strains(self.mesh, self.flat)
        return found if self.exact_strain is None else dict.fromkeys(found, self.exact_strain)

    @cached_property
    def strain(self) -> float:
        """The largest strain of the corner triangles."""
        return self.strains["strain_max"]

    @cached_property
    def overlaps(self) -> Ints:
        """Pairs of faces (p, 2) that overlap."""
        return faults.overlapping(self.mesh, self.flat)

    @cached_property
    def inverted(self) -> Ints:
        """Faces that are inverted."""
        return metrics.flipped_faces(self.mesh, self.flat)

    @cached_property
    def sound(self) -> bool:
        """Whether nothing overlaps and nothing is inverted."""
        return not (len(self.inverted) or len(faults.overlaps(self.mesh, self.flat)))

    @cached_property
    def outline(self) -> Ints:
        """The vertices of the outer boundary loop."""
        loops = self.mesh.boundary_loops
        size = [float(np.ptp(self.flat[loop], axis=0).prod()) for loop in loops]
        return loops[int(np.argmax(size))]

    @cached_property
    def region(self) -> Geometry:
        """The region of the pattern."""
        outline = self.outline
        holes = [loop for loop in self.mesh.boundary_loops if loop is not outline]
        return region(self.flat[outline], [self.flat[loop] for loop in holes])

    @cached_property
    def size(self) -> tuple[float, float]:
        """Length and width of the smallest bounding rectangle."""
        return rectangle(self.flat)[1]

    @cached_property
    def mean_width(self) -> float:
        """Twice the area over the perimeter: the width, for a long strip."""
        return mean_width([self.flat[loop] for loop in self.mesh.boundary_loops])

    def neck(self, limit: float) -> float:
        """Return the width at the narrowest place, or a limit where that is less.

        It is the distance along edges between two vertices of the outline with at least 2 % of the
        area on both sides.
        """
        return self.narrowest(limit)[0]

    def narrowest(self, limit: float) -> tuple[float, tuple[int, int] | None]:
        """Return the same with the two vertices; None for them where the limit is less."""
        loop = self.outline
        away = Paths(self.mesh).between(loop, limit)[:, loop]
        i, j = np.nonzero(np.isfinite(away))
        i, j = i[i < j], j[i < j]
        p = self.flat[loop]
        q = np.roll(p, -1, axis=0)
        swept = np.r_[0.0, np.cumsum(p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1])]
        part = swept[j] - swept[i] + p[j, 0] * p[i, 1] - p[i, 0] * p[j, 1]
        share = part / swept[-1]
        real = np.flatnonzero(np.minimum(share, 1.0 - share) >= _SHARE)
        if not real.size:
            return limit, None
        k = int(real[away[i, j][real].argmin()])
        width = float(away[i[k], j[k]])
        return (width, (int(loop[i[k]]), int(loop[j[k]]))) if width < limit else (limit, None)


def too_small(
    parts: Sequence[Sheet], area: float, size: float, place: str, names: Sequence[str] = ()
) -> dict[Code, Measurement]:
    """Measure parts that are joined to others, to find those that nobody would make.

    Their areas are relative to that of the design, and their mean widths to its size.
    """
    areas = np.array([metrics.area(part.mesh) for part in parts])
    widths = np.array([part.mean_width for part in parts])
    return {
        Code.SMALL: Measurement(areas / area, place, names),
        Code.NARROW: Measurement(widths / size, place, names),
    }


def least_neck(size: float) -> float:
    """Return the width that a part that is joined to others has everywhere, of a design's size."""
    return (Code.NARROW.info.limit or 0.0) * size


def laid(mesh: Mesh, formulation: str = "strain") -> Sheet | None:
    """Lay a disk flat by a formulation of the flatten task; None where that fails."""
    pattern = lay_out(mesh, formulation=formulation)
    if pattern is None or pattern.is_cut or not np.isfinite(pattern.flat).all():
        return None
    return Sheet(mesh, pattern.flat)


def flattened(mesh: Mesh) -> Sheet | None:
    """Lay a disk flat with the least largest strain; None where that fails."""
    found: list[Sheet] = []
    for formulation in ("minimax", "strain"):
        sheet = laid(mesh, formulation)
        if sheet is None:
            continue
        found.append(sheet)
        if found[0].strain > _ISOMETRIC:
            break
    return min(found, key=lambda sheet: sheet.strain, default=None)

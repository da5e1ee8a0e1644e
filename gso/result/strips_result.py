"""The result of strips: an exactly developable surface, with meshes and files of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from gso.mesh import Mesh
from gso.pattern import Folded
from gso.result.result import Result
from gso.typing import AnyPath, Ints, Keywords

if TYPE_CHECKING:
    from gso.metrics import Distances
    from gso.ruled import Folds
    from gso.ruled.ruled_surface import RuledSurface

#: Largest distance of smooth strips from planar faces, relative to the diagonal, up to which they
#: are written in their place.
_SMOOTHED = 0.04


@dataclass(repr=False)
class StripsResult(Result):
    """Outcome of :func:`gso.strips`.

    Attributes
    ----------
    ruled : RuledSurface
        The surface with its rulings, creases and exact pattern. `mesh` is its mesh, `pattern` its
        unrolling, and :meth:`on_design` has the design's vertices moved onto it.
    pieces : Pieces or None
        Where the design was cut: the pieces, of the surface that their strips follow.
    """

    KIND: ClassVar[str] = "strips"

    ruled: RuledSurface = None  # type: ignore[assignment]

    @property
    def rulings(self) -> Folds:
        """The lines to bend along."""
        return self.ruled.rulings

    @property
    def folded(self) -> Folded:
        """The edges of the pattern to bend along."""
        return self.ruled.folded

    @property
    def piece_of_face(self) -> Ints:
        """The piece of each face of `mesh` (m,), for a design in pieces."""
        # A piece without strips is one part.
        last = np.cumsum(np.maximum(self.details["strips"], 1))
        return np.searchsorted(last, self.ruled.strip, "right")

    @property
    def distances(self) -> Distances:
        """Distances all over both surfaces, in both directions, in the mesh's unit."""
        return self.ruled.deviation or self.ruled.distances(self.design)

    @cached_property
    def deviation(self) -> float:
        """The largest of :attr:`distances`."""
        return self.distances.largest

    def on_design(self) -> Mesh:
        """Return the design with its vertices moved onto the strips."""
        return self.design.replaced(self.ruled.moved)

    @cached_property
    def metrics(self) -> dict[str, float]:
        """Metrics of strips, computed at first access; see :data:`gso.metrics.INFO`."""
        from gso.ruled.strip_metrics import strip_metrics

        return strip_metrics(self.design, self.ruled)

    def add_spline(self) -> None:
        """Leave it as it is: strips have splines of their own."""

    def _save_cad(self, path: AnyPath, unit: str) -> None:
        """Write smooth strips to a CAD file, or planar faces where these are not torsal."""
        from gso import io
        from gso.ruled.smooth.smooth_surface import smooth_strips

        io.check_spline(path, unit)
        if self.ruled.untrimmed is None:
            io.save_faces(self.mesh, path, unit=unit)
            self.notes += (
                f"{path} has planar faces: neither strips along lines nor designs that were kept "
                "as they are have smooth surfaces; those made without lines "
                "(RuledOptions(lines=False), --no-lines) have",
            )
            return
        # Constraints may have moved the strips away from the design.
        design = None if "constraints" in self.details else self.design
        strips = smooth_strips(self.ruled, design)
        far = strips.distances[1]
        if strips.is_torsal and far <= _SMOOTHED * self.design.diagonal:
            io.save_patches(strips.patches, path, unit=unit)
            note = (
                f"{path} has smooth strips, whose normals turn by {strips.turning:.2g} degrees at "
                f"most along rulings; they are {far:.3g} {unit} at most from the "
                "planar faces that the pattern belongs to"
            )
        else:
            io.save_faces(self.mesh, path, unit=unit)
            turn = max(strips.turning, strips.kink)
            note = (
                f"{path} has planar faces: smooth strips would be {far:.3g} {unit} from them at "
                f"most, and their normals would turn by {turn:.2g} degrees at rulings"
            )
        self.notes += (note,)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the surface as arrays by name, for files."""
        return self.ruled.arrays()

    @classmethod
    def shape(cls, data: Mapping[str, np.ndarray], design: Mesh) -> Keywords:
        """Return surface and pattern from the arrays of a file, by attribute."""
        from gso.ruled.ruled_surface import RuledSurface

        return cls.attributes(
            RuledSurface.from_arrays(data, design.replaced(data["vertices"]).vertices)
        )

    @staticmethod
    def attributes(surface: RuledSurface) -> Keywords:
        """Return mesh, flat image and pattern of a surface of strips, by attribute."""
        pattern = surface.pattern
        flat = None if pattern.is_cut else pattern.flat
        return {"mesh": surface.mesh, "flat": flat, "pattern": pattern, "ruled": surface}

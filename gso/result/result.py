"""The result of a solve: surface, flat image, metrics, verdict, and how the solve went."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gso.errors import MeshError
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.spline import BSplineSurface
from gso.status import Progress, Status
from gso.typing import Array
from gso.verdict.reason import Reason

if TYPE_CHECKING:
    from gso.cut_pieces import Pieces
    from gso.ruled.fold_lines import Folds
    from gso.ruled.ruled_surface import RuledSurface

#: Largest distance of smooth strips from planar faces, relative to the diagonal, up to which they
#: are written in their place.
_SMOOTHED = 0.04


@dataclass(repr=False)
class Result:
    """Outcome of :func:`gso.tno.optimize`.

    Attributes
    ----------
    task, formulation : str
        The task that was solved, and its formulation.
    design : Mesh
        The input.
    mesh : Mesh
        The optimised surface, vertices in the input's order and unit; for `flatten` the
        pattern at z = 0.
    flat : ndarray, (n, 2), or None
        The flat image, if the solve has one, in the input's unit of length; None if the
        surface was cut open for it.
    pattern : Pattern or None
        The flat pattern as a separate mesh, with the correspondence of its vertices to the
        surface, which may be cut open. For `developable`: the pattern with the least strain that
        was found, from which the strain metrics are computed; None if the surface must be cut
        open first, or no verdict was made.
    cell_scale : ndarray, (m,), or None
        For `conformal`: length of a face's diagonals (of a triangle's sides) in the flat image
        over that on the surface, in the order of the input's faces.
    status : Status
        Why the solve ended; its value is a message.
    iterations : int
        Iterations of all stages.
    energy : dict of str to float
        Weighted objective by term, dimensionless; the values sum to the objective.
    history : list of Progress
        One entry per iteration.
    seconds : dict of str to float
        Time by phase.
    backend : str
        Linear solver of the last stage, and where it ran.
    warm_start : str
        Initial guess of the solve: "cold" for a cold start, "x0", "session", "net"
        (:func:`gso.hybrid.solve`), or the source named by a :class:`gso.tno.Start`.
    reasons : tuple of Reason
        Why the result is not usable for its task, and where, the most severe first; see
        :mod:`gso.verdict`.
    notes : tuple of str
        What was repaired in the input or restricted in the run, and why.
    details : dict
        Numbers specific to the task, such as chosen weights. For `denoise`: "sigma", the
        estimated standard deviation of the noise, in the input's unit; "dof", the effective
        degrees of freedom of each coordinate after smoothing; "order" and "weight". With
        constraints, "constraints": the largest violation of each, in the input's unit. With a
        spline, "spline": its curvature and distances, see :func:`gso.spline.fit.describe_spline`.
        For `developable`, "verdict": largest strain and deviation, and the given limits.
    spline : BSplineSurface or None
        The spline that `mesh` samples, with the option ``variables="surface"``; with several
        components, each has its own.
    components : list of Result
        The results of the components, ordered by their smallest vertex; components joined by
        constraints count as one. Empty for a mesh of one component. In the result of the
        whole mesh, `metrics` are means weighted by area (or maxima, minima, sums:
        :data:`gso.metrics.INFO`) and `energy` is such a mean; `status` is the worst one;
        `iterations` and `seconds` are sums over the solves, where copies of a component are
        solved once.
    names : ndarray of int, (n,), or None
        In the result of a component: indices of its vertices in the whole mesh.
    ruled : RuledSurface or None
        For the formulation "ruled": the surface with its rulings, creases and exact pattern. Then
        `mesh` is a mesh of its own, `pattern` its unrolling, and :meth:`on_design` has the
        design's vertices moved onto it.
    pieces : Pieces or None
        For a design in pieces: the pieces of the result, and the whole surface with its seams
        closed, ``pieces.design``. `design` and `mesh` are cut open along the seams.
    """

    task: str
    formulation: str
    design: Mesh
    mesh: Mesh
    flat: Array | None
    status: Status
    iterations: int = 0
    energy: dict[str, float] = field(default_factory=dict)
    history: list[Progress] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    backend: str = ""
    warm_start: str = "cold"
    notes: tuple[str, ...] = ()
    details: dict[str, Any] = field(default_factory=dict)
    spline: BSplineSurface | None = None
    cell_scale: Array | None = None
    reasons: tuple[Reason, ...] = ()
    pattern: Pattern | None = None
    components: list[Result] = field(default_factory=list)
    names: NDArray[np.int64] | None = None
    ruled: RuledSurface | None = None
    pieces: Pieces | None = None

    def __post_init__(self) -> None:
        if self.pattern is None and self.flat is not None:
            self.pattern = Pattern.whole(self.design, self.flat)

    def __repr__(self) -> str:
        from gso.result.in_words import summary

        return summary(self)

    @property
    def converged(self) -> bool:
        """Whether the status counts as converged."""
        return self.status.converged

    @property
    def usable(self) -> bool:
        """Whether the result is usable for its task: there are no :attr:`reasons` against it.

        In addition, the status must not refuse the result, coordinates must be finite, no cell
        of a flat image inverted, and all components usable. Without a verdict only these count.
        """
        points = self.mesh.vertices if self.pattern is None else self.pattern.flat
        return bool(
            all(part.usable for part in self.components)
            and not self.reasons
            and not (self.status.is_failure or self.status is Status.UNUSABLE)
            and np.isfinite(points).all()
            and not self.metrics.get("flipped_cells", 0)
        )

    @property
    def rulings(self) -> Folds | None:
        """The lines to bend along, for the formulation "ruled"; otherwise None."""
        return None if self.ruled is None else self.ruled.rulings

    def on_design(self) -> Mesh:
        """Return the design with its vertices moved onto the result."""
        return self.mesh if self.ruled is None else self.design.replaced(self.ruled.moved)

    @property
    def grid(self) -> Array | None:
        """The result as (H, W, 3) when the input is a grid, otherwise None."""
        return self.on_design().grid

    @property
    def flat_grid(self) -> Array | None:
        """The flat image as (H, W, 2) when there is one and the input is a grid."""
        if self.flat is None or self.design.grid_index is None:
            return None
        return self.flat[self.design.grid_index]

    @cached_property
    def metrics(self) -> dict[str, float]:
        """Metrics of the task, computed at first access; see :data:`gso.metrics.INFO`."""
        from gso import tasks
        from gso.components import combined
        from gso.metrics import area, strains
        from gso.tasks.evaluation import compute_metrics

        if self.components:
            areas = [area(part.design) for part in self.components]
            return combined([part.metrics for part in self.components], areas)
        if self.ruled is not None:
            from gso.tasks.developable.developable_metrics import ruled_metrics

            return ruled_metrics(self.design, self.ruled)
        task, pattern = tasks.get(self.task), self.pattern
        if task.flat and pattern is not None and pattern.is_cut:
            surface = pattern.surface(self.design)
            return compute_metrics(self.task, surface, pattern.mesh, pattern.flat)
        known = compute_metrics(self.task, self.design, self.mesh, self.flat)
        if pattern is None or task.pattern_metrics is None:
            return known
        surface = pattern.surface(self.mesh)
        if pattern.is_cut:
            known |= task.pattern_metrics(surface, pattern.flat)
        found = strains(surface, pattern.flat)
        return found | {k: v for k, v in known.items() if k not in found}

    def save(self, path: str | PathLike[str], *, unit: str = "mm") -> None:
        """Write the result to a file; the suffix selects the format.

        ``.npz`` stores the whole result, to be read by :meth:`load`. ``.svg`` is the flat
        pattern at scale 1:1, where `unit` is the unit of the mesh's coordinates. ``.step``,
        ``.iges`` and ``.3dm`` are the spline in that unit (see :func:`gso.save_spline`); for a
        ruled surface they are its smooth strips (:func:`gso.smooth_strips`), and where these
        are not torsal its planar faces. The notes say which. Any other suffix of
        :func:`gso.save` is the surface (for `flatten` the pattern at z = 0).
        Labels, materials and texture coordinates that the format cannot store are listed in
        the notes.
        """
        from gso import io
        from gso.result.file import arrays

        suffix = io.suffix_of(path)
        if suffix == ".npz":
            with io.replacing(path) as file:
                np.savez(file, **arrays(self))
        elif suffix == ".svg":
            if self.pattern is None:
                raise MeshError(
                    f"{path}: this result has no flat pattern to write as SVG; a closed surface "
                    "or one with handles must be cut open first, other tasks have none"
                )
            surface = self.mesh if self.task == "developable" else self.design
            outline = self.pattern.surface(surface)
            bends = () if self.ruled is None else self.ruled.bends
            io.save_flat(self.pattern.flat, outline, path, unit=unit, bends=bends)
        elif suffix in io.SPLINE_SUFFIXES and self.ruled is not None:
            self._save_strips(self.ruled, path, unit)
        elif suffix in io.SPLINE_SUFFIXES:
            if any(part.spline is not None for part in self.components):
                raise MeshError(
                    f"{path}: every component has a spline of its own; write them one by one, "
                    "result.components[k].save(...)"
                )
            if self.spline is None:
                raise MeshError(
                    f"{path}: this result is a mesh; solve with the option variables='surface', "
                    "or give its mesh to gso.fit_spline and gso.save_spline"
                )
            io.save_spline(self.spline, path, unit=unit)
        else:
            io.write(self.mesh, path)
        self.notes += tuple(n for n in io.left_out(self.mesh, path) if n not in self.notes)

    def _save_strips(self, ruled: RuledSurface, path: str | PathLike[str], unit: str) -> None:
        """Write a ruled surface to a CAD file."""
        from gso import io
        from gso.ruled.smooth.smooth_surface import smooth_strips

        io.check_spline(path, unit)
        if ruled.untrimmed is None:
            io.save_faces(self.mesh, path, unit=unit)
            self.notes += (f"{path} has planar faces",)
            return
        # Constraints may have moved the strips away from the design.
        design = None if "constraints" in self.details else self.design
        strips = smooth_strips(ruled, design)
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

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Result:
        """Read a result written as ``.npz``; nothing is unpickled.

        Raises
        ------
        MeshError
            The file is missing or damaged, is not a result, or has another format version.
        """
        from gso.result import file

        return file.read(path)

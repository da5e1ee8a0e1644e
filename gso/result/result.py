"""The result of a solve: surface, flat image, metrics, verdict, and how the solve went."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gso.errors import MeshError
from gso.in_browser import show
from gso.mesh import Mesh
from gso.pattern import Folded, Pattern
from gso.short_repr import html_repr
from gso.spline import BSplineSurface
from gso.status import Progress, Status
from gso.typing import AnyPath, Array, Ints, Keywords
from gso.verdict.reason import Reason

if TYPE_CHECKING:
    from gso.cut_pieces import Pieces
    from gso.metrics import Distances
    from gso.ruled import Folds
    from gso.ruled.ruled_surface import RuledSurface


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
        Time by part. Those of the solve are "setup", "evaluate" and "factor" (of the equations)
        and "search" (along lines); "pattern", of `developable`, to lay the result flat; "verdict",
        to judge it; "total", these and what is left.
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
        For `developable`, "verdict": the largest strain and the given limits.
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
    pieces : Pieces or None
        For a design in pieces: the pieces of the result, and the whole surface with its seams
        closed, ``pieces.design``. `design` and `mesh` are cut open along the seams, but for
        strips.
    """

    #: Kind of result, in files and for its verdict; empty for those that are judged by their task.
    KIND: ClassVar[str] = ""

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
    names: Ints | None = None
    pieces: Pieces | None = None

    def __post_init__(self) -> None:
        if self.pattern is None and self.flat is not None:
            self.pattern = Pattern.whole(self.design, self.flat)

    _repr_html_ = html_repr
    show = show

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
    def ruled(self) -> RuledSurface | None:
        """The surface of strips with its rulings, creases and exact pattern; None without."""
        return None

    @property
    def rulings(self) -> Folds | None:
        """The lines to bend strips along; None without strips."""
        return None

    @property
    def folded(self) -> Folded:
        """The edges of the pattern to bend along."""
        return Folded()

    @property
    def piece_of_face(self) -> Ints:
        """The piece of each face of `mesh` (m,), for a design in pieces."""
        return np.zeros(len(self.mesh.faces), np.int64)

    @property
    def distances(self) -> Distances:
        """Distances between design and result in both directions, in the mesh's unit."""
        from gso.metrics import surface_distance

        return surface_distance(self.design, self.mesh)

    @cached_property
    def deviation(self) -> float:
        """The largest distance between design and result, both ways, in the mesh's unit."""
        from gso.metrics import largest_distance

        return largest_distance(self.design, self.mesh)

    def on_design(self) -> Mesh:
        """Return the design with its vertices moved onto the result."""
        return self.mesh

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
        from gso.metrics import area, holes, strains
        from gso.tasks import compute_metrics

        if self.components:
            areas = [area(part.design) for part in self.components]
            return combined([part.metrics for part in self.components], areas)
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
        found = strains(surface, pattern.flat) | holes(surface)
        return found | {k: v for k, v in known.items() if k not in found}

    def save(self, path: AnyPath, *, unit: str = "mm") -> None:
        """Write the result to a file; the suffix selects the format.

        ``.npz`` stores the whole result, to be read by :meth:`load`. ``.svg`` is the flat
        pattern at scale 1:1, where `unit` is the unit of the mesh's coordinates. ``.step``,
        ``.iges`` and ``.3dm`` are the spline in that unit (see :func:`gso.save_spline`); for a
        ruled surface they are its smooth strips (:func:`gso.smooth_strips`), and where these
        are not torsal, or strips run along lines, its planar faces. The notes say which. Any other
        suffix of :func:`gso.save` is the surface (for `flatten` the pattern at z = 0).
        Labels, materials and texture coordinates that the format cannot store are listed in
        the notes.
        """
        from gso import io
        from gso.result.file import arrays

        suffix = io.suffix_of(path)
        if suffix == ".npz":
            whole: Keywords = arrays(self)
            with io.replacing(path) as file:
                np.savez(file, **whole)
        elif suffix == ".svg":
            if self.pattern is None:
                raise MeshError(
                    f"{path}: this result has no flat pattern to write as SVG; a closed surface "
                    "or one with handles must be cut open first, other tasks have none"
                )
            surface = self.mesh if self.task == "developable" else self.design
            outline = self.pattern.surface(surface)
            bends = self.folded.lines(self.pattern.flat)
            io.save_flat(self.pattern.flat, outline, path, unit=unit, bends=bends)
        elif suffix in io.SPLINE_SUFFIXES:
            self._save_cad(path, unit)
        else:
            io.write(self.mesh, path)
        self.notes += tuple(n for n in io.left_out(self.mesh, path) if n not in self.notes)

    def add_spline(self) -> None:
        """Fit a spline to the surface where the solve made none, for CAD files."""
        from gso.spline.fit import fit_spline

        if self.spline is None:
            self.spline = fit_spline(self.mesh)
            far = max(self.spline.gap or (0.0,))
            self.notes += (f"the spline was fitted to the result, {far:.3g} away at most",)

    def _save_cad(self, path: AnyPath, unit: str) -> None:
        """Write the surface to a CAD file."""
        from gso import io

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

    def arrays(self) -> dict[str, np.ndarray]:
        """Return flat image and pattern as arrays by name, for files."""
        out: dict[str, np.ndarray] = {} if self.flat is None else {"flat": self.flat}
        if self.pattern is not None and self.pattern.flat is not self.flat:
            out |= self.pattern.arrays()
        return out

    @classmethod
    def shape(cls, data: Mapping[str, np.ndarray], design: Mesh) -> Keywords:
        """Return surface, flat image and pattern from the arrays of a file, by attribute.

        Raises
        ------
        KeyError, ValueError
            Arrays are missing or do not fit each other.
        """
        flat = data.get("flat")
        if flat is not None and flat.shape != (len(design.vertices), 2):
            raise ValueError(f"flat is an array {flat.shape}, not {(len(design.vertices), 2)}")
        pattern = Pattern.from_arrays(data, design) if "pattern_flat" in data else None
        same = len(data["vertices"]) == len(design.vertices)
        mesh = design.replaced(data["vertices"]) if same or pattern is None else pattern.mesh
        return {"mesh": mesh, "flat": flat, "pattern": pattern}

    @classmethod
    def load(cls, path: AnyPath) -> Result:
        """Read a result written as ``.npz``; nothing is unpickled.

        Raises
        ------
        MeshError
            The file is missing or damaged, is not a result, or has another format version.
        """
        from gso.result import file

        return file.read(path)

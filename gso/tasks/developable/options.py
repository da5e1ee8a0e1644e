"""Settings of the formulation "curvature"."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

from gso.errors import OptionError
from gso.tasks.options import Options as BaseOptions

#: Largest strain of a developable surface when only a maximum deviation was asked for.
DEVELOPABLE = 5e-3
#: Limits of a result that was asked for without any: the largest strain of its pattern, and the
#: largest distance over the design's size (:attr:`gso.Mesh.size`). Paper and card tear at strains
#: of 2 to 4 %, plywood at 1 %. Soft aluminium and steel sheet stretch by 20 % and more before they
#: break, but beyond 2 % they need a press.
SHEET, NEAR = 0.02, 0.05
#: Factors on the weights for a surface that is cut into pieces.
_PIECES_FAIRNESS, _PIECES_CURVATURE = 2.0, 3.0


@dataclass(frozen=True)
class Options(BaseOptions):
    """Settings of the developable task; lengths in units of the design's unit ball.

    Attributes
    ----------
    w_curvature : float
        Weight of mean |K| for a design with typical mean |K|; the weight used decreases slowly
        with the design's mean |K|.
    w_holes : float
        Factor on that weight for holes, whose defects would strain the pattern; with 1 a defect of
        a hole costs as much as that of a vertex, and the result is farther from the design.
    w_fairness : float
        Weight of the mean squared second derivative for a design with typical bending; the
        weight used decreases with the design's bending.
    w_proximity : float
        Weight of the displacement from the design.
    reach : float, optional
        Distances from the design beyond this, and displacements of its boundary, are penalised by
        the square of the excess; less where the design is thin. In the design's unit; components
        are then weighed as for the whole mesh.
    w_reach : float
        Weight of that.
    w_facing : float
        Weight of a barrier against triangles that turn away from those of the design.
    w_elongation : float
        Weight of edges much shorter or longer than in the design. Boundary edges are penalised
        from a change of length of 8 % on.
    quadratic_below : float
        Displacements below this are penalised quadratically, larger ones linearly.
    tangential : float
        Factor on the tangential part of a displacement.
    eps : float
        Smoothing of |K|: curvature well below this is penalised quadratically.
    variables : {"normal", "free", "spline", "surface"}
        Unknowns of the last stage: offsets along normals, free vertices, or (on grids) a
        coarse bicubic field of offsets, which cannot crumple. With "surface" (on grids) they are
        the control points of a bicubic B-spline surface, returned as the result's `spline`.
        Except with "surface", `max_deviation` implies offsets along normals. Constraints imply
        free vertices; on meshes that are not grids, where only positions of vertices are given and
        coarser meshes come first, offsets along normals and tangents in turn.
    controls : int
        "spline", "surface": control points along each side; fewer on small grids.
    coarse_iterations : int
        Iterations on the coarsest grid; half as many with `x0`, one and a half times as many on
        meshes that are not grids.
    coarse_size : int
        Largest side of the coarsest grid without `x0`; a grid that small is halved once.
    free_size : int
        Largest side of the coarser grids on which vertices are free; on finer ones the unknowns
        are normal offsets, which are cheaper. With "free" the vertices are free on all of them.
        With `x0` it is the largest side of the coarsest grid, the only one with free vertices.
    between_iterations : int
        Iterations on each grid between the coarsest and the design's own.
    refining_iterations : int
        Iterations on the design's own grid where it follows two or three coarser ones without
        `x0`; fewer where it follows more.
    coarse_vertices : int
        Meshes that are not grids are solved on coarser meshes of triangles first if they have more
        vertices than this, or than four times as many under constraints.
    by_component : bool
        Weigh each component by its own size and curvature, where constraints join several. If
        False, use the size and curvature of the whole mesh, as for the pieces of one design:
        components without interior vertices then stay as they are.
    developable_below : float
        A design whose mean |K| is below this is developable already and is returned unchanged,
        unless there are constraints, `x0` or variables "surface".
    """

    PRESETS: ClassVar[dict[str, dict[str, Any]]] = {
        "fast": {
            "iterations": 4,
            "coarse_iterations": 10,
            "between_iterations": 5,
            "refining_iterations": 3,
            "free_size": 24,
            "w_curvature": 1.1e-3,
            "w_fairness": 8.2e-6,
        },
        "balanced": {},
        "accurate": {
            "iterations": 14,
            "coarse_iterations": 12,
            "between_iterations": 6,
            "refining_iterations": 10,
            "variables": "free",
            "w_curvature": 8.9e-4,
            "w_fairness": 9.0e-6,
        },
    }

    iterations: int = 12
    method: str = "levenberg-marquardt"
    w_curvature: float = 9.0e-4
    w_holes: float = 0.15
    w_fairness: float = 7.8e-6
    w_proximity: float = 1.0
    reach: float | None = None
    w_reach: float = 100.0
    w_facing: float = 0.0
    w_elongation: float = 0.1
    quadratic_below: float = 0.006
    tangential: float = 0.5
    eps: float = 0.007
    variables: str = "normal"
    controls: int = 16
    coarse_iterations: int = 12
    coarse_size: int = 24
    free_size: int = 32
    between_iterations: int = 4
    refining_iterations: int = 6
    coarse_vertices: int = 10_000
    by_component: bool = True
    developable_below: float = 1e-3

    def in_unit(self, unit: float) -> Options:
        return self if self.reach is None else replace(self, reach=self.reach / unit)

    def for_pieces(self) -> Options:
        """Return settings with more fairness: seams take up what single surfaces need creases for.

        More weight on the curvature then keeps the strain as small.
        """
        return replace(
            self,
            by_component=False,
            w_fairness=_PIECES_FAIRNESS * self.w_fairness,
            w_curvature=_PIECES_CURVATURE * self.w_curvature,
        )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.variables not in ("normal", "free", "spline", "surface"):
            raise OptionError(
                f"variables is {self.variables!r}; take 'normal', 'free', 'spline' or 'surface'"
            )
        if self.controls < 4:
            raise OptionError(f"controls is {self.controls}; it must be 4 or more")
        if self.reach == 0:
            raise OptionError("reach is 0; give a distance, or max_deviation")
        if not (self.eps > 0 and self.quadratic_below > 0):
            raise OptionError("eps and quadratic_below must be positive")

"""Make a surface exactly developable: strips of planar quads between straight rulings.

The mean squared distance between the design and the strips is minimised, in both directions, with
small weights on the smoothness of the strips. See :mod:`gso.ruled`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar

import numpy as np

from gso import parametrization
from gso.constraints import Compiled
from gso.constraints.equations import OnPlane, Pins, Relations, Straight
from gso.errors import MeshError, OptionError
from gso.mesh.normals import vertex_normals
from gso.ruled.conditions import Conditions
from gso.ruled.strip_mirror import Mirror
from gso.status import Progress, Status
from gso.tasks.base import Plan, Solution
from gso.tasks.developable.analysis import Analysis
from gso.tasks.options import Options as BaseOptions
from gso.tasks.request import Request
from gso.typing import Array
from gso.unknowns import Layout

#: Surfaces whose normals give first rulings.
_STARTS = ("design", "curvature")
#: Distance of vertices from their places, relative to the diagonal, that counts as zero.
_SAME = 1e-9
#: Angle of a fold, in degrees, that a note is made of.
_SHARP = 45.0
#: Radius that the solve keeps, relative to the smallest one.
_SAFE = 1.6


@dataclass(frozen=True)
class Options(BaseOptions):
    """Settings of the developable task's formulation "ruled".

    Attributes
    ----------
    strips : int, "auto" or None
        Number of strips side by side, which share crease curves and are separate parts of the
        pattern. "auto": as few as hold `max_deviation` and `max_crease`, at most `max_strips`.
        None: "auto" where there is such a bound, else 1.
    max_strips : int
        Largest number of strips that "auto" tries.
    rulings : int
        Number of rulings of a strip, some of them outside the outline.
    flats : bool
        Whether the strip may branch at flat triangles: a tree of strips, still one sheet. Only
        for a single strip.
    max_crease : float or None
        Largest angle at a crease between strips, in degrees.
    min_radius : float or None
        Smallest radius of the bends, in the unit of the mesh; a result with a smaller one is not
        usable.
    starts : tuple of str
        Surfaces whose normals give first rulings: "design", "curvature" (the result of that
        formulation). The best result of all is kept. A warm start `x0` replaces "curvature".
    """

    PRESETS: ClassVar[dict[str, dict[str, Any]]] = {
        "fast": {"starts": ("design",)},
        "balanced": {},
        "accurate": {"rulings": 65},
    }

    strips: int | str | None = None
    max_strips: int = 64
    rulings: int = 33
    flats: bool = False
    max_crease: float | None = None
    min_radius: float | None = None
    starts: tuple[str, ...] = _STARTS

    def __post_init__(self) -> None:
        from gso.ruled.solve import MOST

        strips = self.strips
        if isinstance(strips, str) or strips is None:
            if strips not in ("auto", None):
                raise OptionError(f"strips is {strips!r}; it must be a number, 'auto' or None")
        elif not (isinstance(strips, int | np.integer) and 1 <= strips <= MOST):
            raise OptionError(f"strips is {strips!r}; it must be 1 to {MOST}, 'auto' or None")
        if not 1 <= self.max_strips <= MOST:
            raise OptionError(f"max_strips is {self.max_strips}; it must be 1 to {MOST}")
        if self.flats and strips not in (1, None):
            raise OptionError(
                f"flats=True is for a single strip, but strips is {strips!r}; leave one of them out"
            )
        super().__post_init__()
        if not 5 <= self.rulings <= 513:
            raise OptionError(f"rulings is {self.rulings}; it must be 5 to 513")
        if not self.starts or set(self.starts) - set(_STARTS):
            raise OptionError(f"starts is {self.starts!r}; it must name some of {_STARTS}")

    def in_unit(self, unit: float) -> Options:
        return self if self.min_radius is None else replace(self, min_radius=self.min_radius / unit)


def plan(
    analysis: Analysis,
    request: Request[Options],
    before: Callable[[Analysis, Request[Options]], Plan],
) -> Plan:
    """Plan the solve of `before` where its result is wanted, and then that for the strips.

    Raises
    ------
    MeshError
        The design is no disk, possibly with holes.
    OptionError
        There are constraints other than positions.
    """
    compiled = analysis.constraints
    plane = _mirror(compiled)
    for part in compiled.parts:
        mirrored = plane is not None and isinstance(part, OnPlane | Relations)
        if compiled.flat or not (isinstance(part, Pins | Straight) or mirrored):
            raise OptionError(
                f"{compiled.names[part.owner]}: the formulation 'ruled' takes Fixed, "
                "FixedBoundary, Handle, Ruling and one SymmetryPlane; leave it out, or take "
                "'curvature'"
            )
    if plane is not None and request.options.flats:
        raise OptionError("flats=True does not go with a SymmetryPlane; leave one of them out")
    mesh = analysis.mesh
    if not parametrization.flattens(mesh) or analysis.opened.cut is not None:
        raise MeshError(
            "the formulation 'ruled' needs a surface with a boundary that does not close around "
            "itself and has no handles; cut it open, or take 'curvature'"
        )
    made = replace(request, max_displacement=None)
    if request.x0 is not None:
        first = before(analysis, replace(made, x0=None))
        first = replace(first, start=request.x0.ravel(), stages=())
    elif "curvature" in request.options.starts or not compiled.empty:
        first = before(analysis, made)
    else:
        first = Plan(Layout.of(len(mesh.vertices), "surface"), mesh.vertices.ravel(), ())
    return replace(first, convert=partial(_converted, analysis, request), details={}, notes=())


def _converted(
    analysis: Analysis,
    request: Request[Options],
    before: Solution,
    tell: Callable[[Progress], bool],
) -> Solution:
    """Solve for the strips from the normals of the design and of another surface."""
    from gso.ruled.domain import Domain
    from gso.ruled.solve import Wanted, solve

    options: Options = request.options
    size = analysis.mesh.diagonal
    compiled = analysis.constraints
    pins, targets = compiled.pinned_positions
    # Where constraints move vertices, the surface that meets them is the design.
    same = np.abs(targets - analysis.mesh.vertices[pins]).max(initial=0.0) <= _SAME * size
    near = analysis.mesh.vertices if same else before.points
    near = _symmetric(compiled, near)
    mesh = analysis.mesh.replaced(near / size)
    domain = Domain(mesh, parametrization.begin(mesh).flat)
    starts = {"design": domain.normals} if "design" in options.starts else {}
    if not np.array_equal(before.points, near):
        name = "curvature" if request.x0 is None else "x0"
        starts[name] = vertex_normals(analysis.mesh.replaced(before.points))
    bound = request.max_displacement
    bounded = bound is not None or options.max_crease is not None
    strips: Any = options.strips
    if strips is None:
        strips = "auto" if bounded and not options.flats else 1
    wanted = Wanted(
        None if strips == "auto" else int(strips),
        options.rulings,
        options.flats,
        None if bound is None else bound / size,
        None if options.max_crease is None else float(np.radians(options.max_crease)),
        None if options.min_radius is None else options.min_radius / size,
        options.max_strips,
    )
    beams = [part for part in compiled.parts if isinstance(part, Straight)]
    plane = _mirror(compiled)
    conditions = Conditions(
        points=targets / size if len(pins) else None,
        lines=np.array([b.ends for b in beams]) / size if beams else None,
        chords=np.array([domain.flat[b.ids[[0, -1]]] for b in beams]) if beams else None,
        mirror=None if plane is None else Mirror(plane.normal, plane.offset / size),
        radius=None if wanted.min_radius is None else _SAFE * wanted.min_radius,
    )
    stopped = False

    def told(iteration: int, iterations: int, energy: float, count: int) -> bool:
        nonlocal stopped
        progress = Progress(0, 1, iteration, iterations, energy, {}, 1.0, f"strips: {count}")
        stopped = not tell(progress)
        return not stopped

    found, tried = solve(
        domain,
        starts or {"design": domain.normals},
        wanted,
        told,
        conditions,
    )
    if found is None:
        return replace(before, status=Status.CANCELLED)
    surface = found.surface.transformed(lambda points: size * points, size, lambda rows: rows)
    moved = surface.moved.copy()
    for beam in beams:
        moved[beam.ids] = surface.on_ruling(beam.ends, moved[beam.ids])
    if conditions.mirror is not None and conditions.mirror.partners(found.ends) is not None:
        # Vertices on the plane may be as near to a point as to its image.
        moved = _symmetric(compiled, moved)
    surface = replace(surface, moved=moved)
    notes = before.notes
    sharpest = np.degrees(surface.rulings.largest_angle)
    if sharpest > _SHARP:
        notes += (
            f"the surface folds by {sharpest:.0f} degrees at one ruling; more strips, or "
            "min_radius, bend it more gently",
        )
    missed = (bounded or wanted.min_radius is not None) and not wanted.met(found)
    status = Status.TARGET_MISSED if missed else Status.CONVERGED
    return replace(
        before,
        blocks={"surface": surface.moved},
        coordinates=surface.moved.ravel(),
        status=Status.CANCELLED if stopped else status,
        energy={"distance": found.mean},
        details={"strips": surface.strips, "rulings_from": found.start, "tried": _said(tried)},
        ruled=surface,
        notes=notes,
        stage=None,
    )


def _mirror(compiled: Compiled) -> OnPlane | None:
    """Return the plane of a single symmetry; None if there is none."""
    owners = {p.owner for p in compiled.parts if isinstance(p, Relations) and not p.is_glue}
    planes = [p for p in compiled.parts if isinstance(p, OnPlane) and p.owner in owners]
    return planes[0] if len(owners) == len(planes) == 1 else None


def _symmetric(compiled: Compiled, points: Array) -> Array:
    """Return points moved to the nearest symmetric places, if there is a plane of symmetry."""
    out: Array = points.copy()
    for part in compiled.parts if _mirror(compiled) is not None else ():
        if isinstance(part, Relations):
            one, other = points[part.first], points[part.second]
            image = part.anchor + (other - part.anchor) @ part.matrix
            out[part.first] = 0.5 * (one + image)
            out[part.second] = part.anchor + (out[part.first] - part.anchor) @ part.matrix.T
        elif isinstance(part, OnPlane):
            off = (points[part.ids] - part.anchor) @ part.normal
            out[part.ids] -= np.outer(off, part.normal)
    return out


def _said(tried: dict[int, float]) -> str:
    """Format the largest distances by number of strips."""
    return "; ".join(f"{k}: {100 * far:.3g} %" for k, far in sorted(tried.items()))

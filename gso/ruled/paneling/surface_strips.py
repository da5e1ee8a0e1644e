"""Strips of one surface: first rulings from its normals and from those of a developable surface."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from gso import parametrization
from gso.constraints import Compiled, OnPlane, Pins, Relations, Straight, compile_constraints
from gso.errors import MeshError, OptionError
from gso.geometry.polygon import rectangle
from gso.geometry.vectors import unit
from gso.mesh import Mesh, vertex_normals
from gso.pipeline import Case, Run
from gso.pipeline.user_result import pack, record_violations
from gso.result import Result, StripsResult
from gso.ruled.conditions import Conditions
from gso.ruled.domain import Domain
from gso.ruled.lines import EXACT, LineStrips, grid_copies
from gso.ruled.paneling.made_strips import made_strips
from gso.ruled.paneling.options import RULED, Options
from gso.ruled.paneling.strips_request import StripsRequest
from gso.ruled.ruled_surface import RuledSurface
from gso.ruled.solve import Found, Wanted, solve
from gso.ruled.strip_mirror import Mirror
from gso.status import Progress, Status
from gso.tasks.base import Solution
from gso.tasks.developable import Options as DevelopableOptions
from gso.tasks.request import Request
from gso.tasks.start import Start
from gso.typing import Array

#: Angle of lines to the direction that they are to follow, in degrees, that a note is made of.
_OFF = 25.0
#: Distance of vertices from their places, relative to the diagonal, that counts as zero.
_SAME = 1e-9
#: Note on strips of spirals.
_DIVIDED = ("strips are divided across, so that no part overlaps itself in the plane",)
#: Radius that the solve keeps, relative to the smallest one.
_SAFE = 1.6


def wanted(options: Options, bound: float | None, size: float) -> Wanted:
    """Return what strips have to be, with lengths relative to a size."""
    number = options.number
    if options.strips is None and bound is None and options.max_crease is None:
        number = 1
    return Wanted(
        number,
        options.rulings,
        options.flats,
        None if bound is None else bound / size,
        None if options.max_crease is None else float(np.radians(options.max_crease)),
        None if options.min_radius is None else options.min_radius / size,
        options.max_strips,
    )


def check_connected(mesh: Mesh) -> None:
    """Raise a MeshError if a mesh has several components."""
    count = len(np.unique(mesh.components[mesh.used]))
    if count > 1:
        raise MeshError(
            f"strips take one surface, and this mesh has {count} components: make those of each on "
            "its own, or take gso.fabricate, which makes the parts of all"
        )


def check_whole(mesh: Mesh) -> None:
    """Raise a MeshError unless a surface is a disk, possibly with holes."""
    check_connected(mesh)
    if not parametrization.flattens(mesh) or parametrization.opened(mesh).cut is not None:
        raise MeshError(
            "strips need a surface with a boundary that does not close around itself and has no "
            "handles; cut it open (gso.cut), give max_deviation, so that it is cut into pieces, or "
            "take the formulation 'curvature'"
        )


def is_whole(mesh: Mesh) -> bool:
    """Tell whether a mesh is one surface that can be made of strips."""
    try:
        check_whole(mesh)
    except MeshError:
        return False
    return True


def of_surface(design: Mesh, request: StripsRequest, bound: float | None) -> Result:
    """Make strips near a surface, without a verdict.

    Parameters
    ----------
    design : Mesh
        A disk, possibly with holes; see :func:`check_whole`.
    request : StripsRequest
    bound : float or None
        Largest distance from the design, in its unit, that the number of strips is chosen for.

    Returns
    -------
    Result
        A :class:`StripsResult`, or none if the callback ended the solve before there were strips.

    Raises
    ------
    OptionError
        A constraint is none that strips can meet.
    """
    options = request.options
    case = case_of(design, request)
    frame, compiled = case.frame, case.analysis.constraints
    _check(compiled, options)
    begun, run = _begin(case, request)
    if begun.status is Status.CANCELLED:
        return pack(run, begun)
    clock = time.perf_counter()
    size, mesh, near = frame.mesh.diagonal, frame.mesh, begun.points
    pins, targets = compiled.pinned_positions
    # Where constraints move vertices, the surface that meets them is the design.
    same = np.abs(targets - mesh.vertices[pins]).max(initial=0.0) <= _SAME * size
    target = _symmetric(compiled, mesh.vertices if same else near)
    scaled = mesh.replaced(target / size)
    domain = Domain(scaled, parametrization.begin(scaled).flat)
    starts = {"design": domain.normals} if "design" in options.starts else {}
    if not np.array_equal(near, target):
        name = "curvature" if request.start.points is None else "x0"
        starts[name] = vertex_normals(mesh.replaced(near))
    aim = wanted(options, bound, size * frame.scale)
    conditions = _conditions(compiled, domain, size, aim.min_radius)
    stopped = False

    def told(iteration: int, iterations: int, energy: float, count: int) -> bool:
        nonlocal stopped
        progress = Progress(0, 1, iteration, iterations, energy, {}, 1.0, f"strips: {count}")
        stopped = not request.goes_on(progress)
        return not stopped

    found, tried = solve(domain, starts or {"design": domain.normals}, aim, told, conditions)
    if found is not None and not stopped and _parts(found) > found.surface.strips:
        # The outline cuts winding strips in several.
        other, more = solve(domain, {"parallel": _across(domain)}, aim, told, conditions)
        if other is not None and _preference(aim, other) < _preference(aim, found):
            found, tried = other, more
    if found is None:
        begun.status = Status.CANCELLED
        return pack(run, begun)
    status = (
        Status.TARGET_MISSED if aim.bounded and not aim.met(found.surface) else Status.CONVERGED
    )
    surface = _placed(found, compiled, conditions, size)
    moved = surface.moved
    surface = surface.transformed(
        frame.frame.to_user, frame.scale, lambda rows: frame.back("surface", rows)
    )
    result = StripsResult(
        task="developable",
        formulation=RULED,
        design=design,
        status=Status.CANCELLED if stopped else status,
        iterations=run.iterations,
        energy={"distance": found.mean},
        history=run.history,
        seconds=run.timings.as_dict() | {"strips": time.perf_counter() - clock},
        backend=begun.backend,
        warm_start="cold" if request.start.points is None else request.start.source,
        notes=design.notes + (_DIVIDED if found.divided else ()),
        details={"strips": surface.strips, "rulings_from": found.start, "tried": _said(tried)},
        **StripsResult.attributes(surface),
    )
    record_violations(case, moved, result)
    return result


def unsolved(design: Mesh, request: StripsRequest) -> Result:
    """Return a design for which the callback ended the solve before there were strips."""
    options = replace(request.options, starts=("design",))
    own = replace(request, options=options, constraints=(), start=Start(None))
    begun, run = _begin(case_of(design, own), own)
    begun.status = Status.CANCELLED
    return pack(run, begun)


def _parts(found: Found) -> int:
    """Return the number of parts of the strips."""
    return int(found.surface.pattern.mesh.components.max()) + 1


def _preference(aim: Wanted, found: Found) -> tuple[bool, int, int, float]:
    """Sort key: what meets the bounds first, then fewer parts, then what is nearer."""
    return not aim.met(found.surface), _parts(found), *found.order


def _across(domain: Domain) -> Array:
    """Return the normals of the surface, turned across the short side of its flat image."""
    angle, _ = rectangle(domain.flat)
    flat = domain.flat - domain.flat.mean(axis=0)
    points = domain.mesh.vertices - domain.mesh.vertices.mean(axis=0)
    along = np.array([-np.sin(angle), np.cos(angle)]) @ np.linalg.lstsq(flat, points, rcond=None)[0]
    along = along / np.linalg.norm(along)
    return unit(domain.normals - np.outer(domain.normals @ along, along))


def lines_of(design: Mesh, request: StripsRequest) -> LineStrips | None:
    """Return the strips along a design's lines, not solved yet; None where there are no lines.

    Parameters
    ----------
    design : Mesh
        One surface with a boundary: of quads, possibly with holes or closed around; or a disk.
    request : StripsRequest
        Without constraints.
    """
    if not design.boundary_loops:
        return None
    size, centre = design.diagonal, design.frame.centre

    def told(count: int) -> bool:
        progress = Progress(0, 1, 0, 1, 0.0, {}, 1.0, f"strips along lines: {count}")
        return request.goes_on(progress)

    mesh = design.replaced((design.vertices - centre) / size)
    along = None if request.along is None else request.along.moved(centre, size)
    if along is None:
        lines = LineStrips(mesh, told, lambda: grid_copies(mesh))
    else:
        ways = along.directions(Mesh(mesh.vertices, mesh.triangles))
        lines = LineStrips(mesh, told, lambda: grid_copies(mesh, ways), along.directions)
    return lines if lines.choices else None


def unaligned(lines: LineStrips | None, number: int | None) -> str:
    """Return why no strips run along a direction."""
    if lines is not None and number is not None and not lines.least <= number <= lines.most:
        return (
            f"{number} strips are too {'few' if number < lines.least else 'many'} along the given "
            f"direction; ask for {lines.least} to {lines.most}"
        )
    return (
        "no strips run along the given direction: this takes one component of quads, or a disk or "
        "a tube; leave `along` out"
    )


def along_lines(
    design: Mesh,
    request: StripsRequest,
    lines: LineStrips,
    *,
    most: int | None = None,
    narrow: tuple[int, float] | None = None,
) -> Result | None:
    """Make strips along the design's own lines, without a verdict; None where there are none.

    Parameters
    ----------
    design : Mesh
    request : StripsRequest
    lines : LineStrips
        Those of the design.
    most : int, optional
        Largest number of strips; 0 for the design as it is, where strips follow it exactly.
    narrow : (int, float), optional
        Number of the family of lines that they run along, and their largest width.
    """
    options, clock = request.options, time.perf_counter()
    aim = wanted(options, request.max_deviation, design.diagonal)
    if narrow is not None:
        far = np.inf if aim.max_deviation is None else aim.max_deviation
        found = lines.narrow(narrow[0], narrow[1] / design.diagonal, far, most)
    elif most == 0:
        found = lines.as_it_is(aim)
    elif options.flats or (aim.strips == 1 and lines.predicted(1) > EXACT):
        found = None
    elif aim.strips is None:
        found = lines.within(aim if most is None else replace(aim, most=min(most, aim.most)))
    else:
        found = lines.strips(aim.strips)
    if found is None:
        return None
    size, centre = design.diagonal, design.frame.centre
    surface = found.surface.transformed(
        lambda points: size * points + centre, size, lambda rows: rows
    )
    met = not aim.bounded or aim.met(found.surface)
    status = Status.CONVERGED if met else Status.TARGET_MISSED
    tried = {k: one.surface.farthest for k, one in lines.results.items()}
    return made_strips(
        design,
        surface,
        Status.CANCELLED if lines.stopped else status,
        found.start,
        begun=clock,
        mean=found.mean,
        notes=_off(lines, request) + (_DIVIDED if found.divided else ()),
        tried=_said(tried),
    )


def _off(lines: LineStrips, request: StripsRequest) -> tuple[str, ...]:
    """Return a note if lines are far from the direction that they are to follow."""
    angle = float(np.degrees(np.arccos(min(lines.aligned, 1.0))))
    if request.along is None or angle <= _OFF:
        return ()
    return (f"strips run at {angle:.0f} degrees to the given direction: no lines are nearer to it",)


def case_of(design: Mesh, request: StripsRequest) -> Case:
    """Return the solve for a surface near a design whose normals the first rulings follow."""
    options = request.options
    settings = DevelopableOptions(
        method=options.method, backend=options.backend, threads=options.threads
    )
    own = Request("developable", "curvature", settings, start=request.start, verdict=False)
    return Case(own, design, compile_constraints(request.constraints, design, flat=False))


def _begin(case: Case, request: StripsRequest) -> tuple[Solution, Run]:
    """Return a surface near the design whose normals rulings may follow, in the solver's frame."""
    run, points = Run(case, request.callback), case.solver_request.x0
    needed = "curvature" in request.options.starts or not case.constraints.empty
    if points is None and needed:
        solution = run(case.solver_request)
    else:
        points = case.analysis.mesh.vertices if points is None else points
        energy = {"objective": 0.0}
        solution = Solution({"surface": points}, Status.CONVERGED, energy, points.ravel())
    solution.formulation = RULED
    return solution, run


def _check(compiled: Compiled, options: Options) -> None:
    """Raise an OptionError if there are constraints that strips cannot meet."""
    plane = _mirror(compiled)
    for part in compiled.parts:
        mirrored = plane is not None and isinstance(part, OnPlane | Relations)
        if not (isinstance(part, Pins | Straight) or mirrored):
            raise OptionError(
                f"{compiled.names[part.owner]}: strips take Fixed, FixedBoundary, Handle, Ruling "
                "and one SymmetryPlane; leave it out, or take the formulation 'curvature'"
            )
    if plane is not None and options.flats:
        raise OptionError("flats=True does not go with a SymmetryPlane; leave one of them out")


def _conditions(
    compiled: Compiled, domain: Domain, size: float, radius: float | None
) -> Conditions:
    """Return constraints and the smallest radius as conditions, relative to the diagonal."""
    targets = compiled.pinned_positions[1]
    beams = [part for part in compiled.parts if isinstance(part, Straight)]
    plane = _mirror(compiled)
    return Conditions(
        points=targets / size if len(targets) else None,
        lines=np.array([b.ends for b in beams]) / size if beams else None,
        chords=np.array([domain.flat[b.ids[[0, -1]]] for b in beams]) if beams else None,
        mirror=None if plane is None else Mirror(plane.normal, plane.offset / size),
        radius=None if radius is None else _SAFE * radius,
    )


def _placed(found: Found, compiled: Compiled, conditions: Conditions, size: float) -> RuledSurface:
    """Return a surface in the solver's frame, with the design's vertices where constraints say."""
    surface = found.surface.transformed(lambda points: size * points, size, lambda rows: rows)
    moved = surface.moved.copy()
    for part in compiled.parts:
        if isinstance(part, Straight):
            moved[part.ids] = surface.on_ruling(part.ends, moved[part.ids])
    if conditions.mirror is not None and conditions.mirror.partners(found.ends) is not None:
        # Vertices on the plane may be as near to a point as to its image.
        moved = _symmetric(compiled, moved)
    return replace(surface, moved=moved)


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

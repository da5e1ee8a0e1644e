"""One design made of flat panels: strips, nearly developable panels, or the shape as it is."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gso.errors import ConvergenceWarning, GSOError, MeshError, OptionError
from gso.exact import keeps_rows
from gso.mesh import Mesh
from gso.mesh.topology import label_components
from gso.mesh.welding import collapse
from gso.result import StripsResult
from gso.seams.seam_request import SeamRequest
from gso.verdict import crosses_itself
from gso.workshop import constrained, measurements
from gso.workshop.designs import Design
from gso.workshop.exact_panels import exact_panels, rolled
from gso.workshop.fabrication_settings import FabricationSettings
from gso.workshop.matings import alike
from gso.workshop.mixed_panels import mixed
from gso.workshop.panels import Made
from gso.workshop.pattern_panels import of_result, of_surface

#: Length of edges whose ends are joined, relative to the diagonal.
_SAME = 1e-9

Say = Callable[[str], None]


def made(
    given: Design,
    settings: FabricationSettings,
    say: Say = lambda said: None,
    workers: int | None = 0,
) -> Made:
    """Make a design of flat panels within what is asked, or as near to it as possible.

    Parameters
    ----------
    given : Design
    settings : FabricationSettings
    say : callable
        Called with what is being done.
    workers : int, optional
        Number of processes for the pieces; one for each processor when not given.
    """
    constrained.check_formulation(given, settings)
    given = _without_poles(given)

    def named(said: str) -> None:
        say(f"{given.name}: {said}")

    # A design that is developable as it is does not stay where it does not meet constraints.
    stays = constrained.holds(given, given.mesh, soft=True)
    exact = exact_panels(given, settings) if stays else None
    if exact is not None and (
        given.sheet is not None or not exact.reasons or crosses_itself(exact.reasons)
    ):
        return exact
    if len(given.uncut):
        raise OptionError(
            f"{given.name} is not flat or developable as it is, and only then edges can be kept; "
            "leave out keep"
        )
    if given.sheet is not None:
        raise MeshError(
            f"{given.name}: the sheet of {given.sheet:.6g} is not developable, or a face is larger "
            "than the sheets to cut it from"
        )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        other = _divided(given, settings, named, workers, exact)
    if exact is not None or not stays or settings.symmetric:
        return other
    rows = exact_panels(given, settings, rows=True)
    if rows is None or rows.reasons:
        return other
    return rows if other.reasons or keeps_rows(len(rows.panels), len(other.panels)) else other


def _divided(
    given: Design, settings: FabricationSettings, say: Say, workers: int | None, exact: Made | None
) -> Made:
    """Make a design of panels that are kept, changed or both, unless the exact ones are better."""
    # Parts have other vertices, and a plane of symmetry of their own.
    if exact is None and not (settings.symmetric or given.constraints):
        exact = _mixed(given, settings, say, workers)
        if exact is not None and not exact.reasons:
            return exact
    try:
        other = _changed(given, settings, say, workers)
    except GSOError:
        if exact is None:
            raise
        return exact
    return other if exact is None or not other.reasons else exact


def _changed(given: Design, settings: FabricationSettings, say: Say, workers: int | None) -> Made:
    """Make a design of flat panels in the way that was asked for."""
    if _is_gored(given, settings):
        allowed = settings.distance(given.mesh.diagonal)
        one = _of_search(given, given.mesh, settings, allowed, say, workers, gored=True)
        return measurements.checked(one, settings)
    if settings.formulation == "ruled":
        return _strips(given, settings, say, workers)
    if settings.formulation == "flatten":
        return _as_it_is(given, settings, say)
    return _nearly(given, settings, say, workers)


def _is_gored(given: Design, settings: FabricationSettings) -> bool:
    """Tell whether a design is made of gores: bodies of revolution with symmetric seams."""
    if settings.formulation == "flatten" or not settings.symmetric:
        return False
    if given.constraints or any(map(len, (given.kept, given.along, given.avoid))):
        return False
    # This imports SciPy.
    from gso.seams.gores import is_gored

    return is_gored(given.mesh, settings.distance(given.mesh.diagonal))


def _mixed(
    given: Design, settings: FabricationSettings, say: Say, workers: int | None
) -> Made | None:
    """Keep parts of a design, and change the others; None where that is not possible."""

    def kept(part: Design, settings: FabricationSettings) -> Made | None:
        found = exact_panels(part, settings)
        return None if found is None or found.reasons else found

    def changed(part: Design, settings: FabricationSettings) -> Made:
        return _changed(part, settings, say, workers)

    try:
        found = mixed(given, settings, kept, changed)
    except GSOError:
        return None
    return None if found is None else measurements.checked(found, settings)


def _without_poles(given: Design) -> Design:
    """Join the ends of edges without length, as at a grid's poles; seams stay open."""
    mesh = given.mesh
    short = mesh.edge_lengths <= _SAME * mesh.diagonal
    if not short.any():
        return given
    label = label_components(len(mesh.vertices), *mesh.edges[short].T)
    first, number = np.unique(label, return_index=True, return_inverse=True)[1:]
    order = np.argsort(first)
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    new = rank[number]
    left = collapse(mesh.faces, new)
    joined = Mesh(mesh.vertices[first[order]], left.faces)
    if given.constraints:
        a, b = mesh.edges[np.flatnonzero(short)[0]]
        raise OptionError(
            f"constraints: edge {a}-{b} of {given.name} has no length; merge its ends (weld) first"
        )
    ends = {name: new[getattr(given, name)] for name in ("kept", "uncut", "along")}
    ends = {name: ids[ids[:, 0] != ids[:, 1]] for name, ids in ends.items()}
    avoid = np.flatnonzero(np.isin(left.kept, given.avoid))
    return replace(given, mesh=joined, avoid=avoid, **ends)


def _strips(given: Design, settings: FabricationSettings, say: Say, workers: int | None) -> Made:
    """Make strips, of the whole design or of its pieces."""
    # Designs that are developable as they are do not wait for these imports.
    from gso.ruled.paneling.lay_strips import lay_strips
    from gso.ruled.paneling.options import Options
    from gso.ruled.paneling.strips_request import StripsRequest
    from gso.tasks.request import Limits

    options = Options(max_strips=settings.max_strips, min_radius=settings.min_radius)
    allowed = settings.distance(given.mesh.diagonal)
    limits = Limits(allowed, settings.strain)
    request = StripsRequest(
        options,
        limits,
        settings.max_size,
        given.kept,
        given.constraints,
        seams=_seams(given, settings),
        as_it_is=False,
        workers=workers,
        say=say,
    )
    result = lay_strips(given.mesh, request)
    if result.pattern is None:
        raise MeshError("the solve was ended before there were strips")
    record = measurements.of_pattern(given.mesh, result.mesh, result.pattern, settings, allowed)
    numbers = np.atleast_1d(result.details["strips"]).tolist()
    record |= {"pieces": len(numbers), "strips": numbers}
    # Not those of parts that are developable as they are: their folds and bends are meant.
    if isinstance(result, StripsResult) and result.ruled.strain is None:
        record["crease_angle_max"] = float(np.degrees(result.ruled.creases.largest_angle))
    if "seam_gap" in result.details:
        record["seam_gap"] = result.details["seam_gap"]
    far = result.distances
    record |= {"deviation_mean": far.mean, "deviation_max": far.largest}
    one = rolled(given, result, record, settings) or of_result(given.name, result, record)
    return measurements.checked(measurements.bent(replace(one, reasons=result.reasons)), settings)


def _as_it_is(given: Design, settings: FabricationSettings, say: Say) -> Made:
    """Cut a design whose shape stays into pieces, as far as the strain requires."""
    return measurements.checked(_of_search(given, given.mesh, settings, None, say, 0), settings)


def _nearly(given: Design, settings: FabricationSettings, say: Say, workers: int | None) -> Made:
    """Make nearly developable panels: one if that is possible, otherwise several."""
    from gso import parametrization
    from gso.ruled.paneling.light_design import LightDesign
    from gso.tno import optimize

    asked = _seams(given, settings)
    light = LightDesign.of(
        given.mesh,
        settings.distance(given.mesh.diagonal),
        named=given.is_marked or bool(asked.preferences),
    )
    # Seams of a design that is not symmetric are not symmetric: nothing else will do.
    asked.check_symmetric(light.mesh, light.allowed)
    tried = []
    if not len(given.kept) and parametrization.flattens(light.mesh):
        say("as a whole")
        result = optimize(
            light.mesh,
            formulation=settings.formulation,
            max_deviation=light.allowed,
            max_strain=settings.strain,
            constraints=given.constraints,
        )
        if result.pattern is not None:
            allowed = settings.distance(given.mesh.diagonal)
            record = measurements.of_pattern(
                given.mesh, result.mesh, result.pattern, settings, allowed
            )
            one = replace(of_result(given.name, result, record), reasons=result.reasons)
            tried.append(measurements.checked(measurements.bent(one), settings))
            if not tried[0].reasons:
                return tried[0]
    try:
        one = _of_search(given, light.mesh, settings, light.allowed, say, workers)
        tried.append(measurements.checked(one, settings))
    except GSOError:
        if not tried:
            raise
    return min(tried, key=lambda one: (len(one.reasons) > 0, one.record["deviation_max"]))


def _of_search(
    given: Design,
    mesh: Mesh,
    settings: FabricationSettings,
    allowed: float | None,
    say: Say,
    workers: int | None,
    gored: bool = False,
) -> Made:
    """Search for seams within a distance, and make a panel of each piece."""
    from gso.seams import pieces as search

    asked = _seams(given, settings)
    searched = asked.searched(mesh, allowed)
    found = search(
        searched,
        max_strain=settings.strain,
        max_deviation=allowed,
        darts=settings.darts,
        sheet=settings.sheet,
        unit=settings.unit,
        keep=given.kept if len(given.kept) else None,
        as_it_is=False,
        workers=workers,
        callback=say,
        # Constraints are on the vertices of the design.
        **asked.keywords(mesh, searched, gores=not given.constraints),
    )
    if given.constraints and allowed is not None:
        say("constraints")
        found = constrained.solved(given, found, settings, allowed)
    pattern = found.pattern
    if pattern is None:
        said = "; ".join(map(str, found.reasons))
        raise MeshError(f"{given.name}: a piece cannot be laid flat; {said}")
    bound = None if allowed is None else settings.distance(given.mesh.diagonal)
    record = measurements.of_pattern(given.mesh, found.design, pattern, settings, bound)
    record |= {"pieces": len(found)}
    one = of_surface(given.name, found.design, pattern, record, found.folded)
    if gored and len(found.alike()) == 1:
        one = replace(one, matings=alike(one.matings))
    return measurements.bent(replace(one, reasons=found.reasons))


def _seams(given: Design, settings: FabricationSettings) -> SeamRequest:
    """Return what is asked of the seams of a design."""
    return settings.seams(given.along, given.avoid)

"""Pages of results and hulls: patterns as parts, without what fabrications add.

A result without a pattern, such as a denoised surface, is only shown in space.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gso import metrics
from gso.mesh import Mesh
from gso.quantities import millimetres
from gso.result import Result
from gso.result.in_words import measurement
from gso.seams import Segmentation
from gso.typing import Json
from gso.unfolding import Net
from gso.verdict import Reason, ordered
from gso.workshop.certificate import design_record
from gso.workshop.finish import Finish
from gso.workshop.hull import HullPanel
from gso.workshop.names import spelled
from gso.workshop.page import page_html
from gso.workshop.page_data import Shown
from gso.workshop.page_views import Views
from gso.workshop.panels import Made
from gso.workshop.parts import fitted, parts_from
from gso.workshop.pattern_panels import (
    of_components,
    of_net,
    of_pieces,
    of_result,
    of_surface,
    surface_of,
)


def result_page(
    found: Result | Segmentation | Net,
    name: str,
    *,
    unit: str = "mm",
    finish: Finish = Finish(),  # noqa: B008
) -> str:
    """Return the page of a result as HTML: its flat patterns, and its surface in space.

    Parameters
    ----------
    found : Result, Segmentation or Net
        Of :func:`gso.tno.optimize` or :func:`gso.strips`, of :func:`gso.pieces`, or of
        :func:`gso.unfold`.
    name : str
        What the design is called.
    unit : str
        Unit of its coordinates.
    finish : Finish, optional
        What the drawings of parts have: notches, numbers, tabs.

    Raises
    ------
    MeshError
        It has no pattern, but pieces that should have one.
    OptionError
        The unit is not known.

    Examples
    --------
    >>> import numpy as np, gso
    >>> y, turn = np.mgrid[:9, :9] / 8
    >>> arch = np.stack([np.sin(turn), y, np.cos(turn)], axis=-1)
    >>> page = result_page(gso.tno.optimize(arch), "arch", unit="m")
    >>> page.count('class="drawing"')
    1
    """
    scale, name = millimetres(unit), spelled(name)
    if isinstance(found, Result) and found.pattern is None and found.pieces is None:
        return _surface_page(found, name, scale)
    made, design, notes = _made(found, name)
    return _page([(made, design, _records(made.reasons, scale))], notes, scale, finish)


def hull_page(panels: Sequence[HullPanel], allowed: float, *, unit: str = "mm") -> str:
    """Return the page of the panels of a hull as HTML.

    Parameters
    ----------
    panels : sequence of HullPanel
        Of :func:`gso.workshop.hull_panels`.
    allowed : float
        Largest distance of a panel from its lines, in the unit.
    unit : str
        Unit of the coordinates.

    Raises
    ------
    OptionError
        The unit is not known.

    Examples
    --------
    >>> import numpy as np
    >>> from gso.workshop import hull_panels
    >>> x, zero = np.linspace(0.0, 4.0, 9), np.zeros(9)
    >>> keel = np.stack([x, zero, zero], axis=1)
    >>> lines = {"keel": keel, "sheer": keel + [0.0, 1.0, 1.0]}
    >>> page = hull_page(hull_panels(lines), 0.01, unit="m")
    >>> page.count('class="drawing"')
    2
    """
    shown = []
    for panel in panels:
        surface = panel.surface
        record: Json = {"area": metrics.area(surface.mesh), "deviation_mean": 0.0}
        record |= {"deviation_max": 0.0, "strain_max": 0.0}
        made = of_surface(
            spelled(panel.name), surface.mesh, surface.pattern, record, surface.folded
        )
        reasons: list[Json] = [
            {"text": f"panel {panel.name}: {why}"} for why in panel.faults(allowed)
        ]
        shown.append((made, surface.mesh, reasons))
    return _page(shown, (), millimetres(unit), Finish(notches=None))


def _surface_page(result: Result, name: str, scale: float) -> str:
    """Return the page of a result without a pattern: its components in space."""
    surface, known = surface_of(result), _record(result)
    made = Made(name, of_components(name, surface), (), known)
    record: Json = {"name": name, "copies": [name], "reasons": _records(result.reasons, scale)}
    record |= {k: scale * known[k] for k in ("deviation_mean", "deviation_max")}
    certificate = _certificate([record], [measurement(result), *result.notes])
    views = Views([Shown(made, result.design, scale, made.panels)], certificate)
    return page_html(certificate, [], [], views)


def _records(reasons: Sequence[Reason], scale: float) -> list[Json]:
    return [reason.scaled(scale).record("mm") for reason in ordered(reasons)]


def _page(
    shown: Sequence[tuple[Made, Mesh, list[Json]]],
    notes: Sequence[str],
    scale: float,
    finish: Finish,
) -> str:
    """Return the page of what was made of designs, with the reasons against each."""
    parts, records, views = [], [], []
    for made, design, reasons in shown:
        fit = fitted(made, scale, finish)
        own, _ = parts_from(fit, finish)
        record = design_record(fit, own, [made.name]) | {"reasons": reasons}
        for entry in record["parts"]:
            entry["same_as"] = None
        records.append(record)
        parts += own
        views.append(Shown(made, design, scale, fit.panels))
    certificate = _certificate(records, notes)
    return page_html(certificate, parts, [], Views(views, certificate))


def _certificate(records: list[Json], notes: Sequence[str]) -> Json:
    """Return what a page says of designs as a whole, from the records of each."""
    against = [reason for record in records for reason in record["reasons"]]
    return {
        "usable": not against,
        "reasons": against,
        "notes": list(notes),
        "designs": records,
        "sheets": [],
    }


def _made(found: Result | Segmentation | Net, name: str) -> tuple[Made, Mesh, tuple[str, ...]]:
    """Return the panels of a result, the design that they are compared with, and notes."""
    if isinstance(found, Net):
        record: Json = {"area": float(found.areas.sum()), "deviation_max": 0.0}
        return replace(of_net(name, found), record=record), found.mesh, found.notes
    if isinstance(found, Segmentation):
        # Without a change of shape no distance was measured.
        said = {"deviation_mean": 0.0, "deviation_max": 0.0} | found.metrics
        record = {k: said[k] for k in ("deviation_mean", "deviation_max", "strain_max")}
        record["area"] = metrics.area(found.design)
        return of_pieces(name, found, record), found.given or found.design, found.notes
    made = of_result(name, found, _record(found))
    return replace(made, reasons=found.reasons), found.design, found.notes


def _record(result: Result) -> Json:
    """Return what the page says of a surface and its pattern, in the unit of the mesh."""
    surface = surface_of(result)
    record: Json = {"area": metrics.area(surface)}
    if surface is result.design:
        record |= {"deviation_mean": 0.0, "deviation_max": 0.0}
    else:
        away = result.distances
        record |= {"deviation_mean": away.mean, "deviation_max": away.largest}
    if result.pattern is not None:
        sheet = result.pattern.surface(surface)
        record["strain_max"] = metrics.strains(sheet, result.pattern.flat)["strain_max"]
    return record

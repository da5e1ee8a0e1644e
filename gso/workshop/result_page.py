"""The page of a result: its patterns as parts, without what fabrications add."""

from __future__ import annotations

from gso import metrics
from gso.quantities import millimetres
from gso.result import Result
from gso.typing import Json
from gso.verdict import ordered
from gso.workshop.certificate import design_record
from gso.workshop.finish import Finish
from gso.workshop.names import spelled
from gso.workshop.page import page_html
from gso.workshop.page_data import Shown
from gso.workshop.page_views import Views
from gso.workshop.parts import fitted, parts_from
from gso.workshop.pattern_panels import of_result


def result_page(result: Result, name: str, *, unit: str = "mm") -> str:
    """Return the page of a result with a flat pattern as HTML.

    Parameters
    ----------
    result : Result
        With a pattern, such as of :func:`gso.tno.optimize` or :func:`gso.strips`.
    name : str
        What the design is called.
    unit : str
        Unit of its coordinates.

    Raises
    ------
    MeshError
        It has no pattern.
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
    scale = millimetres(unit)
    made = of_result(spelled(name), result, _record(result))
    fit = fitted(made, scale, Finish())
    parts, _ = parts_from(fit, Finish())
    reasons = [reason.scaled(scale).record("mm") for reason in ordered(result.reasons)]
    record = design_record(fit, parts, [made.name]) | {"reasons": reasons}
    for entry in record["parts"]:
        entry["same_as"] = None
    certificate: Json = {
        "usable": not reasons,
        "reasons": reasons,
        "notes": list(result.notes),
        "designs": [record],
        "sheets": [],
    }
    shown = [Shown(made, result.design, scale, fit.panels)]
    return page_html(certificate, parts, [], Views(shown, certificate))


def _record(result: Result) -> Json:
    """Return what the page says of a surface and its pattern, in the unit of the mesh."""
    record: Json = {"area": metrics.area(result.mesh)}
    if result.pattern is not None:
        sheet = result.pattern.surface(result.mesh)
        record["strain_max"] = metrics.strains(sheet, result.pattern.flat)["strain_max"]
    return record

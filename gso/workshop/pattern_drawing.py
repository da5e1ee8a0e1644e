"""A drawing of surfaces that are laid flat, without nesting."""

from __future__ import annotations

from collections.abc import Sequence

from gso.workshop.finish import Finish
from gso.workshop.output_files import beside
from gso.workshop.panels import Made
from gso.workshop.part import Drawing
from gso.workshop.parts import fitted, parts_from
from gso.workshop.tabs import without_tabs


def drawn(surfaces: Sequence[Made], scale: float, finish: Finish) -> tuple[Drawing, list[str]]:
    """Draw the parts of surfaces side by side.

    Parameters
    ----------
    surfaces : sequence of Made
    scale : float
        Millimetres per unit of length of the surfaces.
    finish : Finish

    Returns
    -------
    drawing : Drawing
        In millimetres.
    notes : list of str
        Seams without tabs.
    """
    parts, bare = [], []
    for made in surfaces:
        own, missing = parts_from(fitted(made, scale, finish), finish)
        parts += own
        bare += missing
    return beside(parts), without_tabs(bare)

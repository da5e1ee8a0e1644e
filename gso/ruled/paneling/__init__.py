"""From a design to strips: of the whole surface, or of the pieces that it is cut into.

:func:`gso.strips` (:mod:`~gso.ruled.paneling.lay_strips`) tries the design as one surface
(:mod:`~gso.ruled.paneling.surface_strips`), and then in pieces
(:mod:`~gso.ruled.paneling.piece_strips`). ``gso.tno.optimize`` with ``formulation="ruled"`` and
``gso.fabricate`` ask the same function.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso.first_use import at_first_use

if TYPE_CHECKING:
    from gso.ruled.paneling.cut_out import without_holes
    from gso.ruled.paneling.hole_filling import filled, holes
    from gso.ruled.paneling.light_design import LightDesign

__all__ = ["LightDesign", "filled", "holes", "without_holes"]

# These import SciPy.
__getattr__, __dir__ = at_first_use(
    __name__,
    {
        "cut_out": "without_holes",
        "hole_filling": "filled holes",
        "light_design": "LightDesign",
    },
)

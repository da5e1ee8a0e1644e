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
    from gso.ruled.paneling.light_design import LightDesign

__all__ = ["LightDesign"]

# These import SciPy.
__getattr__, __dir__ = at_first_use(__name__, {"light_design": "LightDesign"})

"""From a design to strips: of the whole surface, or of the pieces that it is cut into.

:func:`gso.strips` (:mod:`~gso.ruled.paneling.lay_strips`) tries the design as one surface
(:mod:`~gso.ruled.paneling.surface_strips`), and then in pieces
(:mod:`~gso.ruled.paneling.piece_strips`). ``gso.optimize`` with ``formulation="ruled"`` and
``gso.fabricate`` ask the same function.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso.first_use import at_first_use

if TYPE_CHECKING:
    from gso.ruled.paneling.lay_strips import strips
    from gso.ruled.paneling.light_design import LightDesign
    from gso.ruled.paneling.options import RULED, Options
    from gso.ruled.paneling.strips_request import StripsRequest

__all__ = ["RULED", "LightDesign", "Options", "StripsRequest", "strips"]

# These import SciPy.
__getattr__, __dir__ = at_first_use(
    __name__,
    {
        "lay_strips": "strips",
        "light_design": "LightDesign",
        "options": "RULED Options",
        "strips_request": "StripsRequest",
    },
)

"""From a design to strips: of the whole surface, or of the pieces that it is cut into.

:func:`gso.strips` (:mod:`~gso.ruled.paneling.lay_strips`) tries the design as one surface
(:mod:`~gso.ruled.paneling.surface_strips`), and then in pieces
(:mod:`~gso.ruled.paneling.piece_strips`). ``gso.optimize`` with ``formulation="ruled"`` and
``gso.fabricate`` ask the same function.
"""

"""Strips of planar quads close to a design: surfaces that are developable exactly.

The parts of ``formulation="ruled"``, which is not public yet: the design over its flat image
(:mod:`~gso.ruled.domain`), the first rulings (:mod:`~gso.ruled.chords`), the geometry of strips
(:mod:`~gso.ruled.strip`) and their solve (:mod:`~gso.ruled.fit`).
"""

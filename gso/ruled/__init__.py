"""Strips of planar quads close to a design: surfaces that are exactly developable.

A design is a function on its flat image (:mod:`~gso.ruled.domain`), continued beyond its outline
(:mod:`~gso.ruled.extended`). First rulings are chords of the flat image
(:mod:`~gso.ruled.chords`). The solve (:mod:`~gso.ruled.strip_fit`) minimises an energy
(:mod:`~gso.ruled.strip_energy`) of the strips (:mod:`~gso.ruled.strip_layout`), which are then cut
along the outline (:mod:`~gso.ruled.trim`) and unrolled (:mod:`~gso.ruled.unroll`). Pleats are found
(:mod:`~gso.ruled.pleat_angles`) by comparison with the design. Constraints are
:mod:`~gso.ruled.conditions` on the strips. :mod:`gso.ruled.smooth` makes smooth strips of them.
:func:`gso.ruled.solve.solve` does all of it; :mod:`gso.ruled.paneling` asks it, with designs and
pieces of designs.
"""

from gso.ruled.conditions import Conditions
from gso.ruled.domain import Domain
from gso.ruled.fold_lines import Folds
from gso.ruled.pleat_angles import pleats, sharpest_fold
from gso.ruled.strip_layout import Strips
from gso.ruled.untrimmed import Untrimmed

__all__ = ["Conditions", "Domain", "Folds", "Strips", "Untrimmed", "pleats", "sharpest_fold"]

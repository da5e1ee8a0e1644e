"""From a design to the cutter: parts, their drawings, sheets, and a certificate.

:func:`gso.fabricate` does all of it. The steps are here for scripts: a :class:`Design` is made
(:func:`made`) as it is asked for (:class:`Ask`), its panels become parts (:func:`parts_of`), and
parts are laid on sheets (:func:`nest`).
"""

from gso.pattern import Bend
from gso.workshop.asking import Ask
from gso.workshop.designs import Design, designs_of
from gso.workshop.finish import Finish
from gso.workshop.making import made
from gso.workshop.nesting import nest
from gso.workshop.panels import Panel
from gso.workshop.part import Drawing, Label, Notch, Part
from gso.workshop.parts import parts_of
from gso.workshop.thickness import Thickness, thickened

__all__ = [
    "Ask",
    "Bend",
    "Design",
    "Drawing",
    "Finish",
    "Label",
    "Notch",
    "Panel",
    "Part",
    "Thickness",
    "designs_of",
    "made",
    "nest",
    "parts_of",
    "thickened",
]

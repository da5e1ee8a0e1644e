"""From a design to the cutter: parts, their drawings, sheets, and a certificate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso.first_use import at_first_use

if TYPE_CHECKING:
    from gso.workshop.finish import Finish
    from gso.workshop.part import Drawing, Label, Notch, Part
    from gso.workshop.thickness import Thickness

__all__ = [
    "Design",
    "Drawing",
    "Finish",
    "Label",
    "Notch",
    "Part",
    "Thickness",
]

__getattr__, __dir__ = at_first_use(
    __name__,
    {
        "finish": "Finish",
        "part": "Drawing Label Notch Part",
        "thickness": "Thickness",
    },
)

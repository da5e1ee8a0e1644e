"""From a design to the cutter: parts, their drawings, sheets, and a certificate.

:func:`gso.fabricate` does all of it. The steps are here for scripts: a :class:`Design` is made
(:func:`made`) as it is asked for (:class:`FabricationSettings`), its panels are scaled to
millimetres (:func:`fitted`) and become parts (:func:`parts_from`), and parts are laid on sheets
(:func:`nest`). A page shows
what was made (:func:`page_html`).
"""

from gso.pattern import Bend
from gso.workshop.assembly_view import Places
from gso.workshop.certificate import design_record
from gso.workshop.congruent import origins, united
from gso.workshop.design_panels import made
from gso.workshop.designs import Design, designs_of
from gso.workshop.fabrication_settings import FabricationSettings
from gso.workshop.finish import Finish
from gso.workshop.hull import HullPanel, hull_panels, whole_hull
from gso.workshop.joining import order_of_joining, step_pictures
from gso.workshop.name_places import name_place
from gso.workshop.nesting import nest
from gso.workshop.page import page_html
from gso.workshop.page_data import Shown, data_for_page
from gso.workshop.page_drawings import sheet_drawing
from gso.workshop.page_views import Views
from gso.workshop.panels import Panel
from gso.workshop.part import Drawing, GuideLine, Label, Notch, Part
from gso.workshop.part_notes import fit_notes
from gso.workshop.parts import fitted, parts_from
from gso.workshop.pattern_drawing import drawn
from gso.workshop.pattern_panels import of_net, of_pieces, of_surface
from gso.workshop.tabs import TabSeam, with_tabs, without_tabs
from gso.workshop.thickness import Thickness, thickened
from gso.workshop.traced_guides import guide_lines

__all__ = [
    "Bend",
    "Design",
    "Drawing",
    "FabricationSettings",
    "Finish",
    "GuideLine",
    "HullPanel",
    "Label",
    "Notch",
    "Panel",
    "Part",
    "Places",
    "Shown",
    "TabSeam",
    "Thickness",
    "Views",
    "data_for_page",
    "design_record",
    "designs_of",
    "drawn",
    "fit_notes",
    "fitted",
    "guide_lines",
    "hull_panels",
    "made",
    "name_place",
    "nest",
    "of_net",
    "of_pieces",
    "of_surface",
    "order_of_joining",
    "origins",
    "page_html",
    "parts_from",
    "sheet_drawing",
    "step_pictures",
    "thickened",
    "united",
    "whole_hull",
    "with_tabs",
    "without_tabs",
]

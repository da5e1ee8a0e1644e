"""Notes on parts that can be made, but that a workshop should look at before."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.seams.seam_request import SeamRequest, without_seams
from gso.typing import Json
from gso.wording import places
from gso.workshop.certificate import chord
from gso.workshop.fabrication_settings import FabricationSettings
from gso.workshop.panels import Made, Panel
from gso.workshop.part import Drawing, Part
from gso.workshop.parts import Fitted
from gso.workshop.writers.pdf import PAPERS, on_page, page_count

#: Angle in degrees from which on a bend counts for pleats, and number of changes between up and
#: down in one part that make a note.
_PLEATED, _TURNS = 2.0, 4
#: Number of pages of a PDF that a note is made of.
_BOOK = 50
#: Distance of outlines from smooth curves that a note is made of, relative to the design's size.
_COARSE = 5e-4
#: Difference of the lengths of a seam's sides that a note is made of, relative to its length.
_UNEQUAL = 0.01


def strip_notes(fitted: Fitted, record: Json) -> list[str]:
    """Return notes on the strips of a design: folds, tight bends, steep creases, small parts.

    Radii are those of the surface, whatever the thickness of the sheet. Panels that are developable
    as they are do not count: their folds and bends are meant.

    Parameters
    ----------
    fitted : Fitted
    record : dict
        Of the design, in millimetres.
    """
    panels = fitted.made.panels
    own = [k for k, panel in enumerate(panels) if not panel.is_kept]
    if "crease_angle_max" not in record or not own:
        return []
    from gso.ruled.paneling.shop_notes import Advice, said

    bends = [bend for k in own for bend in panels[k].lines]
    areas = [part["area"] for part in record["parts"]]
    advice = Advice(
        "mm",
        gentle="a smaller max_deviation makes more strips, which are bent more gently, and "
        "min_radius refuses this",
        tight="give min_radius if that cannot be bent",
        steep="a smaller max_deviation makes more strips, which meet at smaller angles",
    )
    return list(
        said(
            np.array([bend.angle for bend in bends]),
            fitted.scale * np.array([bend.radius for bend in bends]),
            record["size"],
            record["crease_angle_max"],
            100.0 * min(areas[k] for k in own) / sum(areas),
            advice,
        )
    )


def page_notes(parts: Sequence[Part], paper: str) -> list[str]:
    """Return a note on parts that are larger than a page."""
    large = [part.name for part in parts if on_page(part, paper) is None]
    if not large:
        return []
    verb = "is" if len(large) == 1 else "are"
    return [
        f"{places('part', large)} {verb} larger than a page ({paper}), and on several pages of the "
        "PDF; a smaller model or larger paper avoids that"
    ]


def book_notes(drawing: Drawing, paper: str, steps: int = 0) -> list[str]:
    """Return a note on a PDF of many pages.

    Parameters
    ----------
    drawing : Drawing
        All parts.
    paper : str
    steps : int
        Number of the steps of joining, which have pages of their own.
    """
    count = page_count(drawing, paper, steps) if drawing.parts else 0
    if count < _BOOK:
        return []
    largest = max(PAPERS.values()) == PAPERS[paper]
    return [
        f"the PDF has {count} pages of {paper}: each part that fits has one of its own, and larger "
        f"ones have several; a smaller model{'' if largest else ' or larger paper'} makes fewer "
        "where parts are divided to fit"
    ]


def pleat_notes(panels: Sequence[Panel]) -> list[str]:
    """Return a note on parts whose bends go up and down in turn.

    Such a part is close to the design and developable, but pleated where the design is smooth.
    Panels that are developable as they are do not count.
    """
    names, most = [], 0.0
    for panel in panels:
        angles = np.degrees([bend.angle for bend in panel.lines])
        sharp = np.where(np.abs(angles) > _PLEATED, angles, 0.0)
        turns = sharp[1:] * sharp[:-1] < 0.0
        if not panel.is_kept and turns.sum() >= _TURNS:
            names.append(panel.name)
            most = max(most, float(np.abs(sharp).max()))
    if not names:
        return []
    return [
        f"{places('part', names)}: neighbouring bends go up and down in turn, by up to {most:.0f} "
        "degrees: the part is pleated; look at it before it is cut. A smaller max_deviation makes "
        "other parts"
    ]


def outline_notes(panels: Sequence[Panel], record: Json) -> list[str]:
    """Return a note on outlines that are coarse polygons, of panels that were made.

    The outlines of panels that are developable as they are may be meant as polygons.
    """
    own = [chord(panel.flat[loop]) for panel in panels if not panel.is_kept for loop in panel.loops]
    far = max(own, default=0.0)
    if far <= _COARSE * record["size"]:
        return []
    return [
        f"outlines are polygons, up to {far:.3g} mm from smooth curves through their corners; a "
        "finer design has finer outlines"
    ]


def fit_notes(fitted: Fitted) -> list[str]:
    """Return a note on seams whose sides differ in length, as the parts only follow them.

    Such parts are near the design, but one of them is too long for the other.
    """
    unequal, share, off = [], 0.0, 0.0
    for seam in fitted.made.matings:
        own = seam.mismatch(fitted.made.panels) / seam.length
        if not seam.common and own > _UNEQUAL:
            unequal.append(seam.number)
            share, off = max(share, own), max(off, seam.mismatch(fitted.panels))
    if not unequal:
        return []
    return [
        f"{places('seam', unequal)}: the lengths of both sides differ by up to {off:.3g} mm "
        f"({100.0 * share:.2g} %), as the parts are made one by one; a smaller max_deviation "
        "makes them fit"
    ]


def seam_notes(made: Made, asked: SeamRequest) -> list[str]:
    """Return a note on preferences about seams of a design for which none were searched for."""
    alone = made.record["pieces"] == 1
    if not asked.preferences or not (alone or all(panel.is_kept for panel in made.panels)):
        return []
    return [without_seams(asked.preferences)]


def guide_notes(records: Sequence[Json], settings: FabricationSettings) -> list[str]:
    """Return notes on curved parts without bend lines."""
    every = [part for record in records for part in record.get("parts", ())]
    guided = [part["guide_angle_max"] for part in every if part["guide_lines"]]
    bare = sum(part["curved"] and not part["guide_lines"] for part in every)
    why = ": no strip follows them closely enough" if settings.formulation == "ruled" else ""
    notes = []
    if guided:
        notes.append(
            f"{len(guided)} of {len(every)} parts are curved and have no bend lines{why}; their "
            "guide lines, along which they are curved least, are up to "
            f"{max(guided):.2g} degrees from straight"
        )
    if bare:
        notes.append(
            f"{bare} of {len(every)} parts are curved in all directions and have neither bend "
            "lines nor guide lines; they are nearly developable, and have to be formed by hand"
        )
    return notes

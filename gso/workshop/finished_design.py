"""Designs whose panels are made: their parts, their records, and what is said of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from gso.exact import EXACT, as_it_is
from gso.io import Solid
from gso.quantities import millimetres
from gso.typing import Array, Json
from gso.verdict import Code, Measurement, Reason, compare, failure, merge, ordered
from gso.workshop.certificate import design_record, digest
from gso.workshop.checks import judge_sheet
from gso.workshop.designs import Design
from gso.workshop.fabrication_settings import FabricationSettings
from gso.workshop.finish import Finish
from gso.workshop.page_data import Shown
from gso.workshop.panels import Made
from gso.workshop.part import Part
from gso.workshop.part_notes import (
    fit_notes,
    outline_notes,
    page_notes,
    pleat_notes,
    seam_notes,
    strip_notes,
)
from gso.workshop.parts import fitted, parts_from
from gso.workshop.seam_strips import no_such_seam
from gso.workshop.solids import folded_solids
from gso.workshop.tabs import without_tabs


@dataclass(frozen=True)
class FinishedDesign:
    """A design and its copies, as far as they are made.

    Attributes
    ----------
    record : dict
        What the certificate has of it.
    reasons : tuple of Reason
        Why it cannot be made as it was asked for, with its name.
    parts : list of Part
        Its parts, in millimetres.
    solids : list of Solid
        The folded parts, where they are wanted.
    shown : Shown or None
        What the page shows of it; None where nothing was made.
    notes : list of str
        With its name.
    """

    record: Json
    reasons: tuple[Reason, ...]
    parts: list[Part] = field(default_factory=list)
    solids: list[Solid] = field(default_factory=list)
    shown: Shown | None = None
    notes: list[str] = field(default_factory=list)

    @classmethod
    def failed(cls, copies: Sequence[Design], why: str) -> FinishedDesign:
        """Return a design of which nothing could be made, as an error says."""
        name = copies[0].name
        reason = failure(Code.FAILED, why)
        names = [design.name for design in copies]
        record = {"name": name, "copies": names, "reasons": recorded([reason])}
        return cls(record, (reason.within(name),))

    @classmethod
    def of(
        cls,
        copies: Sequence[Design],
        made: Made,
        settings: FabricationSettings,
        finish: Finish,
        marks: Sequence[Array] = (),
        holes: Sequence[Array] = (),
        *,
        step: bool,
        paper: str | None,
    ) -> FinishedDesign:
        """Make parts of panels, and judge them.

        Parameters
        ----------
        copies : sequence of Design
            The design, and others that are the same.
        made : Made
            Its panels, whose names differ from those of other designs.
        settings : FabricationSettings
        finish : Finish
            For designs that are no solids of sheet metal.
        marks, holes : sequence of ndarray, (k, 3)
            Lines to engrave and to cut, on the design.
        step : bool
            Whether folded parts are wanted as solids.
        paper : str or None
            Size of the pages that drawings of parts are written to.
        """
        design, per_unit = copies[0], millimetres(settings.unit)
        if design.sheet is not None:
            finish = finish.of_solid(per_unit * design.sheet)
        names = [copy.name for copy in copies]
        fit = fitted(made, per_unit, finish, marks, holes)
        cut_out, bare = parts_from(fit, finish)
        parts = [replace(part, count=len(copies)) for part in cut_out]
        record = design_record(fit, parts, names) | {"digest": digest(design.mesh)}
        why = (*(r.scaled(per_unit) for r in made.reasons), *judge_sheet(fit, settings, finish))
        why = merge(why, next((copy.reasons for copy in copies if copy.reasons), ()))
        notes = strip_notes(fit, record)
        notes += [] if any(r.code is Code.PLEATED for r in why) else pleat_notes(fit.panels)
        notes += fit_notes(fit)
        notes += outline_notes(fit.panels, record)
        notes += without_tabs(bare) if finish.tabs else []
        if settings.page is not None and paper is not None:
            notes += page_notes(parts, paper)
        notes += seam_notes(made, settings.seams(design.along, design.avoid))
        is_kept = made.record["deviation_max"] == 0.0
        if is_kept and settings.formulation == "ruled" and made.record["strain_max"] > EXACT:
            notes.append(as_it_is(made.record["strain_max"]))
        if is_kept and finish.tabs is not None:
            why, through = _of_paper(why)
            notes += through
        if finish.seam_strip:
            why = merge(why, compare({Code.SEAM_STRIP: Measurement.count("seam", bare)}, {}))
            notes += no_such_seam(made.matings, finish.seam_overlap, finish.seam_flange)
        solids: list[Solid] = []
        if step and finish.thickness is not None:
            solids = folded_solids(made.panels, per_unit, finish.thickness)
        return cls(
            record=record | {"reasons": recorded(why)},
            reasons=tuple(reason.within(made.name) for reason in why),
            parts=parts,
            solids=solids,
            shown=Shown(made, design.mesh, per_unit, fit.panels, tuple(d.mesh for d in copies)),
            notes=[f"{made.name}: {note}" for note in notes],
        )


def recorded(reasons: Iterable[Reason]) -> list[Json]:
    """Return records of reasons, the most severe first; lengths are in millimetres."""
    return [reason.record("mm") for reason in ordered(reasons)]


def _of_paper(why: tuple[Reason, ...]) -> tuple[tuple[Reason, ...], list[str]]:
    """Say as notes what does not keep paper models from being built as the design is.

    Parts of models that pass through themselves can be cut and folded, and paper is slit with a
    knife where one wall goes through another, or what would be hidden is trimmed off. Plates of
    metal or wood would have to be cut for it, and their drawings lack the cuts.
    """
    through = [reason for reason in why if reason.code is Code.CROSSES_ITSELF]
    notes = [
        f"the design passes through itself at {reason.places}: slit the paper there, or trim "
        "what is inside"
        for reason in through
    ]
    return tuple(reason for reason in why if reason not in through), notes

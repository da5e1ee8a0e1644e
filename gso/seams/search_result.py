"""What a search for seams returns, with its metrics and the reasons against it."""

from __future__ import annotations

import numpy as np

from gso import metrics
from gso.mesh import Mesh
from gso.result import Result
from gso.seams.candidates import Candidate, fits
from gso.seams.facets import FACETS, mean_angle
from gso.seams.options import NECK, Wishes
from gso.seams.segmentation import Segmentation
from gso.seams.tree import Ground
from gso.verdict.surface_checks import against_surface
from gso.wording import beyond, percent
from gso.wording import length as said


def packed(found: Candidate, result: Result | None, ground: Ground, wishes: Wishes) -> Segmentation:
    """Measure what was found, and say what is not as it was asked for.

    Parameters
    ----------
    found : Candidate
    result : Result or None
        The solve that changed the shape.
    ground : Ground
        The design, to measure distances from.
    wishes : Wishes
    """
    own, sheets = found.pieces, found.sheets
    count, length = len(own), own.seam_length
    size = float(np.sqrt(ground.potential.area.sum()))
    numbers = {"pieces": float(count), "seam": length, "strain_p99": found.strain}
    whole = [s for s in sheets if s is not None]
    numbers["strain_max"] = max((s.strains["strain_max"] for s in whole), default=np.inf)
    necks = found.necks(2.0 * NECK * size)
    numbers["neck"] = float(necks.min())
    roots = np.sqrt([metrics.area(piece.mesh) for piece in own])
    thin = int((necks / roots).argmin())
    numbers["neck_share"] = float(necks[thin] / roots[thin])
    reasons = wishes.missed(count, length)
    reasons += _unfit(found, wishes)
    if wishes.max_strain < found.strain < np.inf:
        reasons.append(
            f"the strain is {beyond(found.strain, wishes.max_strain, percent)}: allow "
            + ", or ".join(_remedies(own.design, wishes))
        )
    notes = []
    if wishes.min_neck is not None and numbers["neck"] < wishes.min_neck:
        reasons.append(f"a neck is {said(numbers['neck'])} wide, less than {said(wishes.min_neck)}")
    elif numbers["neck_share"] < NECK:
        notes.append(
            f"piece {own.name(thin)} is {said(necks[thin])} wide at its narrowest place, "
            f"{percent(numbers['neck_share'])} of the root of its area"
        )
    if result is not None:
        reasons += against_surface(result.design, result.mesh)
        away = metrics.surface_distance(ground.mesh, own.design)
        numbers["deviation_mean"] = away.there_mean
        numbers["deviation_max"] = max(away.there_max, away.back_max)
        numbers["dihedral_mean_before"] = mean_angle(result.design)
        numbers["dihedral_mean"] = mean_angle(result.mesh)
        numbers["dihedral_max"] = float(metrics.dihedral_angles(result.mesh).max(initial=0.0))
        if not own.design.is_triangles:
            numbers["nonplanarity_max"] = float(np.nanmax(metrics.nonplanarity(own.design)))
        if numbers["dihedral_mean"] > FACETS * numbers["dihedral_mean_before"]:
            notes.append(
                "the mean angle between neighbouring faces rose from "
                f"{numbers['dihedral_mean_before']:.3g} to {numbers['dihedral_mean']:.3g} degrees: "
                "the pieces have facets or wrinkles"
            )
        allowed = wishes.max_deviation
        if allowed is not None and numbers["deviation_max"] > allowed:
            far = beyond(numbers["deviation_max"], allowed)
            reasons.append(f"the largest distance between surface and design is {far}")
    return Segmentation(
        own.design,
        own.opened,
        own.names,
        sheets,
        numbers,
        tuple(reasons),
        tuple(notes),
        result,
        ground.mesh,
        ground.kept,
    )


def _remedies(design: Mesh, wishes: Wishes) -> list[str]:
    """List what would lower the strain."""
    out = ["more strain (max_strain)"]
    if wishes.min_neck is not None:
        out.append("narrower necks (min_neck)")
    more = "a change" if wishes.max_deviation is None else "more change"
    out.append(f"{more} of shape (max_deviation)")
    if not design.is_triangles:
        bent = float(np.nanmax(metrics.nonplanarity(design)))
        # The strain of a bent quad grows with the square of the distance of its diagonals.
        if bent**2 > wishes.max_strain:
            out.append(
                "triangles instead of quads (the diagonals of a quad are "
                f"{percent(bent)} of the mean edge apart)"
            )
    return out


def _unfit(found: Candidate, wishes: Wishes) -> list[str]:
    """Say which pieces have no pattern that can be used."""
    out = []
    large: list[tuple[float, str]] = []
    small: list[tuple[float, str]] = []
    for number, sheet in enumerate(found.sheets):
        name = found.pieces.name(number)
        if sheet is None:
            out.append(f"piece {name} cannot be laid flat")
            continue
        long, wide = sheet.size
        if not sheet.sound:
            out.append(f"the pattern of piece {name} overlaps itself or is inverted")
        if wishes.max_size is not None and not fits(sheet, wishes.max_size):
            large.append((-long, f"that of piece {name} is {said(long)} by {said(wide)}"))
        if wishes.min_size is not None and long < wishes.min_size:
            small.append((long, f"that of piece {name} is {said(long)} long"))
    for pieces, what in ((large, "larger than the sheet"), (small, "shorter than min_size")):
        if pieces:
            many = (
                f"the patterns of {len(pieces)} pieces are" if len(pieces) > 1 else "a pattern is"
            )
            out.append(f"{many} {what}: {min(pieces)[1]}")
    return out

"""What a search for seams returns, with its metrics and the reasons against it."""

from __future__ import annotations

import numpy as np

from gso import metrics
from gso.result import Result
from gso.segmentation.candidates import Candidate, fits
from gso.segmentation.found import Segmentation
from gso.segmentation.measures import FACETS, mean_angle
from gso.segmentation.options import NECK, Wishes
from gso.segmentation.tree import Ground
from gso.verdict.shape import against_surface


def packed(found: Candidate, result: Result | None, ground: Ground, wishes: Wishes) -> Segmentation:
    own, sheets = found.pieces, found.sheets
    count, length = len(own), own.seam_length
    size = float(np.sqrt(ground.potential.area.sum()))
    numbers = {"pieces": float(count), "seam": length, "strain_p99": found.strain}
    whole = [s for s in sheets if s is not None]
    numbers["strain_max"] = max((s.strains["strain_max"] for s in whole), default=np.inf)
    numbers["neck"] = found.neck(2.0 * NECK * size)
    reasons = wishes.missed(count, length)
    for number, sheet in enumerate(sheets):
        name = own.name(number)
        if sheet is None:
            reasons.append(f"piece {name} cannot be laid flat")
        elif not sheet.sound:
            reasons.append(f"the pattern of piece {name} overlaps itself or is inverted")
        elif wishes.max_size is not None and not fits(sheet, wishes.max_size):
            reasons.append(
                f"the pattern of piece {name} is {sheet.size[0]:.4g} by {sheet.size[1]:.4g}, "
                "larger than the sheet"
            )
    if found.strain > wishes.max_strain:
        reasons.append(
            f"the strain is {found.strain:.2g}, more than {wishes.max_strain:.2g}: allow narrower "
            "necks (min_neck), more strain, or a change of shape (max_deviation)"
        )
    notes = []
    if wishes.min_neck is not None and numbers["neck"] < wishes.min_neck:
        reasons.append(f"a neck is {numbers['neck']:.3g} wide, less than {wishes.min_neck:.3g}")
    elif numbers["neck"] < NECK * size:
        notes.append(f"the narrowest place of a piece is {numbers['neck']:.3g} wide")
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
            reasons.append(
                f"the surface is up to {numbers['deviation_max']:.3g} from the design, more than "
                f"{allowed:.3g}"
            )
    return Segmentation(
        own.design, own.opened, own.names, sheets, numbers, tuple(reasons), tuple(notes), result
    )

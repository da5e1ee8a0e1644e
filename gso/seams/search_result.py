"""What a search for seams returns, with its metrics and the reasons against it."""

from __future__ import annotations

from functools import partial

import numpy as np

from gso import faults, metrics
from gso.cut_pieces import Pieces
from gso.geometry import chain_turns
from gso.mesh import Mesh
from gso.result import Result
from gso.seams.candidates import Candidate
from gso.seams.facets import FACETS, mean_angle
from gso.seams.inverted_faces import inverted_at_seams
from gso.seams.options import NECK, PieceSettings
from gso.seams.segmentation import Segmentation
from gso.seams.sheets import too_small
from gso.typing import Ints
from gso.verdict import Code, Measurement, compare
from gso.verdict.surface_checks import crossed, of_surface
from gso.wording import length as said
from gso.wording import percent


def packed(
    found: Candidate,
    result: Result | None,
    given: Mesh,
    kept: Ints,
    settings: PieceSettings,
    *,
    rebuilt: bool = False,
) -> Segmentation:
    """Measure what was found, and judge it by what was asked for.

    Parameters
    ----------
    found : Candidate
    result : Result or None
        The solve that changed the shape.
    given : Mesh
        The design, to measure distances from.
    kept : ndarray of int, (k, 2)
        The edges of it that were to be cut in any case.
    settings : PieceSettings
    rebuilt : bool
        Whether the pieces are a new surface, whose vertices are not those of the design.
    """
    own, sheets, length = found.pieces, found.sheets, found.pieces.seam_length
    count, names = len(own), _names(own)
    size = float(np.sqrt(metrics.area(given)))
    numbers = {"pieces": float(count), "seam": length, "strain_max": found.strain}
    whole = [s for s in sheets if s is not None]
    numbers["strain_p99"] = max((s.strains["strain_p99"] for s in whole), default=np.inf)
    necks = found.necks(2.0 * NECK * size)
    numbers["neck"] = float(necks.min())
    roots = np.sqrt([metrics.area(piece.mesh) for piece in own])
    thin = int((necks / roots).argmin())
    numbers["neck_share"] = float(necks[thin] / roots[thin])
    measured: dict[Code, Measurement] = {
        Code.PIECES: Measurement(count),
        Code.SEAM_LENGTH: Measurement(length),
        Code.NECK: Measurement(necks, "piece", names),
        **_of_sheets(found),
    }
    joined = sorted(set(own.sides[np.ptp(own.sides, axis=1) > 0].ravel().tolist()))
    if joined and len(whole) == count:
        some = [names[k] for k in joined]
        measured |= too_small([whole[k] for k in joined], size**2, given.size, "piece", some)
    turn = float(np.degrees(chain_turns(own.edges, own.design.vertices)).sum())
    along = 100.0 * float(own.lengths.sum()) / own.design.diagonal
    numbers["seam_turn"] = turn / along if along > 0 else 0.0
    notes = []
    if result is None:
        measured |= crossed(own.design if rebuilt else given)
        if settings.max_deviation is not None and not rebuilt:
            numbers |= {"deviation_mean": 0.0, "deviation_max": 0.0}
    else:
        # Both sides of a seam touch, which is no crossing where they are sewn.
        faulty = of_surface(result.design, result.mesh) | crossed(own.design)
        over = np.empty(0, np.int64) if result.pieces is None else inverted_at_seams(result)
        if len(over) and not faulty[Code.FOLDED].value:
            faulty[Code.FOLDED] = Measurement.count("face", over)
        if own.design.is_triangles and not faulty[Code.CROSSES_ITSELF].value:
            met = np.unique(faults.crossings_at_vertices(own.design))
            faulty[Code.CROSSES_ITSELF] = Measurement.count("face", met)
        measured |= faulty
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
    if result is not None or rebuilt:
        away = metrics.surface_distance(given, own.design)
        numbers |= {"deviation_mean": away.mean, "deviation_max": away.largest}
        measured[Code.DEVIATION] = Measurement(away.largest)
    reasons = compare(measured, settings.limits)
    codes = {reason.code for reason in reasons}
    if Code.STRAIN in codes:
        notes += _bent(own.design, settings.max_strain)
    if Code.NECK not in codes and numbers["neck_share"] < NECK:
        notes.append(
            f"piece {own.name(thin)} is {said(necks[thin])} wide at its narrowest place, "
            f"{percent(numbers['neck_share'])} of the root of its area"
        )
    return Segmentation(
        own.design,
        own.opened,
        own.names,
        sheets,
        numbers,
        reasons,
        tuple(notes),
        result,
        given,
        kept,
    )


def _of_sheets(found: Candidate) -> dict[Code, Measurement]:
    """Measure the patterns of the pieces."""
    named = list(zip(_names(found.pieces), found.sheets, strict=True))
    flat = [(name, sheet) for name, sheet in named if sheet is not None]
    names = [name for name, _ in flat]

    count = partial(Measurement.count, "piece")

    def each(values: list[float]) -> Measurement:
        return Measurement(np.array(values), "piece", names)

    return {
        Code.NO_PATTERN: count([name for name, sheet in named if sheet is None]),
        Code.PATTERN_INVERTED: count([name for name, s in flat if len(s.inverted)]),
        Code.PATTERN_OVERLAPS: count(
            [name for name, s in flat if len(faults.overlaps(s.mesh, s.flat))]
        ),
        Code.STRAIN: each([s.strain for _, s in flat]),
        Code.TOO_SHORT: each([s.size[0] for _, s in flat]),
        Code.TOO_LONG: each([s.size[0] for _, s in flat]),
        Code.TOO_WIDE: each([s.size[1] for _, s in flat]),
    }


def _names(pieces: Pieces) -> list[str]:
    return [pieces.name(k) for k in range(len(pieces))]


def _bent(design: Mesh, strain: float) -> list[str]:
    """Make a note if triangles would be strained less than the quads of a design."""
    if design.is_triangles:
        return []
    bent = float(np.nanmax(metrics.nonplanarity(design)))
    # The strain of a bent quad grows with the square of the distance of its diagonals.
    if bent**2 <= strain:
        return []
    return [
        "triangles may be strained less than these quads, whose diagonals are up to "
        f"{percent(bent)} of the mean edge apart"
    ]

"""Designs with constraints: whether they hold as a design is, and the joint solve of its pieces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso.constraints import FixedBoundary, SlidingBoundary, compile_constraints
from gso.errors import OptionError
from gso.mesh import Mesh
from gso.seams import Edges, Segmentation, cut
from gso.seams.candidates import Candidate
from gso.seams.design_constraints import OfDesign
from gso.seams.joint_solve import solve_pieces
from gso.seams.options import PieceSettings
from gso.seams.search_result import packed
from gso.seams.sheets import flattened
from gso.tasks import check
from gso.verdict import Code, failure, merge
from gso.workshop.designs import Design
from gso.workshop.fabrication_settings import FabricationSettings

#: Largest violation of a hard constraint, relative to the diagonal.
_HELD = 1e-6


def check_formulation(given: Design, settings: FabricationSettings) -> None:
    """Raise an error if a design is made in a way that does not take constraints.

    Raises
    ------
    OptionError
        Its shape stays, or strips of it are cut along given edges.
    """
    if not given.constraints:
        return
    if settings.formulation == "flatten":
        raise OptionError(
            'constraints are on a shape that changes, and formulation "flatten" keeps it; take '
            '"curvature" or "isometry", or leave them out'
        )
    if settings.formulation == "ruled" and len(given.kept):
        raise OptionError(
            "constraints of strips are met by a design in one piece, and edges of it are cut in "
            'any case; take formulation "curvature" or "isometry", or leave them out'
        )


def holds(given: Design, surface: Mesh, *, soft: bool = False) -> bool:
    """Tell whether hard constraints hold on a surface with the vertices of a design first.

    With `soft` the soft ones count, too.
    """
    found = compile_constraints(given.constraints, given.mesh)
    points = surface.vertices[: len(given.mesh.vertices)]
    misses = [miss.length for miss in found.violations(points).values() if miss.hard or soft]
    return max(misses, default=0.0) <= _HELD * given.mesh.diagonal


def solved(
    given: Design, found: Segmentation, settings: FabricationSettings, allowed: float
) -> Segmentation:
    """Solve the pieces of a design together, with its constraints.

    Parameters
    ----------
    given : Design
    found : Segmentation
        The pieces, which were found without the constraints.
    settings : FabricationSettings
    allowed : float
        Largest distance from the design.
    """
    division = cut(found.unchanged, Edges(np.asarray(found.edges)))
    request = check(
        "developable",
        max_deviation=allowed,
        max_strain=settings.strain,
        x0=found.design,
        verdict=False,
    )
    request = request.with_options(request.options.for_pieces())
    # The boundary has the vertices that seams add; all others are named by the design's numbers.
    own = [
        one if isinstance(one, FixedBoundary | SlidingBoundary) else OfDesign(one, given.mesh)
        for one in given.constraints
    ]
    result = solve_pieces(division, request, own)
    shape = division if result.pieces is None else result.pieces
    budgets = PieceSettings(
        max_strain=settings.strain,
        max_deviation=allowed,
        max_pieces=settings.max_pieces,
        seam=None,
        darts=settings.darts,
        min_neck=settings.min_neck,
        min_size=settings.min_size,
        max_size=settings.max_size,
        say=lambda said: None,
    )
    flat = Candidate(shape, tuple(flattened(piece.mesh) for piece in shape))
    out = packed(flat, result, division.design, found.kept, budgets)
    if holds(given, shape.design):
        return out
    return replace(out, reasons=merge(out.reasons, (failure(Code.CONSTRAINTS_MISSED),)))

"""Pieces of a design that is flat or developable as it is."""

from __future__ import annotations

import numpy as np

from gso.cut_pieces import Pieces
from gso.errors import MeshError, OptionError
from gso.exact import folded_pattern
from gso.mesh import Mesh
from gso.mesh.cut import cut
from gso.pattern import Folded
from gso.seams.candidates import Candidate
from gso.seams.options import PieceSettings
from gso.seams.sheets import Sheet
from gso.typing import Ints


def exact_pieces(
    design: Mesh, kept: Ints, settings: PieceSettings, *, rows: bool = False
) -> Candidate | None:
    """Cut a design into the parts of its folded pattern; None if it is not developable as it is.

    Parameters
    ----------
    design : Mesh
    kept : ndarray of int, (k, 2)
        Edges that are cut in any case.
    settings : PieceSettings
    rows : bool
        As of :func:`gso.exact.folded_pattern`.
    """
    try:
        found = folded_pattern(
            design, max_strain=settings.max_strain, cut=kept, sheet=settings.max_size, rows=rows
        )
    except (MeshError, OptionError):
        # Facets of round faces do not fit together, or a face is larger than the sheet.
        return None
    if found is None:
        return None
    pattern = found.pattern
    opened = cut(found.surface, pattern.vertex[pattern.seams[:, 0]])
    number, flat = np.zeros(len(pattern.flat), np.int64), np.zeros((len(opened.vertex), 2))
    number[pattern.faces] = opened.mesh.faces
    flat[opened.mesh.faces] = pattern.flat[pattern.faces]
    edges, sheets = number[found.folded.edges], []
    pieces = Pieces(found.surface, opened)
    for part in pieces.parts:
        local = np.full(len(flat), -1)
        local[part.vertices] = np.arange(len(part.vertices))
        own = local[edges[:, 0]] >= 0
        folded = Folded(local[edges[own]], found.folded.angles[own], found.folded.radii[own])
        sheets.append(Sheet(part.mesh, flat[part.vertices], folded, found.strain))
    return Candidate(pieces, tuple(sheets))

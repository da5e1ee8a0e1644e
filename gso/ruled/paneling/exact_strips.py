"""A design that is flat or developable as it is, as the strips that it consists of."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from gso.errors import OptionError
from gso.exact import as_it_is, folded_pattern
from gso.mesh import Mesh
from gso.mesh.topology import label_components
from gso.metrics import Distances
from gso.result import StripsResult
from gso.ruled.fold_lines import Folds
from gso.ruled.paneling.made_strips import made_strips
from gso.ruled.paneling.strips_request import StripsRequest
from gso.ruled.ruled_surface import RuledSurface
from gso.status import Status
from gso.typing import Ints


def exact_strips(
    design: Mesh, request: StripsRequest, kept: Ints, *, rows: bool = False
) -> StripsResult | None:
    """Return a design with its own rulings and folds, without a verdict.

    Parameters
    ----------
    design : Mesh
        Its vertices that no face has are left out.
    request : StripsRequest
        Without constraints, start, and number of strips.
    kept : ndarray of int, (k, 2)
        Edges that are cut in any case.
    rows : bool
        As of :func:`gso.exact.folded_pattern`.

    Returns
    -------
    StripsResult or None
        None if the design is not developable as it is, or bends more sharply than it may.
    """
    clock = time.perf_counter()
    try:
        found = folded_pattern(
            design, max_strain=request.max_strain, cut=kept, sheet=request.sheet, rows=rows
        )
    except OptionError:
        # A face is larger than the sheet.
        return None
    if found is None:
        return None
    folded, used = found.folded, np.unique(found.pattern.vertex)
    rank = np.zeros(len(found.surface.vertices), np.int64)
    rank[used] = np.arange(len(used))
    pattern = replace(found.pattern, vertex=rank[found.pattern.vertex])
    if folded.radii.min(initial=np.inf) < (request.options.min_radius or 0.0):
        return None
    corners = pattern.faces
    part = label_components(len(pattern.flat), corners[:, [0, 0]].ravel(), corners[:, 1:].ravel())
    surface = RuledSurface(
        mesh=Mesh(found.surface.vertices[used], rank[found.surface.faces]),
        strip=np.unique(part[corners[:, 0]], return_inverse=True)[1].ravel(),
        flat=np.zeros(len(corners), bool),
        rulings=Folds(pattern.vertex[folded.edges], folded.angles, folded.radii),
        creases=Folds(np.empty((0, 2), np.int64), np.empty(0), np.empty(0)),
        pattern=pattern,
        moved=design.vertices,
        crossed=0,
        deviation=Distances(0.0, 0.0, 0.0, 0.0),
        strain=found.strain,
    )
    status, notes = Status.ALREADY_GOOD, [as_it_is(found.strain)]
    return made_strips(design, surface, status, "design", begun=clock, notes=notes)

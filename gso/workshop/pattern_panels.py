"""Panels of a pattern: one for each of its connected parts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gso import tasks
from gso.components import largest_first
from gso.errors import MeshError
from gso.mesh import Mesh
from gso.mesh.topology import pair_keys
from gso.pattern import Folded, Pattern, Zone
from gso.result import Result
from gso.seams import Segmentation
from gso.typing import Array, Ints, Json
from gso.unfolding import Net
from gso.workshop.matings import across, numbered, of_pattern
from gso.workshop.panels import Made, Panel

_NO_FOLDS = Folded()


def of_net(name: str, net: Net) -> Made:
    """Divide a net into panels that are folded along its folds, with radius 0."""
    return of_surface(name, net.mesh, net.pattern, {}, net.folds)


def of_surface(
    name: str,
    surface: Mesh,
    pattern: Pattern,
    record: Json,
    folded: Folded = _NO_FOLDS,
    zones: Sequence[Zone] = (),
    angles: Array | None = None,
    made_of: tuple[Ints, Sequence[tuple[str, ...]]] | None = None,
) -> Made:
    """Divide a surface with a pattern into panels.

    Parameters
    ----------
    name : str
        Panels are called NAME-1, NAME-2 and so on, the largest first; a single one NAME.
    surface : Mesh
    pattern : Pattern
    record : dict
        What was measured.
    folded : Folded, optional
        Bend lines: rulings of round faces, and folds.
    zones : sequence of Zone, optional
        Round faces, by the numbers that bend lines have.
    angles : ndarray, (s,), optional
        Angle between the faces at each seam edge.
    made_of : (ndarray of int (t,), sequence of tuple of str), optional
        A number of each face of the pattern, and the names of the faces of a CAD file by it.
    """
    panels, label, local = _divided(surface.vertices, pattern, folded, made_of)
    panels = [_with_zones(panel, zones) for panel in panels]
    corners = len(folded.edges) > 0
    matings = of_pattern(surface.vertices, pattern, label, local, corners, angles)
    return Made(name, _named(panels, [name] * len(panels)), numbered(matings), record)


def _with_zones(panel: Panel, zones: Sequence[Zone]) -> Panel:
    """Number the zones that a panel has lines of."""
    used = np.unique(panel.zone[panel.zone >= 0])
    own = np.where(panel.zone >= 0, np.searchsorted(used, panel.zone), -1)
    return replace(panel, zone=own, zones=tuple(zones[k] for k in used.tolist()))


def of_result(name: str, result: Result, record: Json) -> Made:
    """Divide a result into panels with bend lines; of piece A of several they are NAME-A-1 etc."""
    pattern, points, pieces = result.pattern, surface_of(result).vertices, result.pieces
    if pattern is None:
        raise MeshError(f"{name}: there is no pattern")
    panels, label, local = _divided(points, pattern, result.folded)
    matings, names = of_pattern(points, pattern, label, local), [name] * len(panels)
    if pieces is not None:
        first = [np.flatnonzero(label[pattern.faces[:, 0]] == k)[0] for k in range(len(panels))]
        owner = result.piece_of_face[first].tolist()
        sides = np.array(owner)[label[pattern.seams[:, :, 0]]]
        # Pieces that share the points of their seams are joined in the pattern already.
        if not (sides[:, 0] != sides[:, 1]).any():
            matings += across(pieces, owner, panels, _rims(panels, pattern, label, local))
        if len(pieces) > 1:
            names = [f"{name}-{pieces.name(k)}" for k in owner]
    return Made(name, _named(panels, names), numbered(matings), record)


def of_components(name: str, surface: Mesh) -> tuple[Panel, ...]:
    """Make a panel without a pattern of each component of a surface, the largest first."""
    parts = [part.mesh for part in largest_first(surface)]
    nothing = [np.full((len(part.vertices), 2), np.nan) for part in parts]
    panels = [Panel("", part, flat) for part, flat in zip(parts, nothing, strict=True)]
    return _named(panels, [name] * len(panels))


def surface_of(result: Result) -> Mesh:
    """Return the surface that the pattern of a result belongs to."""
    return result.design if tasks.get(result.task).flat else result.mesh


def of_pieces(name: str, found: Segmentation, record: Json) -> Made:
    """Make a panel of each piece that has a pattern; that of piece A of several is NAME-A."""
    pattern, points = found.known_pattern, found.design.vertices
    if pattern is None:
        raise MeshError(f"{name}: none of the pieces has a pattern, so that no page shows them")
    folded = found.folded
    panels, label, local = _divided(points, pattern, folded)
    matings = of_pattern(points, pattern, label, local, len(folded.edges) > 0)
    first = [np.flatnonzero(label == k)[0] for k in range(len(panels))]
    owner = found.of_vertex[first].tolist()
    names = [f"{name}-{found.name(k)}" if len(found) > 1 else name for k in owner]
    return Made(name, _named(panels, names), numbered(matings), record, found.reasons)


def _named(panels: list[Panel], names: list[str]) -> tuple[Panel, ...]:
    """Name panels; those with the same name are numbered from 1 on."""
    count, seen = Counter(names), Counter[str]()
    out = []
    for panel, name in zip(panels, names, strict=True):
        seen[name] += 1
        out.append(replace(panel, name=f"{name}-{seen[name]}" if count[name] > 1 else name))
    return tuple(out)


def _divided(
    points: Array,
    pattern: Pattern,
    folded: Folded,
    made_of: tuple[Ints, Sequence[tuple[str, ...]]] | None = None,
) -> tuple[list[Panel], Ints, Ints]:
    """Return the panels of a pattern, and the panel and the number in it of each vertex."""
    parts = largest_first(pattern.mesh)
    label, local = (np.full(len(pattern.flat), -1) for _ in range(2))
    for number, part in enumerate(parts):
        label[part.vertices], local[part.vertices] = number, np.arange(len(part.vertices))
    panels = []
    for number, part in enumerate(parts):
        own = label[folded.edges[:, 0]] == number
        surface = part.mesh.replaced(points[pattern.vertex[part.vertices]])
        lines = [local[folded.edges[own]], folded.angles[own], folded.radii[own]]
        lines += [folded.zone[own]] if len(folded.zone) else []
        panel = Panel("", surface, pattern.flat[part.vertices], *lines)
        if made_of is not None:
            of_face, names = made_of
            every = (name for k in np.unique(of_face[part.faces]).tolist() for name in names[k])
            panel = replace(panel, faces=tuple(dict.fromkeys(every)))
        panels.append(panel)
    return panels, label, local


def _rims(panels: list[Panel], pattern: Pattern, label: Ints, local: Ints) -> list[Ints]:
    """Return the edges of each panel's outline that are no seam of the pattern."""
    ends = pattern.seams.reshape(-1, 2)
    out = []
    for number, panel in enumerate(panels):
        n, rim = len(panel.flat), panel.rim
        own = pair_keys(local[ends[label[ends[:, 0]] == number]], n)
        keys = pair_keys(rim, n)
        out.append(rim[~np.isin(keys, own)])
    return out

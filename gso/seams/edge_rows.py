"""Pieces of quad designs whose seams run along edge rows, from pieces of their triangles.

Each face goes to the piece that has its centre. The seams between faces, which are full of steps,
are replaced by paths along edges with few turns, close to the fair seams of the triangles. The
pieces are solved from the shape of these.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from gso.cut_pieces import Pieces
from gso.geometry.plane import Plane
from gso.mesh import Mesh, Nearest
from gso.mesh.separation import centres
from gso.mesh.topology import edge_keys, label_components, pair_keys
from gso.seams.budgets import Budgets
from gso.seams.candidates import disks
from gso.seams.carrying import spread
from gso.seams.chains import chains
from gso.seams.kinds import edges_between
from gso.seams.options import PieceSettings
from gso.seams.regions import Divided, Regions, connected, numbered
from gso.seams.sheets import flattened
from gso.seams.symmetry import Mirror
from gso.seams.tree import Ground
from gso.seams.trial import Allowed, Trial
from gso.seams.trial_solve import tried
from gso.typing import Array, Ints

#: Largest distance of a seam from the fair one, and factor on what an edge costs for the square of
#: it, in mean edge lengths.
_BAND, _AWAY = 3.0, 0.25
#: Distance from the fair seams, in mean edge lengths, from which on the shape of the triangles is
#: taken.
_CLEAR = 1.2
#: Weights, in turn, of the squared Laplacian of the displacement to begin with: triangles bend
#: along the diagonals of quads.
_SMOOTH = (1.0, 4.0)
#: Strain over the allowed one up to which patterns are laid again.
_NEARLY = 2.0
#: Iterations of the solve, and how often it is repeated.
_ITERATIONS, _REPAIRS = 40, 3
#: Largest distance of the centre of a face from a mirror image, in mean edge lengths.
_SAME = 0.1
#: Largest ratios of the number of pieces, and of the length of seams, to those in triangles.
_MORE, _LONGER = 1.1, 1.15
_NO_EDGES = np.empty((0, 2), np.int64)


def rows_or_triangles(
    ground: Ground, trial: Trial, settings: PieceSettings, plane: Plane | None = None
) -> Trial:
    """Return pieces whose seams follow edges where these are about as good as those in triangles.

    Parameters
    ----------
    ground : Ground
        A design with quads.
    trial : Trial
        Pieces of its triangles.
    settings : PieceSettings
        With a largest distance.
    plane : Plane, optional
        Plane of symmetry of the seams; then the faces of the design have to be symmetric, too.
    """
    if settings.max_deviation is None:
        raise ValueError("the search within a distance needs max_deviation")
    settings.say("seams along edges")
    label = along_rows(ground, trial.pieces)
    if plane is not None:
        if not _is_symmetric(ground.mesh, plane):
            return trial
        label = Mirror(Regions(ground.mesh, _NO_EDGES), plane).alike(label)
    pieces = disks(ground, np.concatenate([edges_between(ground.mesh, label), ground.kept]))
    few = len(pieces) <= _MORE * len(trial.pieces)
    if trial.holds and not (few and _short(pieces, trial.pieces)):
        return trial
    found: list[Trial] = []
    for smooth in _SMOOTH:
        found.append(_solved(label, pieces, trial, smooth, settings))
        if found[-1].holds:
            break
    rows = min(found, key=lambda one: one.worst)
    if not trial.holds:
        return rows if rows.worst <= trial.worst else trial
    within = Budgets(rows, settings).missing <= Budgets(trial, settings).missing
    return rows if rows.holds and _short(rows.shape, trial.shape) and within else trial


def _is_symmetric(design: Mesh, plane: Plane) -> bool:
    """Tell whether faces are the mirror images of others."""
    middle = centres(design)
    away = cKDTree(middle).query(plane.image(middle))[0]
    return bool(away.max() <= _SAME * design.edge_lengths.mean())


def _short(rows: Pieces, fair: Pieces) -> bool:
    """Whether seams along edges are about as short as fair ones."""
    return rows.seam_length <= _LONGER * fair.seam_length


def along_rows(ground: Ground, fair: Pieces) -> Ints:
    """Return pieces of whole faces (m,) whose seams follow edges, near those of fair pieces.

    Parameters
    ----------
    ground : Ground
        A design with quads.
    fair : Pieces
        Pieces of its triangles, in the shape of the design.
    """
    design = ground.mesh
    face = Nearest(fair.design).nearest(centres(design))[0]
    label = numbered(connected(design, fair.of_face[face]))
    if not len(fair.edges):
        return label
    return _straighter(ground, label, _away(design, fair))


def _solved(
    label: Ints, pieces: Pieces, trial: Trial, smooth: float, settings: PieceSettings
) -> Trial:
    """Solve pieces along edges from the smoothed shape of those in triangles."""
    design = pieces.design
    found = tried(
        label,
        Divided(design, label, _NO_EDGES, np.empty(0)),
        pieces,
        Allowed(design, float(settings.max_deviation or 0.0), settings.max_strain),
        _start(pieces, trial, smooth),
        _ITERATIONS,
        repairs=_REPAIRS,
        executor=settings.executor,
        width=trial.width,
    )
    # Where little is missing, patterns with the least largest strain may do.
    again = np.flatnonzero((found.strain > 1.0) & (found.strain <= _NEARLY))
    meshes = [found.shape.parts[k].mesh for k in again.tolist()]
    sheets, strain = list(found.sheets), found.strain.copy()
    for k, sheet in zip(again.tolist(), settings.executor.map(flattened, meshes), strict=True):
        if sheet is not None:
            sheets[k], strain[k] = sheet, sheet.strain / settings.max_strain
    return replace(found, sheets=tuple(sheets), strain=strain)


def _start(pieces: Pieces, trial: Trial, smooth: float) -> Array:
    """Return the points (n, 3) of pieces along edges that follow the shape of those in triangles.

    Next to seams that moved, these are on the other side of a ridge.
    """
    fair, design = trial.pieces, pieces.design
    n = len(design.vertices)
    inside = fair.opened.vertex[np.bincount(fair.opened.vertex)[fair.opened.vertex] == 1]
    of = np.full(len(fair.design.vertices), -1)
    of[fair.opened.vertex] = fair.of_vertex
    clear = np.zeros(len(of), bool)
    clear[inside] = True
    if len(fair.edges):
        clear[:n] &= _away(design, fair) > _CLEAR
    vertex, own = pieces.opened.vertex, pieces.of_vertex
    table = np.zeros((len(pieces), len(fair)), np.int64)
    some = np.flatnonzero((own >= 0) & (of[vertex] >= 0))
    np.add.at(table, (own[some], of[vertex[some]]), 1)
    same = clear[vertex] & (of[vertex] == table.argmax(axis=1)[own]) & (own >= 0)
    known = np.flatnonzero(same)
    moved = trial.shape.design.vertices[vertex[known]] - design.vertices[vertex[known]]
    return spread(pieces, known, moved, smooth)


def _away(design: Mesh, fair: Pieces) -> Array:
    """Return the distance of vertices (n,) from the seams of pieces, in mean edge lengths."""
    line = fair.design.vertices[fair.edges]
    near = cKDTree(np.concatenate([line[:, 0], line[:, 1], line.mean(axis=1)]))
    return np.asarray(near.query(design.vertices)[0] / float(design.edge_lengths.mean()))


def _straighter(ground: Ground, label: Ints, away: Array) -> Ints:
    """Replace seams between pieces (m,) by paths along edges with few turns.

    Each path joins the ends of its seam; an end on the boundary may move along it. It is the
    cheapest for the distance (n,) of vertices from where seams should be, in mean edge lengths.
    """
    design, n = ground.mesh, len(ground.mesh.vertices)
    he = design.half_edges
    k = he.interior
    ends = np.stack([he.origin[k], he.dest[k]], axis=1)
    faces = np.stack([he.face[k], he.face[he.twin[k]]], axis=1)
    border = label[faces[:, 0]] != label[faces[:, 1]]
    weight = 1.0 + _AWAY * (away[ground.paths.ends] ** 2).mean(axis=1)
    rim, far = he.boundary_vertex, away > _BAND
    lines = [line for _, line in chains(ends[border], label[faces[border]])]
    taken = np.zeros(n, bool)
    taken[[end for line in lines for end in line[[0, -1]].tolist()]] = True
    kept = pair_keys(ground.kept, n)
    firm = [bool(np.isin(edge_keys(x[:-1], x[1:], n), kept).any()) for x in lines]
    found = [line for line, stays in zip(lines, firm, strict=True) if stays]
    taken[np.concatenate([np.empty(0, np.int64), *found])] = True
    free = [line for line, stays in zip(lines, firm, strict=True) if not stays]
    for line in sorted(free, key=len, reverse=True):
        start, stop = line[[0, -1]] if rim[line[-1]] else line[[-1, 0]]
        goal = np.arange(n) == stop
        if rim[stop]:
            reach = np.linalg.norm(design.vertices - design.vertices[stop], axis=1)
            goal |= rim & ~far & ~taken & (reach <= _BAND * design.edge_lengths.mean())
        closed = far | taken | rim
        closed[goal] = closed[start] = False
        path = line
        if start != stop:
            path = ground.paths.cheapest(int(start), goal, weight, closed)
            path = path if goal[path[-1]] else line
        found.append(path)
        taken[path] = True
    apart = np.isin(
        pair_keys(ends, n), np.concatenate([edge_keys(x[:-1], x[1:], n) for x in found])
    )
    new = label_components(len(design.faces), *faces[~apart].T)
    return numbered(new) if new.max() == label.max() else label

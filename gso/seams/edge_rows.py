"""Pieces of quad designs whose seams run along edge rows, from pieces of their triangles.

Each face goes to the piece that has its centre. The seams between faces, which are full of steps,
are replaced by paths along edges with few turns, close to the fair seams of the triangles. The
pieces are solved from the shape of these.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from gso.cut_pieces import Pieces
from gso.mesh import Mesh, Nearest
from gso.mesh.separation import centres
from gso.mesh.topology import edge_keys, label_components, neighbour_means, pair_keys
from gso.seams.budgets import Budgets
from gso.seams.candidates import disks
from gso.seams.chains import chains
from gso.seams.kinds import edges_between
from gso.seams.options import PieceSettings
from gso.seams.regions import Divided, connected, numbered
from gso.seams.tree import Ground
from gso.seams.trial import Allowed, Trial, tried
from gso.typing import Array, Ints

#: Largest distance of a seam from the fair one, and factor on what an edge costs for the square of
#: it, in mean edge lengths.
_BAND, _AWAY = 3.0, 0.25
#: Steps that smooth the displacement to begin with: triangles bend along the diagonals of quads.
_SMOOTH = 3
#: Iterations of the solve, and how often it is repeated.
_ITERATIONS, _REPAIRS = 40, 3
#: Largest ratios of the number of pieces, and of the length of seams, to those in triangles.
_MORE, _LONGER = 1.1, 1.15


def rows_or_triangles(ground: Ground, trial: Trial, settings: PieceSettings) -> Trial:
    """Return pieces whose seams follow edges where these are about as good as those in triangles.

    Parameters
    ----------
    ground : Ground
        A design with quads.
    trial : Trial
        Pieces of its triangles.
    settings : PieceSettings
        With a largest distance.
    """
    if settings.max_deviation is None:
        raise ValueError("the search within a distance needs max_deviation")
    settings.say("seams along edges")
    rows = _solved(ground, trial, settings)
    if not trial.holds:
        return rows if rows.excess.max() <= trial.excess.max() else trial
    few = len(rows.pieces) <= _MORE * len(trial.pieces)
    short = rows.shape.seam_length <= _LONGER * trial.shape.seam_length
    within = Budgets(rows, settings).missing <= Budgets(trial, settings).missing
    return rows if rows.holds and few and short and within else trial


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
    line = fair.design.vertices[fair.edges]
    near = cKDTree(np.concatenate([line[:, 0], line[:, 1], line.mean(axis=1)]))
    away = near.query(design.vertices)[0] / float(design.edge_lengths.mean())
    return _straighter(ground, label, away)


def _solved(ground: Ground, trial: Trial, settings: PieceSettings) -> Trial:
    """Solve pieces along edges from the shape of those in triangles."""
    design, n = ground.mesh, len(ground.mesh.vertices)
    label = along_rows(ground, trial.pieces)
    pieces = disks(ground, np.concatenate([edges_between(design, label), ground.kept]))
    moved = trial.shape.design.vertices[:n] - design.vertices
    mean = neighbour_means(design.edges, n)
    for _ in range(_SMOOTH):
        moved = 0.5 * (moved + mean @ moved)
    return tried(
        label,
        Divided(design, label, np.empty((0, 2), np.int64), np.empty(0)),
        pieces,
        Allowed(design, float(settings.max_deviation or 0.0), settings.max_strain),
        design.vertices + moved,
        _ITERATIONS,
        repairs=_REPAIRS,
        executor=settings.executor,
        width=trial.width,
    )


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
    found = []
    for line in sorted(lines, key=len, reverse=True):
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

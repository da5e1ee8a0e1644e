"""Automatic cuts of surfaces that close around themselves, before they are flattened."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gso import metrics
from gso.faults import overlaps
from gso.mesh import Mesh
from gso.mesh.cut import Cut, cut, joining
from gso.parametrization.embedding import parts
from gso.parametrization.initial import DOUBTFUL, begin
from gso.typing import Array, Ints

#: Root-mean-square strain up to which a surface is not cut.
_SMALL = 1e-3
#: If the strain without cuts is above the first number, cuts must reduce it to the second share
#: of it at most, otherwise to the third.
_BAD, _BETTER, _MUCH_BETTER = 0.1, 0.8, 0.2
#: Fewer cuts are preferred if their strain is at most this multiple of the smallest.
_ALIKE = 1.1
#: Angle that a hole lacks from which on the image of a surface that is cut there may need this many
#: times as many iterations: the faces beside the cut turn by that angle.
_LACKING, _LONGER = np.radians(1.0), 4
#: A full turn, and the tolerance on the turning of a loop around a hole, -2 pi in the plane.
_ROUND, _TURN = 2.0 * np.pi, 0.5 * np.pi


class Opened(NamedTuple):
    """A surface that is ready to be flattened.

    Attributes
    ----------
    mesh : Mesh
        The surface to flatten, cut open if necessary; grids are numbered row by row.
    cut : Cut or None
        The cut; None if there is none.
    order : ndarray of int or None, (p,)
        Vertex of ``cut.mesh`` for each vertex of `mesh`.
    notes : tuple of str
        What was cut, and why.
    """

    mesh: Mesh
    cut: Cut | None = None
    order: Ints | None = None
    notes: tuple[str, ...] = ()

    @property
    def doubtful(self) -> float:
        """Strain above which other embeddings are tried; small with cuts, whose best was rated."""
        return DOUBTFUL if self.cut is None else _SMALL

    def back(self, flat: Array) -> Array:
        """Renumber an image of `mesh` as ``cut.mesh``; without a cut, return it unchanged."""
        if self.order is None:
            return flat
        out = np.empty_like(flat)
        out[self.order] = flat
        return out

    def faces_back(self, values: Array) -> Array:
        """Reorder values per face of `mesh` as the faces of ``cut.mesh``, likewise."""
        if self.order is None or self.cut is None:
            return values
        here, there = self.order[self.mesh.faces], self.cut.mesh.faces
        here = np.where(self.mesh.faces < 0, -1, here)
        own, wanted = (np.lexsort(np.sort(faces, axis=1).T) for faces in (here, there))
        out = np.empty_like(values)
        out[wanted] = values[own]
        return out


def opened(mesh: Mesh, *, iterations: int = 100) -> Opened:
    """Cut a surface along shortest lines between its boundary loops, where that is needed.

    A disk with holes can be flattened without a cut; a tube cannot. Both have several boundary
    loops, so both ways are tried: without a cut, and cut along a tree of shortest lines that
    joins the loops. A component is cut if its strain without a cut is not small, the cut reduces
    it substantially, and the cut does not make the pattern overlap itself. Loops that turn like
    a hole in the plane, such as holes in the side of a tube, are not joined by cuts if the
    strain is about as small without.

    Parameters
    ----------
    mesh : Mesh
        Components with a boundary and without handles; a grid is numbered row by row.
    iterations : int
        Largest number of iterations of :func:`gso.parametrization.arap`, for each way.

    Raises
    ------
    MeshError
        A component is closed or has handles.
    """
    if len(mesh.boundary_loops) <= np.unique(mesh.components[mesh.used]).size:
        return Opened(mesh)
    lines, notes = [], []
    turns = metrics.turning(mesh)
    for ids in parts(mesh):
        own = mesh.components[ids[0]]
        here = [k for k, loop in enumerate(mesh.boundary_loops) if mesh.components[loop[0]] == own]
        if len(here) < 2:
            continue
        loops = [mesh.boundary_loops[k] for k in here]
        found = _best(mesh, ids, loops, turns[here], iterations)
        if found is not None:
            lines.append(found[0])
            notes.append(found[1])
    if not lines:
        return Opened(mesh)
    done = cut(mesh, np.concatenate(lines))
    ready, order = by_rows(done.mesh)
    return Opened(ready, done, order, tuple(notes))


def by_rows(mesh: Mesh) -> tuple[Mesh, Ints]:
    """Renumber a grid row by row; return the mesh and the old number of each vertex."""
    same = np.arange(len(mesh.vertices))
    if mesh.grid is None or mesh.grid_index is None or (mesh.grid_index.ravel() == same).all():
        return mesh, same
    return Mesh.from_grid(mesh.grid, weld=False), mesh.grid_index.ravel()


def _best(
    mesh: Mesh, ids: Ints, loops: list[Ints], turns: Array, iterations: int
) -> tuple[Ints, str] | None:
    """Choose the edges along which to cut one component, with a note; None for no cut.

    `loops` are its boundary loops and `turns` their turning angles.
    """
    uncut, lies_on_itself = _tried(mesh, ids, np.empty((0, 2), np.int64), iterations)
    if uncut <= _SMALL:
        return None
    tube = [loop for loop, angle in zip(loops, turns, strict=True) if abs(angle + _ROUND) > _TURN]
    choices = [tube, loops] if 2 <= len(tube) < len(loops) else [loops]
    trees = [joining(mesh, some) for some in choices]
    # Only the outer outline turns more than the others. The rest lack these angles to lie flat.
    lacking = float(np.sort(turns)[-2] + _ROUND)
    for longer in (1, _LONGER):
        tried = [_tried(mesh, ids, tree, longer * iterations) for tree in trees]
        levels = [level if lies_on_itself or not bad else np.inf for level, bad in tried]
        enough = max(_ALIKE * min(levels), _SMALL)
        which = next(k for k, level in enumerate(levels) if level <= enough)
        if levels[which] <= (_BETTER if uncut > _BAD else _MUCH_BETTER) * uncut:
            break
        if lacking < _LACKING or np.isinf(levels).all():
            return None
    else:
        return None
    between = len(choices[which])
    lines = "a shortest line" if between == 2 else f"{between - 1} shortest lines"
    return trees[which], (
        f"the surface closes around itself: it was cut open along {lines} of {len(trees[which])} "
        f"edges between {between} of its boundary loops, which takes the strain from "
        f"{uncut:.2g} to {levels[which]:.2g}; the pattern has the vertices there twice"
    )


def _tried(mesh: Mesh, ids: Ints, edges: Ints, iterations: int) -> tuple[float, bool]:
    """Cut one component along edges and compute its initial image.

    Returns its root-mean-square strain, and whether it overlaps itself.
    """
    part, local = mesh.restricted(ids)
    ready, _ = by_rows(cut(part, local[edges]).mesh)
    start = begin(ready, iterations=iterations, doubtful=_SMALL)
    return start.level, bool(overlaps(ready, start.flat).size)

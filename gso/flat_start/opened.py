"""Where a surface closes around itself and must be cut before it is laid out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gso import geometry
from gso.cutting import Cut, cut, joining
from gso.faults import overlaps
from gso.flat_start.begin import DOUBTFUL, begin
from gso.flat_start.embed import parts
from gso.mesh import Mesh

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Root-mean-square strain up to which a layout without cuts is left as it is.
_SMALL = 1e-3
#: Strain from which on it is bad, and the share of it that a cut has to leave at most; below
#: it, a cut has to do better.
_BAD, _BETTER, _MUCH_BETTER = 0.1, 0.8, 0.2
#: Strain, relative to the least, up to which fewer cuts are preferred.
_ALIKE = 1.1
#: How far the turning of a loop may be from that of a hole in the plane.
_TURN = 0.5 * np.pi


class Opened(NamedTuple):
    """A surface as it is laid out.

    Attributes
    ----------
    mesh : Mesh
        What is laid out: grids numbered row by row.
    cut : Cut or None
        How it was cut; None where it was not.
    order : ndarray of int or None, (p,)
        Vertex of ``cut.mesh`` that each vertex of `mesh` is.
    notes : tuple of str
        What was cut, and why.
    """

    mesh: Mesh
    cut: Cut | None = None
    order: Ints | None = None
    notes: tuple[str, ...] = ()

    @property
    def doubtful(self) -> float:
        """Strain from which on a start may be a bad one; a cut was chosen by its best."""
        return DOUBTFUL if self.cut is None else _SMALL

    def back(self, flat: Array) -> Array:
        """Image of `mesh` in the numbering of ``cut.mesh``, or as it is without a cut."""
        if self.order is None:
            return flat
        out = np.empty_like(flat)
        out[self.order] = flat
        return out

    def faces_back(self, values: Array) -> Array:
        """Numbers of the faces of `mesh` in the order of those of ``cut.mesh``, likewise."""
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

    A disk with holes lies flat with its holes; a tube does not. Both have several boundary
    loops, so both ways are tried: without a cut, and cut along a tree of shortest lines that
    joins the loops. The surface is cut where the strain without it is large, the strain with it
    is much less, and the pattern does not overlap itself. Holes in the side of a tube, around
    which the surface turns as around a hole in the plane, are left closed where that does not
    add strain.

    Parameters
    ----------
    mesh : Mesh
        Components with a boundary and without handles; a grid is numbered row by row.
    iterations : int
        Most steps of :func:`gso.flat_start.relax`, for each way.

    Raises
    ------
    MeshError
        A component is closed or has handles.
    """
    if len(mesh.boundary_loops) <= np.unique(mesh.components[mesh.used]).size:
        return Opened(mesh)
    lines, notes = [], []
    for ids in parts(mesh):
        own = mesh.components[ids[0]]
        loops = [loop for loop in mesh.boundary_loops if mesh.components[loop[0]] == own]
        if len(loops) < 2:
            continue
        found = _best(mesh, ids, loops, iterations)
        if found is not None:
            lines.append(found[0])
            notes.append(found[1])
    if not lines:
        return Opened(mesh)
    done = cut(mesh, np.concatenate(lines))
    ready, order = by_rows(done.mesh)
    return Opened(ready, done, order, tuple(notes))


def by_rows(mesh: Mesh) -> tuple[Mesh, Ints]:
    """A mesh, renumbered row by row if it is a grid; and the number that each vertex had."""
    same = np.arange(len(mesh.vertices))
    if mesh.grid is None or mesh.grid_index is None or (mesh.grid_index.ravel() == same).all():
        return mesh, same
    return Mesh.from_grid(mesh.grid, weld=False), mesh.grid_index.ravel()


def _best(mesh: Mesh, ids: Ints, loops: list[Ints], iterations: int) -> tuple[Ints, str] | None:
    """Edges to cut one component along, and what to say about it; None to leave it whole."""
    uncut, lies_on_itself = _tried(mesh, ids, np.empty((0, 2), np.int64), iterations)
    if uncut <= _SMALL:
        return None
    turned = [abs(turning(mesh, loop) + 2.0 * np.pi) > _TURN for loop in loops]
    tube = [loop for loop, turns in zip(loops, turned, strict=True) if turns]
    choices = [tube, loops] if 2 <= len(tube) < len(loops) else [loops]
    trees = [joining(mesh, some) for some in choices]
    tried = [_tried(mesh, ids, tree, iterations) for tree in trees]
    levels = [level if lies_on_itself or not bad else np.inf for level, bad in tried]
    enough = max(_ALIKE * min(levels), _SMALL)
    which = next(k for k, level in enumerate(levels) if level <= enough)
    if levels[which] > (_BETTER if uncut > _BAD else _MUCH_BETTER) * uncut:
        return None
    between = len(choices[which])
    lines = "a shortest line" if between == 2 else f"{between - 1} shortest lines"
    return trees[which], (
        f"the surface closes around itself: it was cut open along {lines} of {len(trees[which])} "
        f"edges between {between} of its boundary loops, which takes the strain from "
        f"{uncut:.2g} to {levels[which]:.2g}; the pattern has the vertices there twice"
    )


def _tried(mesh: Mesh, ids: Ints, edges: Ints, iterations: int) -> tuple[float, bool]:
    """How one component lies flat, cut along edges, at the start of its layout.

    Its root-mean-square strain, and whether it lies on itself.
    """
    local = np.full(len(mesh.vertices), -1)
    local[ids] = np.arange(len(ids))
    faces = mesh.faces[local[mesh.faces[:, 0]] >= 0]
    part = Mesh(mesh.vertices[ids], np.where(faces < 0, -1, local[faces]))
    ready, _ = by_rows(cut(part, local[edges]).mesh)
    start = begin(ready, iterations=iterations, doubtful=_SMALL)
    return start.level, bool(overlaps(ready, start.flat).size)


def turning(mesh: Mesh, loop: Ints) -> float:
    """Angle by which a boundary loop turns, seen on the surface, radians.

    2 pi round a disk in the plane, -2 pi round a hole in it, nothing round the end of a
    cylinder.
    """
    angles = np.zeros(len(mesh.vertices))
    for k in range(3):
        p, q, r = (mesh.vertices[mesh.triangles[:, (k + j) % 3]] for j in range(3))
        at = geometry.angle(tuple((q - p).T), tuple((r - p).T))
        angles += np.bincount(mesh.triangles[:, k], at, len(angles))
    return float((np.pi - angles[loop]).sum())

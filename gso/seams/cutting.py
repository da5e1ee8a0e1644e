"""Cutting a mesh along seams of any kind."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from gso.cut_pieces import Pieces
from gso.errors import OptionError
from gso.io import as_mesh
from gso.mesh import Mesh
from gso.mesh.cut import cut as cut_open
from gso.mesh.slicing import followed
from gso.seams.kinds import Edges, Seam


def cut(mesh: Mesh | ArrayLike, seams: Seam | Iterable[Seam] | ArrayLike) -> Pieces:
    """Cut a surface into pieces along seams.

    Parameters
    ----------
    mesh : Mesh, array_like or path
        The surface.
    seams : Seam, iterable of Seam, or array_like of int, (e, 2)
        What to cut along: :class:`~gso.seams.Edges`, :class:`~gso.seams.Path`,
        :class:`~gso.seams.Polyline`, :class:`~gso.seams.Slice`, :class:`~gso.seams.Labels`,
        :class:`~gso.seams.Creases`, or pairs of vertices.

    Returns
    -------
    Pieces
        The pieces, largest first. Seams that end inside the surface are darts.

    Raises
    ------
    MeshError
        A pair of vertices is no edge, there is no path between vertices, or no such labels.
    OptionError
        `seams` is something else, or a parameter of a seam is wrong.

    Examples
    --------
    >>> import gso, numpy as np
    >>> u, v = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 9), indexing="ij")
    >>> sheet = np.stack([u, v, 0.1 * u * v], axis=-1)
    >>> halves = gso.cut(sheet, gso.seams.Path([4, 40]))
    >>> len(halves), [piece.is_disk for piece in halves]
    (2, [True, True])
    >>> halves.sewn() == halves.design
    True
    """
    whole = as_mesh(mesh)
    wanted = _listed(seams)
    every = np.zeros((0, 2), np.int64)
    # Edges and paths refer to the vertices and edges of the input.
    for seam in sorted(wanted, key=lambda seam: seam.INSERTS):
        count = len(whole.vertices)
        whole, inserted, edges = seam.placed(whole)
        every = np.concatenate([followed(every, inserted, count), edges])
    return Pieces(whole, cut_open(whole, every))


def _listed(seams: Seam | Iterable[Seam] | ArrayLike) -> list[Seam]:
    if isinstance(seams, Seam):
        return [seams]
    if isinstance(seams, Iterable) and not isinstance(seams, str):
        given = list(seams)
        known = [s for s in given if isinstance(s, Seam)]
        if len(known) == len(given):
            return known
        if not known:
            return [Edges(np.array(given))]
    raise OptionError(
        f"seams is {seams!r}; it must be seams of gso.seams, such as Path, or pairs of vertices"
    )

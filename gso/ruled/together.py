"""Several ruled surfaces as one: the pieces of a design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gso.mesh import Mesh, Nearest
from gso.mesh.validation import have_area
from gso.parametrization import beside
from gso.pattern import Pattern
from gso.ruled.fold_lines import Folds
from gso.ruled.ruled_surface import RuledSurface
from gso.typing import Array, Ints


def together(surfaces: Sequence[RuledSurface], design: Mesh) -> RuledSurface:
    """Merge ruled surfaces that share nothing, with their patterns side by side.

    Parameters
    ----------
    surfaces : sequence of RuledSurface
    design : Mesh
        The whole design.
    """
    meshes = [surface.mesh for surface in surfaces]
    start = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])[:-1].tolist()
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    table = _stacked([m.faces for m in meshes], start)
    pattern = _pattern([surface.pattern for surface in surfaces], start)
    # Slivers of a small surface may have no area relative to all of them.
    kept = have_area(table, vertices) & have_area(pattern.faces, pattern.flat)
    mesh = Mesh(vertices, table[kept])
    strips = np.cumsum([0, *(surface.strips for surface in surfaces)])[:-1]
    return RuledSurface(
        mesh=mesh,
        strip=np.concatenate([s.strip + k for s, k in zip(surfaces, strips, strict=True)])[kept],
        flat=np.concatenate([surface.flat for surface in surfaces])[kept],
        rulings=_folds([surface.rulings for surface in surfaces], start),
        creases=_folds([surface.creases for surface in surfaces], start),
        pattern=replace(pattern, faces=pattern.faces[kept]),
        moved=Nearest(mesh).locate(design.vertices)[2],
        crossed=sum(surface.crossed for surface in surfaces),
    )


def _stacked(tables: Sequence[Ints], start: Sequence[int]) -> Ints:
    """Stack tables of faces (m, 3 or 4), with -1 for a corner that is missing."""
    wide = max(table.shape[1] for table in tables)
    out = []
    for table, first in zip(tables, start, strict=True):
        padded = np.pad(table, ((0, 0), (0, wide - table.shape[1])), constant_values=-1)
        out.append(np.where(padded < 0, -1, padded + first))
    return np.concatenate(out)


def _folds(several: Sequence[Folds], start: Sequence[int]) -> Folds:
    edges = [fold.edges.reshape(-1, 2) + k for fold, k in zip(several, start, strict=True)]
    return Folds(
        np.concatenate(edges),
        np.concatenate([fold.angles for fold in several]),
        np.concatenate([fold.radii for fold in several]),
    )


def _pattern(several: Sequence[Pattern], start: Sequence[int]) -> Pattern:
    first = np.cumsum([0, *(len(p.flat) for p in several)])[:-1].tolist()
    flats: list[Array] = beside([pattern.flat for pattern in several])
    return Pattern(
        np.concatenate(flats),
        _stacked([p.faces for p in several], first),
        np.concatenate([p.vertex + k for p, k in zip(several, start, strict=True)]),
        np.concatenate([p.seams + k for p, k in zip(several, first, strict=True)]),
    )

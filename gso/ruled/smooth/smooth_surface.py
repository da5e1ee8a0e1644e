"""A ruled surface as trimmed B-splines, with measures of how good it is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from gso.errors import MeshError
from gso.geometry.steady import steady
from gso.geometry.vectors import cross, lengths
from gso.mesh import Mesh, Nearest
from gso.ruled.ruled_surface import RuledSurface
from gso.ruled.smooth.patches import Patch, bends, patches
from gso.ruled.smooth.smooth_fit import Fitter, Smooth
from gso.ruled.smooth.smooth_trim import trimmed
from gso.spline import TrimmedSpline
from gso.spline.trimmed import Loop
from gso.typing import Array

#: Rulings at which a patch is measured, and points of each.
_RULINGS, _ACROSS = 400, 7
#: Turning of the normal along a ruling, in radians, up to which no other fit is tried, and the
#: largest number of fits.
_TORSAL, _ATTEMPTS = np.radians(0.1), 3
#: Relative speed below which the end of a ruling stays where it is.
_STILL = 1e-9


@dataclass(frozen=True)
class SmoothSurface:
    """Smooth strips close to a ruled surface: trimmed B-spline patches that share their edges.

    Attributes
    ----------
    patches : tuple of TrimmedSpline
        Splines of degree three along a strip (u) and one along its rulings (v), and flat
        triangles (degree one in both), with the outlines of the parts inside the design.
    turning : float
        Largest angle between the normals at the two ends of a ruling, inside the
        outline, in degrees; zero for a torsal surface, which is developable.
    kink : float
        Largest angle between the tangent planes of two patches of one strip, at the middle of
        their common ruling, in degrees. Creases between strips side by side are intended, and
        are not counted.
    distances : tuple of float
        Mean and largest distance from the surface of planar faces, in its unit; the larger of
        both directions.
    """

    patches: tuple[TrimmedSpline, ...]
    turning: float
    kink: float
    distances: tuple[float, float]

    @property
    def is_torsal(self) -> bool:
        """Whether normals turn by 0.1 degrees at most along rulings.

        Tangent planes of two patches must not differ by more at their common rulings, either.
        """
        return bool(max(self.turning, self.kink) <= np.degrees(_TORSAL))


def smooth_strips(surface: RuledSurface, design: Mesh | None = None) -> SmoothSurface:
    """Replace the planar faces of a ruled surface by smooth strips with straight rulings.

    Parameters
    ----------
    surface : RuledSurface
        The `ruled` of a result, or what :func:`gso.loft` returns.
    design : Mesh, optional
        The surface that they should be close to; the planar faces when not given, as where
        constraints move these away from the design.

    Returns
    -------
    SmoothSurface

    Raises
    ------
    MeshError
        The design was kept as it is, several strips run along lines of a mesh or are rings, the
        surface was read from a file of an earlier version, or its outline cannot be carried over
        to the smooth strips.

    Examples
    --------
    >>> import gso, numpy as np
    >>> t = np.linspace(0.0, 1.0, 50)
    >>> arc = np.stack([np.cos(t), np.sin(t), 0.0 * t], axis=1)
    >>> found = gso.smooth_strips(gso.loft(arc, 2.0 * arc + [0.0, 0.1, 1.0]))
    >>> found.turning < 0.1
    True
    >>> found.patches[0].spline.degrees
    (3, 1)
    """
    source, mesh = surface.untrimmed, surface.mesh
    if source is None:
        raise MeshError(
            "strips along lines of a mesh, rings, designs that were kept as they are, and those "
            "in files of an earlier version, have no smooth surfaces; ask for strips between "
            "rulings (RuledOptions(lines=False), --no-lines), or take the planar faces "
            "(gso.io.save_faces)"
        )
    size = mesh.diagonal
    middle = mesh.vertices.mean(axis=0)
    unit_mesh = mesh.replaced((mesh.vertices - middle) / size)
    face, corner = np.nonzero(mesh.faces >= 0)
    points = unit_mesh.vertices[mesh.faces[face, corner]]
    unit_source = source.transformed(lambda x: (x - middle) / size)
    target = None if design is None else design.replaced((design.vertices - middle) / size)
    fitter = Fitter(unit_source, target)
    found = fitter.first(points, source.owner[face])
    parts: list[Patch] = []
    turn, samples = np.inf, np.zeros((0, 3))
    for _ in range(_ATTEMPTS):
        tried = trimmed(patches(found.curves), unit_mesh)
        if not tried:
            break
        measured, inside = _measured(tried)
        if measured < turn:
            parts, turn, samples = tried, measured, inside
        if turn <= _TORSAL:
            break
        found = fitter.divided(Smooth(found.curves, _widened(found, tried)))
    if not parts or not len(samples):
        raise MeshError(
            "the outline cannot be carried over to smooth strips; take the planar faces, "
            "gso.io.save_faces"
        )
    there, back = Nearest(unit_mesh).distances(samples), _back(parts, unit_mesh)
    kink = max((bends(a, b) for a, b in combinations(parts, 2)), default=0.0)
    return SmoothSurface(
        tuple(part.trimmed(size, middle) for part in parts),
        float(np.degrees(turn)),
        float(np.degrees(kink)),
        (
            size * max(float(there.mean()), float(back.mean())),
            size * max(float(there.max()), float(back.max())),
        ),
    )


def _widened(found: Smooth, parts: Sequence[Patch]) -> Array:
    """Return the ranges of the spans, widened to what is inside the outlines of the patches."""
    spans = found.curves.spans
    ranges: Array = found.ranges.copy()
    for part in parts:
        if part.is_flat:
            continue
        for at, low, high in _rulings(part):
            knots = found.curves.knots[part.sequence]
            row = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, len(knots) - 2)
            own = np.flatnonzero((spans.sequence == part.sequence) & (spans.column == part.strip))
            which = own[np.searchsorted(spans.row[own], row)]
            np.minimum.at(ranges[:, 0], which, low)
            np.maximum.at(ranges[:, 1], which, high)
    return ranges


def _measured(parts: Sequence[Patch]) -> tuple[float, Array]:
    """Return the largest turning of the normal along a ruling, and points inside the outline.

    Between parts of a ruling that a hole divides, the normal counts, too.
    """
    import shapely

    worst, points = 0.0, []
    for part in parts:
        region = _region(part)
        for at, low, high in _rulings(part):
            if not part.is_flat:
                one, two = (part.normals(np.stack([at, v], axis=1)) for v in (low, high))
                angle = np.arctan2(lengths(cross(one, two)), np.einsum("kd,kd->k", one, two))
                # A point where all rulings meet has no normal.
                speed = [lengths(part.spline.evaluate(at, v, du=1)) for v in (low, high)]
                angle[np.minimum(*speed) < _STILL * np.maximum(*speed)] = 0.0
                worst = max(worst, float(angle.max(initial=0.0)))
            shares = np.linspace(0.0, 1.0, _ACROSS)[:, None]
            v = (low + shares * (high - low)).ravel()
            uv = np.stack([np.tile(at, _ACROSS), v], axis=1)
            uv = uv[shapely.contains_xy(region, *uv.T)]
            if len(uv):
                points.append(part.points(uv))
    return worst, np.concatenate([np.zeros((0, 3)), *points])


def _back(parts: Sequence[Patch], mesh: Mesh) -> Array:
    """Return the distances of the vertices of a mesh from the parts inside the outline."""
    import shapely

    vertices, triangles, count = [], [], 0
    for part in parts:
        uv, faces = part.triangles()
        region = _region(part)
        cells = shapely.polygons(uv[faces])
        kept = shapely.intersects(region, cells)
        vertices.append(part.points(uv))
        triangles.append(count + faces[kept])
        count += len(uv)
    near = Nearest.of(np.concatenate(vertices), np.concatenate(triangles))
    return near.distances(mesh.vertices)


def _region(part: Patch) -> Any:
    """Return the parameters inside the outlines as Shapely polygons."""
    import shapely

    rings = [[_ring(loop) for loop in loops] for loops in part.faces]
    region = shapely.multipolygons([shapely.Polygon(ring, holes) for ring, *holes in rings])
    shapely.prepare(region)
    return region


def _ring(loop: Loop) -> Array:
    return np.concatenate([curve[:-1] for curve in loop])


def _rulings(part: Patch) -> Iterator[tuple[Array, Array, Array]]:
    """Yield parameters (k,) of rulings of each outer outline, and their ends inside it."""
    import shapely

    for loop, *_ in part.faces:
        ring = _ring(loop)
        outline = shapely.Polygon(ring)
        low, high = ring.min(axis=0), ring.max(axis=0)
        at = low[0] + (np.arange(_RULINGS) + 0.5) / _RULINGS * (high[0] - low[0])
        ends = np.stack([np.stack([at, np.full_like(at, v)], axis=1) for v in (-1.0, 2.0)], axis=1)
        inside = steady(shapely.intersection, shapely.linestrings(ends), outline)
        box = shapely.bounds(inside)
        kept = np.isfinite(box[:, 0])
        yield at[kept], box[kept, 1], box[kept, 3]

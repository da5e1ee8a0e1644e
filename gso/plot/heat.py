"""Quantities that colour the faces of a plot, and their colour scales."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gso import metrics
from gso.components import average, several, sizes, split
from gso.errors import OptionError
from gso.mesh import Mesh, topology
from gso.typing import Array

#: Percentile at which scales of curvature and strain end: a scale up to spikes would hide the rest.
_TOP = 98.0


@dataclass(frozen=True)
class Scale:
    """Range of a colour bar, its label, and the name of a Matplotlib colour map."""

    label: str
    colours: str
    low: float
    high: float
    extend: str = "neither"


@dataclass(frozen=True)
class Heat:
    """One value per face (m,), NaN where undefined; panels may share a scale."""

    values: Array
    scale: Scale
    summary: str = ""


def per_face(mesh: Mesh, values: Array) -> Array:
    """Average values per vertex (n,) over the corners of each face (m,), ignoring NaN.

    Values per face are returned unchanged.

    Raises
    ------
    OptionError
        The values match neither the vertices nor the faces.
    """
    if values.shape == (len(mesh.vertices),):
        corners = np.where(mesh.faces >= 0, values[mesh.faces], np.nan)
        known = ~np.isnan(corners)
        total, count = np.where(known, corners, 0.0).sum(axis=1), known.sum(axis=1)
        return np.asarray(np.divide(total, count, out=np.full(len(total), np.nan), where=count > 0))
    if values.shape == (len(mesh.faces),):
        return values
    raise OptionError(
        f"values is an array {values.shape}; give one number per vertex "
        f"({len(mesh.vertices)},) or per face ({len(mesh.faces)},)"
    )


def _rising(values: Sequence[Array], label: str, colours: str, top: float = _TOP) -> Scale:
    """Make a scale for several panels, from zero to a percentile."""
    every = np.concatenate(values)
    every = every[np.isfinite(every)]
    high = max(float(np.percentile(every, top)) if every.size else 1.0, 1e-6)
    extend = "max" if every.max(initial=0.0) > high else "neither"
    return Scale(label, colours, 0.0, high, extend)


def curvatures(meshes: Sequence[Mesh]) -> list[Heat]:
    """Compute the absolute Gaussian curvature times the squared size of the first mesh.

    All meshes share one colour scale. Of the two triangulations of the quads the one with the
    larger value is used. If all meshes have the faces of the first, each component is scaled by
    its own size in the first.
    """
    alike = all(np.array_equal(m.faces, meshes[0].faces) for m in meshes)
    size = sizes(meshes[0]) if alike else metrics.unit(meshes[0])
    values = [per_face(m, np.abs(metrics.worst_curvature(m)) * size**2) for m in meshes]
    scale = _rising(values, "|K| · size²", "OrRd")
    return [Heat(v, scale) for v in values]


def distance(before: Mesh, after: Mesh) -> Heat:
    """Compute the distance of a surface to the one before, in percent of the latter's diagonal.

    If the faces are the same, each component uses its own diagonal. The colours show the
    distance from `after` to `before`. The summary also has the largest distance back, which is
    larger if a boundary has shrunk.
    """
    if several(before) and np.array_equal(before.faces, after.faces):
        percent = np.zeros(len(after.vertices))
        far = 0.0
        for part in split(before):
            percent[part.vertices] = _percent(part.mesh, part.of(after))
            far = max(far, _percent(part.of(after), part.mesh, by=part.mesh).max())
        mean = average(lambda one, other: _percent(one, other).mean(), before, after)
    else:
        percent, far = _percent(before, after), _percent(after, before, by=before).max()
        mean = percent.mean()
    values = per_face(after, percent)
    summary = f"mean {mean:.2g} %, largest {percent.max():.2g} %, back {far:.2g} %"
    scale = _rising([values], "distance (% of the diagonal)", "GnBu", top=100.0)
    return Heat(values, scale, summary)


def _percent(to: Mesh, of: Mesh, *, by: Mesh | None = None) -> Array:
    """Compute the distance of the vertices of one surface to another, percent of a diagonal."""
    return 100.0 / (by or to).diagonal * metrics.point_to_surface(of.vertices, to)


def strain(design: Mesh, flat: Array) -> Heat:
    """Compute the larger principal strain per face, percent: the maximum of its corner triangles.

    Parameters
    ----------
    design : Mesh
        The surface.
    flat : ndarray, (n, 2)
        Its flat pattern.
    """
    if flat.shape != (len(design.vertices), 2):
        raise OptionError(
            f"the flat pattern has {len(flat)} vertices and the surface {len(design.vertices)}; "
            "strain needs a pattern of this very surface"
        )
    quad = topology.are_quads(design.faces)
    corners = 100.0 * metrics.corner_strains(design, flat)
    of_quads, of_triangles = np.split(corners, [4 * quad.sum()])
    values = np.empty(len(quad))
    values[quad] = np.fmax.reduce(of_quads.reshape(4, -1), axis=0)
    values[~quad] = of_triangles
    summary = f"strain mean {np.nanmean(corners):.2g} %, largest {np.nanmax(corners):.2g} %"
    return Heat(values, _rising([values], "principal strain (%)", "PuRd"), summary)


def scales(design: Mesh, flat: Array, scale: Array) -> Heat:
    """Show the scale of each face (m,) in a conformal image (n, 2)."""
    ratio = metrics.quasi_conformal(design, flat)
    worst = 100.0 * float(np.nanmax(ratio) - 1.0)
    heat = numbers(design, scale, "length in the flat image / on the surface")
    return Heat(heat.values, heat.scale, f"angle distortion at most {worst:.2g} %")


def stretch(design: Mesh, mesh: Mesh) -> Heat:
    """Compute the larger deviation of each face's two principal stretches from one, percent."""
    large, small = metrics.stretches(design, mesh)
    values = 100.0 * np.maximum(np.abs(large - 1.0), np.abs(small - 1.0))
    known = values[np.isfinite(values)]
    summary = f"mean {known.mean():.2g} %, largest {known.max():.2g} %"
    return Heat(values, _rising([values], "stretch (%)", "PuRd", top=100.0), summary)


def numbers(mesh: Mesh, values: Array, label: str) -> Heat:
    """Show the user's own values in a scale from their minimum to their maximum."""
    shown = per_face(mesh, values)
    known = shown[np.isfinite(shown)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    return Heat(shown, Scale(label, "OrRd", low, high if high > low else low + 1.0))

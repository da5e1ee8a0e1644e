"""The objective of the formulation "curvature".

On the design scaled to the unit ball it is

    w_curvature mean |K| + w_fairness / 2 mean |second derivative|^2 + w_proximity mean d
    + w_elongation / 2 mean (elongation)^2

with |K| smoothed by a decreasing epsilon. The absolute value concentrates bending along few
lines, which lets a surface become developable. The angle defects of holes that have to close in
the plane count as curvature, too. Second derivatives are relative to a share of the design's
own, which is large where the design is developable. d penalises the displacement
from the design, its tangential part less: quadratically below `quadratic_below`, linearly
beyond. The elongation of an edge is zero within a range of length ratios. With `reach` there is
``w_reach / 2 mean (distance beyond the reach)^2``, too.

|K| is the mean over the angle defects of both triangulations of quads. Where coarse quads hide
curvature from both, a share of its weight goes to |K| by the normals of quads.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso import metrics as measure
from gso.components import several
from gso.energy import (
    Weighted,
    curvature,
    elongation,
    facing,
    fairness,
    gauss_image,
    holonomy,
    proximity,
    reach,
)
from gso.energy.base import Term
from gso.energy.losses import Absolute, Beyond, Distance
from gso.geometry import area_vectors
from gso.hierarchy import resample
from gso.mesh import Mesh, Nearest
from gso.mesh.normals import vertex_normals
from gso.tasks import per_component
from gso.tasks.developable.analysis import Analysis, Shape, own_bending
from gso.tasks.developable.options import Options
from gso.tasks.request import Request
from gso.typing import Array, Flags, Ints, N

#: Mean |K| and mean squared bending of a typical design, for which weights are quoted.
TYPICAL_CURVATURE = 0.3
TYPICAL_BENDING = 5.0
#: Factor on the weight of curvature on meshes that are not grids: more curvature remains there,
#: around irregular vertices and for lack of a coarse-to-fine sequence.
GENERAL = 1.8
#: Factors on weights on coarser meshes of triangles. Irregular triangles can hide curvature in
#: folds that finer meshes do not have; these weights lead to less energy on the design's own mesh.
#: Under constraints they would not.
COARSE_CURVATURE, COARSE_FAIRNESS = 1.5, 3.0
#: Factors on the weights of curvature, fairness and proximity where displacements are bounded.
BOUNDED = (4.5, 3.0, 0.3)
#: The mean of squared second differences along both polylines of quads is twice that across the
#: edges of triangles, in the mean over all directions.
_QUADS = 2.0
#: Radii of balls over the reach, the distance of their centres from the surface over the radius
#: from which on they count as empty, the reach over the radius, the least reach of a vertex, and
#: the cosine of the angle between normals of both sides.
_RADII, _EMPTY, _OF_RADIUS, _THINNEST = (0.15, 0.3, 0.5, 1.0, 1.5, 2.0), 0.85, 0.5, 0.05
_OPPOSITE = -0.5
#: Area of a triangle seen along its normal in the design, over its area there, below which the
#: barrier against folds acts.
_FACING = 0.15
#: Defect in degrees up to which an inner outline counts as a hole, as where patterns are cut open;
#: others are the ends of tubes. And the defect up to which a hole lacks no angle.
_HOLE, _LACKS = 90.0, 0.1


def adapted_weights(options: Options, curved: N, bending: N) -> tuple[N, N]:
    """Adapt the curvature and fairness weights to a design's mean |K| and squared bending."""
    curvature = options.w_curvature * (TYPICAL_CURVATURE / curved) ** 0.2
    return curvature, options.w_fairness * (TYPICAL_BENDING / (bending + 1.0)) ** 0.5


def objective(
    analysis: Analysis, request: Request[Options], mesh: Mesh, image: float = 0.0
) -> list[Weighted]:
    """Build the terms on the design or on a coarser copy of it, without constraints.

    Several components are weighted each for its own size and curvature. `image` is the share of
    the weight of curvature for curvature by the normals of quads.
    """
    whole = not request.options.by_component or request.options.reach is not None
    if whole or not several(analysis.mesh):
        shape = analysis.shape
        if mesh is not shape.mesh and mesh.grid_index is None:
            request = _on_triangles(request, analysis)
        return _terms(request, shape, shape.curvature, mesh, image)

    def make(own: Mesh) -> list[Weighted]:
        shape = Shape(own)
        return _terms(request, shape, measure.loss_gc_worst(own, scale=1.0), own, image)

    return per_component.objective(mesh, make)


def _on_triangles(request: Request[Options], analysis: Analysis) -> Request[Options]:
    """Return a request with the weights for a coarser mesh of triangles."""
    o = request.options
    fairness = 1.0 if analysis.mesh.has_triangles else _QUADS
    curvature = 1.0
    if analysis.constraints.empty:
        curvature, fairness = COARSE_CURVATURE, COARSE_FAIRNESS * fairness
    options = replace(o, w_curvature=curvature * o.w_curvature, w_fairness=fairness * o.w_fairness)
    return replace(request, options=options)


def _terms(
    request: Request[Options], shape: Shape, curved: float, mesh: Mesh, image: float
) -> list[Weighted]:
    """Build the terms of one component, on its own mesh or on a coarser copy of it."""
    o = request.options
    w_curvature, w_fairness = adapted_weights(o, max(curved, 1e-3), shape.bending)
    w_curvature *= (
        request.weight_factor if mesh.grid_index is not None else GENERAL * request.weight_factor
    )
    w_proximity = o.w_proximity
    if request.max_displacement is not None:
        # The bound keeps the result close, so the other terms can be stronger.
        w_curvature, w_fairness = BOUNDED[0] * w_curvature, BOUNDED[1] * w_fairness
        w_proximity = BOUNDED[2] * w_proximity
    normals = vertex_normals(mesh)
    near = proximity.build(mesh, normals, tangential=o.tangential)
    by_image = image * w_curvature
    bent = [(t, w_curvature - by_image) for t in curvature.build(mesh)]
    if image > 0:
        bent += [(t, by_image) for t in gauss_image.build(mesh)]
    bent += [(t, o.w_holes * w_curvature) for t in holonomy.build(mesh, _holes(mesh))]
    items = [Weighted(t, w, Absolute(o.eps)) for t, w in bent]
    smooth = shape.smooth
    if mesh is shape.mesh:
        share = shape.own_bending
    else:
        smooth = mesh.replaced(_resample(smooth, mesh))
        share = own_bending(smooth)
    fair = fairness.build(mesh, reference=smooth.vertices, share=share)
    items.append(Weighted(fair, w_fairness))
    items.append(Weighted(near, w_proximity, Distance(o.quadratic_below)))
    if o.reach is not None:
        limits = _limits(mesh, normals, o.reach)
        far = reach.build(mesh, normals, limits, _rim(mesh))
        items.append(Weighted(far, o.w_reach, Beyond(1.0)))
    if o.w_facing > 0.0:
        items.append(Weighted(_facing(mesh), o.w_facing))
    items.append(Weighted(elongation.build(mesh), o.w_elongation))
    return items + request.own_items(mesh, items)


def _facing(mesh: Mesh) -> Term:
    """Build the barrier against triangles that turn away from those of the design."""
    vectors = area_vectors(mesh.vertices, mesh.triangles)
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    directions = vectors / np.maximum(size, 1e-300) ** 2
    weights = np.full(len(directions), 1.0 / len(directions))
    return facing.build(mesh.triangles, directions, weights, least=_FACING)


def _limits(mesh: Mesh, normals: Array, most: float) -> Array:
    """Return how far each vertex (n,) may move: less where the surface is thin, as at rods.

    There a ball that touches the surface at the vertex contains points of the other side.
    """
    near, out = Nearest(mesh), np.full(len(mesh.vertices), _THINNEST)
    towards = area_vectors(mesh.vertices, mesh.triangles)
    towards /= np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-300)
    for radius in _RADII:
        empty = np.ones(len(out), bool)
        for side in (-radius, radius):
            triangle, away = near.nearest(mesh.vertices + side * most * normals)
            other = np.einsum("nd,nd->n", towards[triangle], normals) < _OPPOSITE
            empty &= (away >= _EMPTY * radius * most) | ~other
        out = np.maximum(out, np.where(empty, _OF_RADIUS * radius, 0.0))
    return np.asarray(most * np.minimum(out, 1.0))


def _rim(mesh: Mesh) -> Flags:
    """Mark the vertices (n,) of boundary edges that are no seams: no other edge is there."""
    ends = mesh.edges[mesh.boundary_edges]
    _, place = np.unique(mesh.vertices[ends.ravel()], axis=0, return_inverse=True)
    pairs = np.sort(place.reshape(ends.shape), axis=1)
    _, same, often = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    rim = np.zeros(len(mesh.vertices), bool)
    rim[ends[often[same.reshape(-1)] == 1]] = True
    return rim


def _holes(mesh: Mesh) -> list[Ints]:
    """Return the inner outlines that have to close in the plane.

    They are those that nearly do in the design, unless all of them lack an angle: then the pattern
    can be cut open at them. Cut open at a hole with too much angle it would lie on itself.
    """
    if len(mesh.boundary_loops) < 2:
        return []
    defects = measure.hole_defects(mesh)
    near = np.abs(defects) < _HOLE
    if (defects[near] > _LACKS).all():
        return []
    return [mesh.boundary_loops[k] for k in measure.inner_outlines(mesh)[near]]


def _resample(source: Mesh, target: Mesh) -> Array:
    """Resample the vertices of one grid at the resolution of another, row by row.

    Meshes that are not grids have no smoothed vertices: their own are returned.
    """
    if source.grid is None or target.grid_shape is None:
        return target.vertices
    return resample(source.grid, *target.grid_shape).reshape(-1, 3)

"""What pieces of whole designs are compared with: charts of xatlas, and published results."""

from __future__ import annotations

import importlib.util
import time
from itertools import product

import numpy as np

from gso import metrics
from gso.components import split
from gso.mesh import Mesh
from gso.unfolding.manifold import manifold_mesh

#: Largest costs of a chart, and weights of its deviation from a plane, that are tried for a number
#: of charts.
_COSTS, _PLANAR = (0.5, 1.0, 4.0, 16.0), (2.0, 1.0, 0.5, 0.0)
#: The largest cost, and that weight, at which charts are strained least.
_LEAST = (0.5, 2.0)
#: The columns of published results.
_COLUMNS = ("pieces", "seam", "mean %", "max %", "p99", "source")
#: Published piecewise developable results by the name of the design. The seam is relative to the
#: root of the area, and distances are per cent of the diagonal. What is not known is not a number.
#: The methods are Stein et al. 2018 (Developability of triangle meshes), Binninger et al. 2021
#: (Developable approximation via Gauss image thinning) and Zhao et al. 2022 (Developability-driven
#: piecewise approximations for triangular meshes); it is not known which of them each row is of.
_SOURCE = "Stein 2018, Binninger 2021 or Zhao 2022"
PUBLISHED: dict[str, dict[str, float | str]] = {
    name: dict(zip(_COLUMNS, (*figures, _SOURCE), strict=True))
    for name, figures in {
        "bunny": (18, 10.9, 0.39, 1.70, 4e-4),
        "tortoise": (25, 12.0, np.nan, np.nan, np.nan),
    }.items()
}


def has_xatlas() -> bool:
    """Tell whether xatlas is installed."""
    return importlib.util.find_spec("xatlas") is not None


def least_strained(mesh: Mesh) -> dict[str, float]:
    """Measure the charts of xatlas at its lowest distortion."""
    return _charts(mesh, *_LEAST)


def as_many(mesh: Mesh, count: int) -> dict[str, float]:
    """Measure the charts of xatlas of which there are about as many as pieces.

    Of several with the same number, those with the least strain are taken.
    """
    tried = [_charts(mesh, *options) for options in product(_COSTS, _PLANAR)]
    return min(tried, key=lambda one: (abs(np.log(one["pieces"] / count)), one["p99"]))


def _charts(mesh: Mesh, cost: float, planar: float) -> dict[str, float]:
    """Measure the charts of xatlas: their number, seam, strain of the worst, and seconds."""
    import xatlas

    clock = time.perf_counter()
    atlas = xatlas.Atlas()
    atlas.add_mesh(mesh.vertices.astype(np.float32), mesh.triangles.astype(np.uint32))
    options = xatlas.ChartOptions()
    options.max_cost, options.normal_deviation_weight = cost, planar
    atlas.generate(options)
    seconds = time.perf_counter() - clock
    vertex, faces, flat = atlas[0]
    # Charts may touch themselves at a vertex.
    opened, copied = manifold_mesh((mesh.vertices[vertex], faces.astype(np.int64)))
    flat = flat[copied].astype(float) * [atlas.width, atlas.height]
    p99 = largest = 0.0
    for part in split(opened):
        # Each chart at its own best scale, and not mirrored.
        own = flat[part.vertices]
        if len(metrics.flipped_faces(part.mesh, own)) > 0.5 * len(part.faces):
            own = own * [-1.0, 1.0]
        image = metrics.area(part.mesh, own)
        own = own * np.sqrt(part.area / image)
        strains = metrics.strains(part.mesh, own)
        p99, largest = max(p99, strains["strain_p99"]), max(largest, strains["strain_max"])
    length, rim = (
        sum(
            float(np.linalg.norm(m.vertices[x] - m.vertices[np.roll(x, 1)], axis=1).sum())
            for x in m.boundary_loops
        )
        for m in (opened, mesh)
    )
    seam = 0.5 * (length - rim) / np.sqrt(metrics.area(mesh))
    return {
        "pieces": int(atlas.chart_count),
        "seam": seam,
        "p99": p99,
        "largest": largest,
        "s": seconds,
    }

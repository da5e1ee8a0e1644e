"""Nets on families of surfaces that none was trained on.

These are the families of validation and of the test of the broad set (:mod:`gso.dataset.broad`),
the named shapes of the data set, and noise. The trivial method beside the nets is the optimiser
with its default preset.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import shapely
from harness import progress, quietly, tabulate

import gso
from gso import metrics, net
from gso.dataset import broad, shapes
from gso.dataset.bezier import normalise
from gso.mesh import Mesh
from gso.net.catalogue import SIZE
from gso.parametrization import as_patch
from gso.typing import Array

#: Standard deviation of the noise over the distance of rows, of a flat sheet and of a cylinder.
NOISE = 0.02


def surfaces(n: int, seed: int) -> dict[str, Array]:
    """Return n grids (n, 64, 64, 3), or all there are, of each family; seed 0 is no training's."""
    out = {}
    for split in ("validation", "test"):
        names = broad.families(split)
        for k, name in enumerate(names):
            numbers = range(k, k + n * len(names), len(names))
            out[name] = np.stack([broad.draw(split, i, seed=seed) for i in numbers])
    out |= {name: shapes.sample(name, seed=seed)[:n] for name in shapes.NAMES}
    rng = np.random.default_rng(seed)
    s, t = np.meshgrid(*(np.linspace(-1.0, 1.0, 64),) * 2, indexing="ij")
    bent = np.stack([np.sin(1.2 * s) / 1.2, t, np.cos(1.2 * s) / 1.2], axis=-1)
    flat = np.stack([s, t, 0.0 * s], axis=-1)
    out["cylinder"] = normalise(bent)[None]
    step = NOISE * 2.0 / 63
    noisy = [(flat, bent)[k % 2] + step * rng.standard_normal(flat.shape) for k in range(min(n, 8))]
    out["noise"] = np.stack([normalise(grid) for grid in noisy])
    return out


def gone(models: str = "developable,net-cf", n: int = 24, seed: int = 9) -> dict[str, Any]:
    """Print the share of the curvature that is gone, and the distance, by family.

    The share is that of the worse split of the quads, which nets cannot lower by crumpling cells;
    "worse" is the number of results with more curvature than their input.
    """
    methods = {name: partial(_of_net, name) for name in models.split(",")} | {"balanced": _solved}
    rows: dict[str, dict[str, float]] = {}
    for family, grids in surfaces(n, seed).items():
        row = rows[family] = {"surfaces": len(grids), "K": _mean(metrics.loss_gc_worst, grids)}
        for name, method in methods.items():
            found = [method(grid) for grid in progress(grids, f"{family} {name}")]
            pairs = list(zip(grids, found, strict=True))
            share = np.array([metrics.K_A_r_worst(*pair) for pair in pairs])
            row[f"{name} gone"] = float(np.median(share))
            row[f"{name} 1 in 10"] = float(np.quantile(share, 0.1))
            row[f"{name} worse"] = int((share < -1e-9).sum())
            row[f"{name} d_H"] = float(np.mean([metrics.d_H(*pair) for pair in pairs]))
    return tabulate(f"Share of |K| gone, {n} surfaces of seed {seed} each", ["family"], rows)


#: Outlines (n, 2) of meshes that are no grids.
OUTLINES = {
    "square": [(-1, -1), (1, -1), (1, 1), (-1, 1)],
    "ellipse": [(np.cos(t), 0.5 * np.sin(t)) for t in np.linspace(0, 2 * np.pi, 80)[:-1]],
    "triangle": [(-1, -0.8), (1, -0.8), (0, 1)],
    "L": [(-1, -1), (1, -1), (1, 0), (0, 0), (0, 1), (-1, 1)],
    "T": [(-0.2, -1), (0.2, -1), (0.2, 0.5), (1, 0.5), (1, 1), (-1, 1), (-1, 0.5), (-0.2, 0.5)],
    "U": [(-1, -1), (1, -1), (1, 1), (0.5, 1), (0.5, -0.3), (-0.5, -0.3), (-0.5, 1), (-1, 1)],
}
#: Heights over the plane of these meshes.
HEIGHTS = {
    "saddle": lambda x, y: 0.3 * (x * x - y * y),
    "dome": lambda x, y: -0.3 * (x * x + y * y),
    "wave": lambda x, y: 0.15 * np.sin(2.5 * x + 1.0) * np.cos(2.0 * y),
}


def outlines(model: str = "developable", seed: int = 0) -> dict[str, Any]:
    """Print the share of the curvature gone of triangle meshes with several outlines.

    They are resampled to grids by a harmonic map, by their flat image, and by what
    :func:`gso.net.predict` takes; "dist %" is the mean distance of vertices from the design.
    """
    rows: dict[Any, dict[str, float]] = {}
    for outline, corners in OUTLINES.items():
        for name, height in HEIGHTS.items():
            mesh = _inside(np.array(corners, float), height, np.random.default_rng(seed))
            row: dict[str, float] = {"vertices": len(mesh.vertices)}
            for flat in (False, True):
                how = "flat image" if flat else "harmonic"
                row[how] = np.nan
                try:
                    patch = as_patch(mesh, SIZE, flat=flat)
                except gso.MeshError:
                    continue
                moved = net.predict(patch.grid, model=model, guarded=False) - patch.grid
                points = mesh.vertices.copy()
                points[patch.vertices] += patch.at_vertices(moved)
                row[how] = metrics.K_A_r_worst(mesh, mesh.replaced(points))
            found = net.predict(mesh, model=model)
            row |= {"predict": metrics.K_A_r_worst(mesh, found), "dist %": _far(mesh, found)}
            solved = quietly(gso.tno.optimize, mesh, verdict=False).mesh
            row |= {"balanced": metrics.K_A_r_worst(mesh, solved), "its dist %": _far(mesh, solved)}
            rows[outline, name] = row
    return tabulate("Share of |K| gone on meshes that are no grids", ["outline", "height"], rows)


def _inside(corners: Array, height: Any, rng: np.random.Generator) -> Mesh:
    """Return an irregular triangle mesh inside a polygon."""
    at = np.arange(-20, 21) * 0.05
    flat = np.stack(np.meshgrid(at, at, indexing="ij"), axis=-1)
    flat[1:-1, 1:-1] += 0.2 * 0.05 * rng.uniform(-1.0, 1.0, (39, 39, 2))
    whole = Mesh.from_grid(np.dstack([flat, height(*np.moveaxis(flat, -1, 0))]))
    middle = whole.vertices[whole.triangles].mean(axis=1)[:, :2]
    kept = whole.triangles[shapely.contains_xy(shapely.Polygon(corners), *middle.T)]
    used, faces = np.unique(kept, return_inverse=True)
    return Mesh(whole.vertices[used], faces.reshape(-1, 3))


def _far(before: Mesh, after: Mesh) -> float:
    away = np.linalg.norm(after.vertices - before.vertices, axis=1)
    return float(100.0 * away.mean() / before.diagonal)


def _of_net(name: str, grid: Array) -> Array:
    found: Array = net.predict(grid, model=name)
    return found


def _solved(grid: Array) -> Array:
    result = quietly(gso.tno.optimize, grid, verdict=False)
    return np.asarray(result.mesh.grid)


def _mean(metric: Any, grids: Array) -> float:
    return float(np.mean([metric(grid, scale=1.0) for grid in grids]))


SECTIONS = (gone, outlines)

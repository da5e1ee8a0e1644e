"""Quality and cost of the optimiser on the 24 reference surfaces.

Surfaces and noise come from ``bench/data/bench24.npz`` and are for reporting only: the presets
were tuned on surfaces of other seeds.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from designs.base import shuffled
from harness import PRESETS, compare, example, pure, quality, reference, solver
from report.peers_flatten import arap

import gso
from gso import metrics
from gso.dataset import bezier
from gso.pipeline import strains_of

PURE = "pure SciPy"
#: Largest acceptable angle of denoised surfaces, by the standard deviation of the noise.
FLOORS = {0.001: 0.30, 0.005: 0.82, 0.010: 1.30, 0.015: 1.70}


def _rated(points: np.ndarray, result: gso.Result) -> dict[str, Any]:
    judged = sum(result.seconds.get(k, 0.0) for k in ("pattern", "verdict"))
    return quality(points, result.grid) | {
        "strain": 100.0 * result.metrics.get("strain_max", np.nan),
        "s": result.seconds["total"] - judged,
        "backend": result.backend,
    }


def developable() -> dict[str, Any]:
    """Measure the three presets, and `balanced` without the optional backends."""
    surfaces, _ = reference()
    runs = {preset: solver(options=preset) for preset in PRESETS}
    runs |= {f"balanced, {PURE}": pure(runs["balanced"])}
    columns = ["loss_gc", "other split", "worse", "every 2nd", "K_A-r worse", "d_H %", "fairness"]
    high = partial(np.percentile, q=90)
    strains = [("strain %", "strain", np.median), ("90th", "strain", high)]
    columns = [*columns, *strains, ("backend", "backend", lambda x: x[-1])]
    curved = np.mean([metrics.loss_gc(s) for s in surfaces])
    title = f"Developable, 24 surfaces, mean input loss_gc {curved:.3f}"
    found = compare(title, runs, surfaces, _rated, columns, head="preset")
    given = np.median([strains_of(gso.Mesh.from_grid(s))["strain_max"] for s in surfaces])
    print("  strain: the largest of each result's pattern, median and 90th percentile; ", end="")
    print(f"of the input {100.0 * given:.3g} %")
    return found


def _flat(surface: Any, outcome: Any) -> dict[str, float]:
    """Rate a flat image, (H, W, 2) or (n, 2), or a result with one."""
    result = isinstance(outcome, gso.Result)
    flat = (outcome.flat if outcome.flat_grid is None else outcome.flat_grid) if result else outcome
    grid = isinstance(surface, np.ndarray)
    strains = metrics.principal_strains(surface, flat)
    return {
        "iso-cell": metrics.loss_iso_cell(surface, flat),
        "strain": strains.mean,
        "p99": strains.p99,
        "edges": metrics.edge_length_error(surface, flat),
        "flipped": metrics.flipped_cells(flat, None if grid else surface.faces),
    }


def flatten() -> dict[str, Any]:
    """Measure two formulations, and libigl's ARAP in the same run."""
    runs = {f: solver(task="flatten", formulation=f) for f in ("strain", "lengths")}
    runs["libigl ARAP, 100"] = lambda p: arap(gso.Mesh.from_grid(p)).reshape(*p.shape[:2], 2)
    runs[f"strain, {PURE}"] = pure(runs["strain"])
    columns = ["iso-cell", ("median", "iso-cell", np.median), "strain", "p99", "edges"]
    columns += [("flipped", np.sum)]
    title = "Flatten, 24 surfaces (floors: strain 0.0093 0.0353 0.0053 no flips; "
    title += "lengths 2.6e-5 1.7e-5 no flips; 0.15 s)"
    return compare(title, runs, reference()[0], _flat, columns, head="formulation")


def denoise() -> dict[str, Any]:
    """Measure denoising at four noise levels that the method is not given."""

    def solved(sigma: float) -> Any:
        return lambda pair: gso.tno.optimize(pair[0] + sigma * pair[1], task="denoise")

    def rated(pair: Any, result: gso.Result) -> dict[str, float]:
        angle = metrics.normal_angle(pair[0], result.grid)
        return {"theta deg": angle, "sigma found": result.details["sigma"]}

    return compare(
        "Denoise, 24 surfaces, nothing told about sigma",
        {f"{sigma:.3f}, floor {floor}": solved(sigma) for sigma, floor in FLOORS.items()},
        list(zip(*reference(), strict=True)),
        rated,
        ["theta deg", "sigma found"],
        head="sigma",
    )


def resolution() -> dict[str, Any]:
    """Solve the same surfaces at three resolutions with the same weights."""
    shapes, found = bezier.generate(24, seed=77), {}
    for preset, count in (("balanced", 24), ("accurate", 8)):

        def solved(shape: Any, size: int, options: str = preset) -> gso.Result:
            return gso.tno.optimize(shape.sample(size), options=options)

        found |= compare(
            f"One set of weights, {count} surfaces of seed 77",
            {f"{preset} {size}": partial(solved, size=size) for size in (32, 64, 128)},
            shapes[:count],
            lambda _, result: quality(result.design.grid, result.grid),
            ["loss_gc", "worse", "K_A-r", "d_H %", "fairness"],
            head="grid",
        )
    return found


def questions() -> dict[str, Any]:
    """Measure the limits `max_deviation` and `target_curvature`."""
    meshes = [gso.Mesh.from_grid(s) for s in reference()[0]]

    def bounded(mesh: gso.Mesh, share: float) -> tuple[float, gso.Result]:
        return share, gso.tno.optimize(mesh, max_deviation=share * mesh.diagonal)

    def within(mesh: gso.Mesh, outcome: tuple[float, gso.Result]) -> dict[str, float]:
        share, result = outcome
        far = metrics.point_to_surface(result.mesh.vertices, mesh).max()
        reach, both = far / (share * mesh.diagonal), 0.01 * result.metrics["distance_max"] / share
        curvature = result.metrics["loss_gc_worst"]
        return {"kept": reach <= 1 + 1e-6, "worse": curvature, "reach": reach, "both": both}

    runs = {f"within {share:.2%}": partial(bounded, share=share) for share in (0.0025, 0.005, 0.01)}
    columns = [("kept on", "kept", np.sum), "worse", ("largest / bound", "reach", np.max)]
    columns += [("both ways", "both", np.max)]
    title = "max_deviation, share of the diagonal"
    found = compare(title, runs, meshes, within, columns, head="bound")
    presets = {id(m): [gso.tno.optimize(m, options=p).metrics for p in PRESETS] for m in meshes}

    def aimed(mesh: gso.Mesh, target: float) -> tuple[float, gso.Result]:
        return target, gso.tno.optimize(mesh, target_curvature=target)

    def reached(mesh: gso.Mesh, outcome: tuple[float, gso.Result]) -> dict[str, float]:
        target, m = outcome[0], outcome[1].metrics
        others = [p["d_H"] for p in presets[id(mesh)] if p["loss_gc_worst"] <= target]
        met = m["loss_gc_worst"] <= 1.05 * target
        return {"met": met, "closest": m["d_H"] <= min(others, default=np.inf), "d_H %": m["d_H"]}

    runs = {f"target {target}": partial(aimed, target=target) for target in (0.05, 0.02)}
    columns = [("met on", "met", np.sum), ("closest on", "closest", np.sum), "d_H %"]
    title = "target_curvature; closest: no preset that meets it has a smaller mean distance"
    return found | compare(title, runs, meshes, reached, columns, head="target")


def general() -> dict[str, Any]:
    """Flatten and make developable meshes that are not grids."""
    irregular = example("irregular")
    grid = gso.Mesh.from_grid(example("teapot").patch(4, 33))
    patch = gso.Mesh(*shuffled(grid.vertices, grid.triangles, np.random.default_rng(5)))
    disk, hole = (gso.Mesh(*made()) for made in (irregular.disk, irregular.disk_with_hole))
    found = {}
    for name, mesh in (("teapot patch, triangles", patch), ("quads with a hole", hole)):
        runs = {f"{name}, strain": solver(task="flatten"), f"{name}, libigl ARAP": arap}
        columns = ["strain", "p99", "edges", "flipped"]
        found |= compare(f"Flatten, {name}", runs, [mesh], _flat, columns)
    for name, mesh in (("quads, irregular", disk), ("quads with a hole", hole)):
        bound = solver(max_deviation=0.01 * mesh.diagonal)
        found |= compare(
            f"Developable, {name}",
            {name: solver(), f"{name}, within 1 %": bound},
            [mesh],
            lambda _, result: result.metrics,
            ["loss_gc_worst_before", "loss_gc_worst", "K_A_r_worst", "d_H", "distance_max"],
        )
    return found


SECTIONS = (developable, flatten, denoise, resolution, questions, general)

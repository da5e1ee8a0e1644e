"""Quality and cost of the optimiser on the 24 reference surfaces.

Surfaces and noise come from ``bench/data/bench24.npz`` and are for reporting only: the presets
were tuned on surfaces of other seeds.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from typing import Any

import numpy as np
from harness import ROOT, compared, progress, pure, quality, reference, solver, table, timed
from report.energy import last_problem
from report.peers_flatten import arap

import gso
from gso import linalg, metrics
from gso.dataset import bezier
from gso.tno.layout import strains_of

PRESETS = ("fast", "balanced", "accurate")
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
    columns = ["loss_gc", "other split", "worse", "every 2nd", "K_A-r worse", "d_H %", "fairness"]
    strains = [
        ("strain %", "strain", np.median),
        ("90th", "strain", lambda x: np.percentile(x, 90)),
        ("backend", "backend", lambda x: x[-1]),
    ]
    curved = np.mean([metrics.loss_gc(s) for s in surfaces])
    found = compared(
        f"Developable, 24 surfaces, mean input loss_gc {curved:.3f}",
        runs | {f"balanced, {PURE}": pure(runs["balanced"])},
        surfaces,
        _rated,
        [*columns, *strains],
        head="preset",
    )
    given = [strains_of(gso.Mesh.from_grid(s))["strain_max"] for s in surfaces]
    print(
        "  strain: the largest of each result's pattern, median and 90th percentile; of the", end=""
    )
    print(f" input {100.0 * np.median(given):.3g} %")
    return found


def _flat(surface: Any, outcome: Any) -> dict[str, float]:
    """Rate a flat image, (H, W, 2) or (n, 2), or a result with one."""
    flat = outcome
    if isinstance(outcome, gso.Result):
        flat = outcome.flat if outcome.flat_grid is None else outcome.flat_grid
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
    return compared(
        "Flatten, 24 surfaces (floors: strain 0.0093 0.0353 0.0053 no flips; "
        "lengths 2.6e-5 1.7e-5 no flips; 0.15 s)",
        runs | {f"strain, {PURE}": pure(runs["strain"])},
        reference()[0],
        _flat,
        [
            *("iso-cell", ("median", "iso-cell", np.median), "strain", "p99", "edges"),
            ("flipped", "flipped", np.sum),
        ],
        head="formulation",
    )


def denoise() -> dict[str, Any]:
    """Measure denoising at four noise levels that the method is not given."""

    def solved(sigma: float) -> Any:
        return lambda pair: gso.tno.optimize(pair[0] + sigma * pair[1], task="denoise")

    def rated(pair: Any, result: gso.Result) -> dict[str, float]:
        angle = metrics.normal_angle(pair[0], result.grid)
        return {"theta deg": angle, "sigma found": result.details["sigma"]}

    return compared(
        "Denoise, 24 surfaces, nothing told about sigma",
        {f"{sigma:.3f}, floor {floor}": solved(sigma) for sigma, floor in FLOORS.items()},
        list(zip(*reference(), strict=True)),
        rated,
        ["theta deg", "sigma found"],
        head="sigma",
    )


def breakdown() -> dict[str, Any]:
    """Time one iteration at 64 x 64: evaluation with assembly, and factorisation."""
    surface = reference()[0][0]
    every = sorted(k for k, module in linalg.backends().items() if module.available())

    def milliseconds(function: Any, *given: Any, repeats: int = 15) -> float:
        return 1e3 * float(np.median([timed(function, *given)[1] for _ in range(repeats)]))

    out = {}
    for task, options, name in (
        ("developable", "balanced", "normal offsets"),
        ("developable", "accurate", "free vertices"),
        ("flatten", "balanced", "flat image"),
    ):
        problem, x = last_problem(surface, task, options)
        values = problem.linearise(x)[2]
        values[problem.diagonal] += 1e-9 * values[problem.diagonal].max()
        row = {"count": str(problem.variables.size)}
        row["evaluate"] = milliseconds(problem.linearise, x)
        for backend in every:
            chosen = linalg.choose(problem.pattern, backend)
            with linalg.blas_threads(1):
                chosen.factor(values)
                row[f"factor {backend}"] = milliseconds(chosen.factor, values, repeats=5)
        out[name] = row
    rows = [[name, *row.values()] for name, row in out.items()]
    table("One iteration at 64 x 64, milliseconds", ["unknowns", *out["flat image"]], rows)
    return out


def resolution() -> dict[str, Any]:
    """Solve the same surfaces at three resolutions with the same weights."""
    shapes = bezier.generate(24, seed=77)
    found = {}
    for preset, count in (("balanced", 24), ("accurate", 8)):
        found |= compared(
            f"One set of weights, {count} surfaces of seed 77",
            {
                f"{preset} {size}": lambda s, n=size, o=preset: gso.tno.optimize(
                    s.sample(n), options=o
                )
                for size in (32, 64, 128)
            },
            shapes[:count],
            lambda shape, result: quality(result.design.grid, result.grid),
            ["loss_gc", "worse", "K_A-r", "d_H %", "fairness"],
            head="grid",
        )
    return found


def questions() -> dict[str, Any]:
    """Measure the limits `max_deviation` and `target_curvature`."""
    surfaces, _ = reference()
    meshes = [gso.Mesh.from_grid(s) for s in surfaces]

    def within(mesh: gso.Mesh, outcome: tuple[float, gso.Result]) -> dict[str, float]:
        share, result = outcome
        bound = share * mesh.diagonal
        reach = metrics.point_to_surface(result.mesh.vertices, mesh).max() / bound
        both = 0.01 * result.metrics["distance_max"] / share
        curvature = result.metrics["loss_gc_worst"]
        return {"kept": reach <= 1 + 1e-6, "worse": curvature, "reach": reach, "both": both}

    found = compared(
        "max_deviation, share of the diagonal",
        {
            f"within {share:.2%}": lambda m, s=share: (
                s,
                gso.tno.optimize(m, max_deviation=s * m.diagonal),
            )
            for share in (0.0025, 0.005, 0.01)
        },
        meshes,
        within,
        [
            *(("kept on", "kept", np.sum), "worse"),
            *(("largest / bound", "reach", np.max), ("both ways", "both", np.max)),
        ],
        head="bound",
    )
    presets = {id(m): [gso.tno.optimize(m, options=p).metrics for p in PRESETS] for m in meshes}

    def reached(mesh: gso.Mesh, outcome: tuple[float, gso.Result]) -> dict[str, float]:
        target, result = outcome
        m = result.metrics
        others = [p["d_H"] for p in presets[id(mesh)] if p["loss_gc_worst"] <= target]
        met = m["loss_gc_worst"] <= 1.05 * target
        return {"met": met, "closest": m["d_H"] <= min(others, default=np.inf), "d_H %": m["d_H"]}

    return found | compared(
        "target_curvature; closest: no preset that meets it has a smaller mean distance",
        {
            f"target {target}": lambda m, t=target: (
                t,
                gso.tno.optimize(m, target_curvature=t),
            )
            for target in (0.05, 0.02)
        },
        meshes,
        reached,
        [("met on", "met", np.sum), ("closest on", "closest", np.sum), "d_H %"],
        head="target",
    )


def general() -> dict[str, Any]:
    """Flatten and make developable meshes that are not grids."""
    sys.path.insert(0, str(ROOT / "examples"))
    import irregular
    import teapot

    grid = gso.Mesh.from_grid(teapot.patch(4, 33))
    order = np.random.default_rng(5).permutation(len(grid.vertices))
    patch = gso.Mesh(grid.vertices[order], np.argsort(order)[grid.triangles])
    disk, hole = (gso.Mesh(*made()) for made in (irregular.disk, irregular.disk_with_hole))
    found = {}
    for name, mesh in (("teapot patch, triangles", patch), ("quads with a hole", hole)):
        found |= compared(
            f"Flatten, {name}",
            {f"{name}, strain": solver(task="flatten"), f"{name}, libigl ARAP": arap},
            [mesh],
            _flat,
            ["strain", "p99", "edges", "flipped"],
        )
    for name, mesh in (("quads, irregular", disk), ("quads with a hole", hole)):
        shown = ("loss_gc_worst_before", "loss_gc_worst", "K_A_r_worst", "d_H", "distance_max")
        bound = 0.01 * mesh.diagonal
        found |= compared(
            f"Developable, {name}",
            {name: solver(), f"{name}, within 1 %": solver(max_deviation=bound)},
            [mesh],
            lambda _, result: result.metrics,
            shown,
        )
    return found


def sizes() -> dict[str, Any]:
    """Measure larger grids: time per vertex relative to 64 x 64, and peak memory."""
    out: dict[str, dict[str, float]] = {}
    for task, preset, sides in (
        ("developable", "balanced", (64, 256, 512)),
        ("developable", "accurate", (64, 256)),
        ("flatten", "balanced", (64, 256, 512)),
    ):
        base = None
        for size in progress(sides, f"{task} {preset}"):
            code = (
                "import time, resource, json, gso\n"
                "from gso.dataset import bezier\n"
                "b = bezier.generate(1, seed=77)[0]\n"
                f"gso.tno.optimize(b.sample(64), task={task!r}, options={preset!r})\n"
                f"p = b.sample({size})\n"
                "s = []\n"
                f"for _ in range({5 if size == 64 else 1}):\n"
                "    t = time.perf_counter()\n"
                f"    r = gso.tno.optimize(p, task={task!r}, options={preset!r})\n"
                "    s.append(time.perf_counter() - t)\n"
                "peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
                "print(json.dumps([sorted(s)[len(s) // 2], peak]))\n"
            )
            done = subprocess.run(
                [sys.executable, "-c", code], capture_output=True, text=True, check=True
            )
            seconds, peak = json.loads(done.stdout)
            each = 1e6 * seconds / size**2
            base = base or each
            row = {"s": seconds, "us / vertex": each, "against 64": each / base}
            out[f"{task} {preset} {size}"] = row | {"peak GB": peak / 1e6}
    rows = [[name, *row.values()] for name, row in out.items()]
    table("Size", ["solve", "s", "us / vertex", "against 64", "peak GB"], rows)
    return out


def components() -> dict[str, Any]:
    """Solve a panel of 4 m alone and beside copies; its result must not depend on them."""
    grid = bezier.generate(1, seed=5)[0].sample(33)
    panel = gso.Mesh.from_grid(4000.0 * grid / metrics.unit(grid))
    size, count = panel.frame.scale, len(panel.vertices)
    noise = 1e-12 * size * np.random.default_rng(0).standard_normal((count, 3))
    asked = [
        *(("developable", "curvature", o) for o in PRESETS),
        ("developable", "isometry", "balanced"),
        ("developable", "isometry", "jiang2020"),
        *(("flatten", f, "balanced") for f in ("strain", "lengths", "isometry")),
        *(("denoise", f, "balanced") for f in ("smooth", "crease")),
        ("bend", "isometry", "balanced"),
        ("conformal", "isometry", "balanced"),
    ]

    def solved(shifts: list[list[float]], added: Any, wanted: tuple[str, str, str]) -> list[Any]:
        """Return the result of each copy, moved back to the panel's place."""
        points = panel.vertices + added
        mesh = gso.Mesh(
            np.concatenate([points + s for s in shifts]),
            np.concatenate([panel.faces + k * count for k in range(len(shifts))]),
        )
        task, formulation, options = wanted
        constraints = []
        if task == "bend":
            rows = np.arange(count).reshape(33, 33)
            every = count * np.arange(len(shifts))
            held, lifted = ((rows[r] + every[:, None]).ravel() for r in (0, -1))
            places = mesh.vertices[lifted] + np.array([-0.05, 0.0, 0.1]) * size
            constraints = [gso.Fixed(held), gso.Handle(lifted, places)]
        result = gso.tno.optimize(
            mesh, task=task, formulation=formulation, options=options, constraints=constraints
        )
        flat = task in ("flatten", "conformal")
        parts = result.components or [result]
        return [
            np.asarray(part.flat) if flat else part.mesh.vertices - s
            for part, s in zip(parts, shifts, strict=True)
        ]

    here = [0.0, 0.0, 0.0]
    beside = [[3.0 * size * k, 0.0, 0.0] for k in range(8)]
    cases = {
        "100 m away": [here, [1e5, 0.0, 0.0]],
        "duplicated": [here, here],
        "eight": beside,
        "100 sizes": [here, [100.0 * size, 0.0, 0.0]],
    }
    rows, out = [], {}
    for wanted in progress(asked, "components"):
        alone = solved([here], 0.0, wanted)[0]
        shaken = solved([here], noise, wanted)[0]
        flat = alone.shape[1] == 2
        figures: list[Any] = []
        for number, shifts in enumerate(cases.values()):
            found = solved(shifts, 0.0, wanted)
            if number == 0:
                for points in (alone, found[0]):
                    far = "-" if flat else np.linalg.norm(points - panel.vertices, axis=1).max()
                    figures.append(far)
            figures.append(max(float(np.abs(p - alone).max()) for p in found) / size)
        own = solved([[100.0 * size, 0.0, 0.0]], 0.0, wanted)[0]
        figures += [float(np.abs(p - alone).max()) / size for p in (own, shaken)]
        rows.append([" ".join(wanted), *figures])
        out[rows[-1][0]] = figures
    table(
        "A panel of 4 m and copies of it: largest displacement in mm, alone and with a copy 100 m "
        "away;\n  then the largest difference to the panel alone, in sizes",
        ["task", "alone", "with copy", *cases, "moved alone", "1e-12 noise"],
        rows,
    )
    return out


def startup() -> dict[str, Any]:
    """Time a new process that solves the panel, and `import gso`."""

    def median(command: list[str], repeats: int = 5) -> float:
        runs = [
            timed(lambda: subprocess.run(command, check=True, capture_output=True))[1]
            for _ in range(repeats)
        ]
        return float(np.median(runs))

    with tempfile.TemporaryDirectory() as folder:
        panel = str(ROOT / "examples" / "panel.obj")
        cold = median(
            [sys.executable, "-m", "gso.cli", "optimize", panel, "-o", f"{folder}/out.obj"]
        )
    more = median([sys.executable, "-c", "import numpy, gso"]) - median(
        [sys.executable, "-c", "import numpy"]
    )
    table(
        "Start-up",
        ["what", "median s", "at most"],
        [
            ["gso optimize panel.obj -o out.obj, cold", cold, 2.0],
            ["import gso over import numpy", more, 0.1],
        ],
    )
    return {"cold": cold, "import": more}


SECTIONS = (
    *(developable, flatten, denoise, breakdown, resolution, questions),
    *(general, sizes, components, startup),
)

"""Quality and cost of the optimiser on the 24 reference surfaces.

    python bench/tno.py                  everything (about ten minutes on two cores)
    python bench/tno.py developable      one section
    python bench/tno.py --json out.json  the figures as JSON, with machine and versions

Surfaces and noise come from ``bench/data/bench24.npz`` and are for reporting only: the presets
were tuned on surfaces of other seeds. Times are medians per surface, with one process and BLAS
on one thread.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from report.peers_flatten import arap
from tqdm import tqdm

import gso
from gso import metrics
from gso.dataset import bezier
from gso.tno.layout import strains_of

ROOT = Path(__file__).resolve().parent.parent
PRESETS = ("fast", "balanced", "accurate")
PURE = "pure SciPy"


def reference() -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the 24 surfaces and their unit noise."""
    data = np.load(ROOT / "bench" / "data" / "bench24.npz")
    return [s.astype(float) for s in data["surfaces"]], [
        n.astype(float) for n in data["unit_noise"]
    ]


def progress(items: Any, text: str) -> Any:
    """Wrap an iterable in a progress bar, if stderr is a terminal."""
    return tqdm(items, desc=text, leave=False, disable=not sys.stderr.isatty())


def timed(function: Callable[[], Any]) -> tuple[Any, float]:
    """Call a function and return its result and the seconds."""
    start = time.perf_counter()
    value = function()
    return value, time.perf_counter() - start


class without_extras:
    """A context in which the optional linear backends are hidden."""

    def __enter__(self) -> None:
        from gso import linalg

        self.hidden = [linalg.backends()[k] for k in ("cholmod", "pardiso")]
        self.known = [m.available for m in self.hidden]
        for module in self.hidden:
            module.available = lambda: False

    def __exit__(self, *_: object) -> None:
        for module, available in zip(self.hidden, self.known, strict=True):
            module.available = available


def table(title: str, columns: list[str], rows: list[list[Any]]) -> None:
    """Print a table."""
    text = [[c if isinstance(c, str) else f"{c:.4g}" for c in row] for row in [columns, *rows]]
    widths = [max(len(row[k]) for row in text) for k in range(len(columns))]
    print(f"\n{title}")
    for number, row in enumerate(text):
        print(
            "  "
            + "  ".join(
                c.rjust(w) if k else c.ljust(w)
                for k, (c, w) in enumerate(zip(row, widths, strict=True))
            )
        )
        if number == 0:
            print("  " + "  ".join("-" * w for w in widths))
    sys.stdout.flush()


def quality(before: np.ndarray, after: np.ndarray) -> tuple[float, ...]:
    """Return loss_gc, K_A-r, d_H and the fairness ratio."""
    return (
        metrics.loss_gc(after, scale=metrics.unit(before)),
        metrics.K_A_r(before, after),
        metrics.d_H(before, after),
        metrics.fairness_ratio(before, after),
    )


def honest(before: np.ndarray, after: np.ndarray) -> tuple[float, ...]:
    """Return the metrics of both triangulations (splits) of the quads.

    loss_gc of either split, of the worse one and of every second vertex, K_A-r of the worse
    split, d_H, fairness ratio.
    """
    unit = metrics.unit(before)
    return (
        metrics.loss_gc(after, scale=unit),
        metrics.loss_gc(after, scale=unit, split=1),
        metrics.loss_gc_worst(after, scale=unit),
        metrics.loss_gc_half(after, scale=unit),
        metrics.K_A_r_worst(before, after),
        metrics.d_H(before, after),
        metrics.fairness_ratio(before, after),
    )


def developable() -> dict[str, Any]:
    """Measure the three presets, and `balanced` without the optional backends."""
    surfaces, _ = reference()
    rows, out = [], {}
    for preset in (*PRESETS, PURE):
        options = "balanced" if preset == PURE else preset
        figures, strains, seconds, backend = [], [], [], ""
        with without_extras() if preset == PURE else tempfile.TemporaryDirectory():
            gso.tno.optimize(surfaces[0], options=options)
            for points in progress(surfaces, preset):
                result = gso.tno.optimize(points, options=options)
                judged = result.seconds["pattern"] + result.seconds["verdict"]
                figures.append(honest(points, result.grid))
                strains.append(100.0 * result.metrics["strain_max"])
                seconds.append(result.seconds["total"] - judged)
                backend = result.backend
        name = f"balanced, {PURE}" if preset == PURE else preset
        mean = np.mean(figures, axis=0)
        strain = [np.median(strains), np.percentile(strains, 90)]
        rows.append([name, *mean, *strain, np.median(seconds), np.max(seconds), backend])
        out[name] = [*map(float, mean), float(np.median(seconds))]
    table(
        "Developable, 24 surfaces, mean input loss_gc "
        f"{np.mean([metrics.loss_gc(s) for s in surfaces]):.3f}",
        [
            "preset",
            "loss_gc",
            "other split",
            "worse",
            "every 2nd",
            "K_A-r worse",
            "d_H %",
            "fairness",
            "strain %",
            "90th",
            "median s",
            "max s",
            "backend",
        ],
        rows,
    )
    print(
        "  strain: the largest of each result's pattern, median and 90th percentile; of the input "
        f"{100.0 * np.median([_strained(s) for s in surfaces]):.3g} %"
    )
    return out


def _strained(points: np.ndarray) -> float:
    """Return the largest strain of a surface's pattern."""
    return strains_of(gso.Mesh.from_grid(points))["strain_max"]


def flat_figures(surface: Any, flat: np.ndarray) -> tuple[float, ...]:
    """Return loss_iso-cell, strain mean and p99, edge-length error and flipped cells."""
    strains = metrics.principal_strains(surface, flat)
    faces = None if isinstance(surface, np.ndarray) else surface.faces
    return (
        metrics.loss_iso_cell(surface, flat),
        strains.mean,
        strains.p99,
        metrics.edge_length_error(surface, flat),
        metrics.flipped_cells(flat, faces),
    )


def flatten() -> dict[str, Any]:
    """Measure two formulations, and libigl's ARAP in the same run."""
    surfaces, _ = reference()
    runs: dict[str, Callable[[np.ndarray], np.ndarray]] = {
        "strain": lambda p: gso.tno.optimize(p, task="flatten").flat_grid,
        "lengths": lambda p: gso.tno.optimize(p, task="flatten", formulation="lengths").flat_grid,
        "libigl ARAP, 100": lambda p: arap(gso.Mesh.from_grid(p)).reshape(*p.shape[:2], 2),
    }
    rows, out = [], {}
    for name, run in [*runs.items(), (f"strain, {PURE}", runs["strain"])]:
        figures, seconds = [], []
        with without_extras() if PURE in name else tempfile.TemporaryDirectory():
            run(surfaces[0])
            for points in progress(surfaces, name):
                flat, spent = timed(lambda p=points, r=run: r(p))
                figures.append(flat_figures(points, flat))
                seconds.append(spent)
        mean, median = np.mean(figures, axis=0), np.median(figures, axis=0)
        total = np.sum(figures, axis=0)[4]
        rows.append([name, mean[0], median[0], *mean[1:4], total, np.median(seconds)])
        out[name] = [
            *map(float, (mean[0], median[0], *mean[1:4], total)),
            float(np.median(seconds)),
        ]
    table(
        "Flatten, 24 surfaces (floors: strain 0.0093 0.0353 0.0053 no flips; "
        "lengths 2.6e-5 1.7e-5 no flips; 0.15 s)",
        ["formulation", "iso-cell", "median", "strain", "p99", "edges", "flipped", "median s"],
        rows,
    )
    return out


def denoise() -> dict[str, Any]:
    """Measure denoising at four noise levels that the method is not given."""
    surfaces, noise = reference()
    rows, out = [], {}
    floors = {0.001: 0.30, 0.005: 0.82, 0.010: 1.30, 0.015: 1.70}
    for sigma, floor in floors.items():
        angles, seconds, estimates = [], [], []
        for points, unit in zip(surfaces, noise, strict=True):
            noisy = points + sigma * unit
            result, spent = timed(lambda q=noisy: gso.tno.optimize(q, task="denoise"))
            angles.append(metrics.normal_angle(points, result.grid))
            estimates.append(result.details["sigma"])
            seconds.append(spent)
        rows.append(
            [f"{sigma:.3f}", np.mean(angles), floor, np.mean(estimates), 1e3 * np.median(seconds)]
        )
        out[f"{sigma:.3f}"] = [float(np.mean(angles)), float(np.median(seconds))]
    table(
        "Denoise, 24 surfaces, nothing told about sigma",
        ["sigma", "theta deg", "floor", "sigma found", "median ms"],
        rows,
    )
    return out


def last_problem(points: np.ndarray, task: str, options: str) -> tuple[Any, np.ndarray]:
    """Return the problem of a task's last stage, and unknowns to evaluate it at."""
    from gso import tasks
    from gso.constraints import Compiled
    from gso.tasks.base import Request
    from gso.tno.normalise import Canonical
    from gso.tno.solver.problem import Problem

    module = tasks.get(task)
    frame = Canonical(gso.Mesh.from_grid(points))
    settings = module.Options.coerce(options)
    analysis = tasks.analyse(module, frame.mesh, Compiled())
    plan = module.plan(analysis, Request(settings, module.FORMULATIONS[0]))
    coordinates = plan.start
    for stage in plan.stages:
        coordinates = stage.enter(coordinates)
    variables = plan.stages[-1].unknowns(coordinates)
    problem = Problem(plan.stages[-1].items, variables, plan.stages[-1].limits)
    return problem, variables.project(coordinates)


def breakdown() -> dict[str, Any]:
    """Time one iteration at 64 x 64: evaluation with assembly, and factorisation."""
    from gso import linalg

    surfaces, _ = reference()
    rows, out = [], {}
    for task, options, name in (
        ("developable", "balanced", "normal offsets"),
        ("developable", "accurate", "free vertices"),
        ("flatten", "balanced", "flat image"),
    ):
        problem, x = last_problem(surfaces[0], task, options)
        problem.linearise(x)
        spent = [timed(lambda p=problem, y=x: p.linearise(y))[1] for _ in range(15)]
        times = {}
        for backend, module in linalg.backends().items():
            if not module.available():
                continue
            solver = linalg.choose(problem.pattern, backend)
            values = problem.linearise(x)[2]
            values[problem.diagonal] += 1e-9 * values[problem.diagonal].max()
            with linalg.blas_threads(1):
                solver.factor(values)
                repeats = 3 if backend == "superlu" else 7
                times[backend] = np.median(
                    [timed(lambda s=solver, v=values: s.factor(v))[1] for _ in range(repeats)]
                )
        rows.append(
            [name, str(problem.variables.size), 1e3 * np.median(spent)]
            + [1e3 * times.get(k, np.nan) for k in sorted(linalg.backends())]
        )
        out[name] = rows[-1][2:]
    table(
        "One iteration at 64 x 64, milliseconds",
        ["unknowns", "count", "evaluate", *(f"factor {k}" for k in sorted(linalg.backends()))],
        rows,
    )
    return out


def resolution() -> dict[str, Any]:
    """Solve the same surfaces at three resolutions with the same weights."""
    shapes = bezier.generate(24, seed=77)
    rows, out = [], {}
    for preset, count in (("balanced", 24), ("accurate", 8)):
        for size in (32, 64, 128):
            figures = []
            for shape in progress(shapes[:count], f"{preset} {size}"):
                points = shape.sample(size)
                figures.append(quality(points, gso.tno.optimize(points, options=preset).grid))
            mean = np.mean(figures, axis=0)
            rows.append([f"{preset} {size}, {count} surfaces", *mean])
            out[f"{preset} {size}"] = [*map(float, mean)]
    table(
        "One set of weights, surfaces of seed 77",
        ["grid", "loss_gc", "K_A-r", "d_H %", "fairness"],
        rows,
    )
    return out


def questions() -> dict[str, Any]:
    """Measure the limits `max_deviation` and `target_curvature`."""
    surfaces, _ = reference()
    rows, out = [], {}
    for share in (0.0025, 0.005, 0.01):
        curvature, reach, both, seconds = [], [], [], []
        for points in progress(surfaces, f"within {share:.2%}"):
            mesh = gso.Mesh.from_grid(points)
            bound = share * mesh.diagonal
            result, spent = timed(lambda m=mesh, b=bound: gso.tno.optimize(m, max_deviation=b))
            curvature.append(result.metrics["loss_gc"])
            reach.append(metrics.point_to_surface(result.mesh.vertices, mesh).max() / bound)
            both.append(0.01 * result.metrics["distance_max"] / share)
            seconds.append(spent)
        kept = sum(r <= 1 + 1e-6 for r in reach)
        rows.append(
            [
                f"within {share:.2%}",
                f"kept on {kept}",
                np.mean(curvature),
                np.max(reach),
                np.max(both),
                np.median(seconds),
            ]
        )
        out[f"within {share}"] = [kept, float(np.mean(curvature))]
    table(
        "max_deviation, share of the diagonal",
        ["bound", "", "loss_gc", "largest / bound", "both ways", "median s"],
        rows,
    )
    rows = []
    presets = {p: [] for p in PRESETS}
    for preset, found in presets.items():
        for points in progress(surfaces, preset):
            m = gso.tno.optimize(points, options=preset).metrics
            found.append((m["loss_gc"], m["d_H"]))
    for target in (0.05, 0.02):
        met, closest, distance, seconds = 0, 0, [], []
        for k, points in enumerate(progress(surfaces, f"target {target}")):
            result, spent = timed(
                lambda p=points, t=target: gso.tno.optimize(p, target_curvature=t)
            )
            m = result.metrics
            met += m["loss_gc"] <= target
            best = min(
                (d for c, d in (found[k] for found in presets.values()) if c <= target),
                default=np.inf,
            )
            closest += m["d_H"] <= best * (1 + 1e-9)
            distance.append(m["d_H"])
            seconds.append(spent)
        rows.append(
            [
                f"{target}",
                f"met on {met}",
                f"closest on {closest}",
                np.mean(distance),
                np.median(seconds),
            ]
        )
        out[f"target {target}"] = [int(met), int(closest), float(np.mean(distance))]
    table(
        "target_curvature; closest: no preset that meets it has a smaller mean distance",
        ["target", "", "", "d_H %", "median s"],
        rows,
    )
    return out


def general() -> dict[str, Any]:
    """Flatten, denoise and make developable meshes that are not grids."""
    sys.path.insert(0, str(ROOT / "examples"))
    import irregular
    import teapot

    rng = np.random.default_rng(5)
    grid = gso.Mesh.from_grid(teapot.patch(4, 33))
    order = rng.permutation(len(grid.vertices))
    patch = gso.Mesh(grid.vertices[order], np.argsort(order)[grid.triangles])
    disk = gso.Mesh(*irregular.disk())
    hole = gso.Mesh(*irregular.disk_with_hole())
    rows, out = [], {}
    for name, mesh in (("teapot patch, triangles", patch), ("quads with a hole", hole)):
        for method in ("strain", "libigl ARAP"):
            if method == "strain":
                flat, spent = timed(lambda m=mesh: gso.tno.optimize(m, task="flatten").flat)
            else:
                flat, spent = timed(lambda m=mesh: arap(m))
            figures = flat_figures(mesh, flat)[1:]
            rows.append([f"{name}, {method}", *figures, spent])
            out[f"{name}, {method}"] = [*map(float, figures)]
    table("Flatten, general meshes", ["mesh", "strain", "p99", "edges", "flipped", "s"], rows)
    rows = []
    for name, mesh in (("teapot patch, triangles", patch), ("quads with a hole", hole)):
        noisy = mesh.vertices + 0.005 * metrics.unit(mesh) * rng.standard_normal(
            mesh.vertices.shape
        )
        result, spent = timed(
            lambda m=mesh, v=noisy: gso.tno.optimize(m.replaced(v), task="denoise")
        )
        ours = metrics.normal_angle(mesh, result.mesh)
        theirs, which = best_trimesh(mesh, noisy)
        rows.append(
            [name, metrics.normal_angle(mesh, mesh.replaced(noisy)), ours, theirs, which, spent]
        )
        out[f"denoise {name}"] = [ours, theirs]
    table(
        "Denoise, general meshes, theta in degrees at noise 0.005",
        ["mesh", "noisy", "gso", "trimesh's best", "which", "s"],
        rows,
    )
    rows = []
    for name, mesh in (("quads, irregular", disk), ("quads with a hole", hole)):
        for bound in (None, 0.01 * mesh.diagonal):
            result, spent = timed(lambda m=mesh, b=bound: gso.tno.optimize(m, max_deviation=b))
            m = result.metrics
            label = name if bound is None else f"{name}, within 1 %"
            rows.append(
                [
                    label,
                    m["loss_gc_before"],
                    m["loss_gc"],
                    m["K_A_r"],
                    m["d_H"],
                    m["deviation_max"],
                    m["distance_max"],
                    spent,
                ]
            )
            out[f"developable {label}"] = [m["K_A_r"], m["deviation_max"], m["distance_max"]]
    table(
        "Developable, irregular quad meshes",
        ["mesh", "before", "loss_gc", "K_A-r", "d_H %", "farthest %", "both ways %", "s"],
        rows,
    )
    return out


def best_trimesh(mesh: gso.Mesh, noisy: np.ndarray) -> tuple[float, str]:
    """Return the smallest theta of trimesh's smoothers over their settings (an oracle)."""
    import trimesh
    from trimesh import smoothing

    settings: list[tuple[str, dict[str, Any]]] = []
    for n in (1, 2, 3, 5, 8, 12, 20, 40):
        settings += [
            ("filter_laplacian", {"lamb": lamb, "iterations": n}) for lamb in (0.2, 0.5, 0.9)
        ]
        settings += [
            ("filter_humphrey", {"alpha": a, "beta": b, "iterations": n})
            for a in (0.0, 0.1)
            for b in (0.2, 0.5, 0.8)
        ]
        settings += [
            ("filter_taubin", {"lamb": lamb, "nu": nu, "iterations": n})
            for lamb in (0.3, 0.5)
            for nu in (0.3, 0.5)
        ]
        settings += [("filter_mut_dif_laplacian", {"lamb": 0.5, "iterations": n})]
    best = (np.inf, "")
    for name, keywords in settings:
        copy = trimesh.Trimesh(noisy.copy(), np.asarray(mesh.triangles), process=False)
        try:
            getattr(smoothing, name)(copy, **keywords)
        except (AttributeError, ImportError, ValueError, IndexError):
            continue
        if np.isfinite(copy.vertices).all():
            angle = metrics.normal_angle(mesh, mesh.replaced(np.asarray(copy.vertices)))
            best = min(best, (angle, name))
    return best


def sizes() -> dict[str, Any]:
    """Measure larger grids: time per vertex relative to 64 x 64, and peak memory."""
    rows, out = [], {}
    for task, preset in (
        ("developable", "balanced"),
        ("developable", "accurate"),
        ("flatten", "balanced"),
    ):
        base = None
        for size in (64, 256, 512):
            if preset == "accurate" and size == 512:
                continue
            code = (
                "import time, resource, gso\n"
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
                "print(sorted(s)[len(s) // 2], peak)\n"
            )
            done = subprocess.run(
                [sys.executable, "-c", code], capture_output=True, text=True, check=True
            )
            seconds, peak = map(float, done.stdout.split())
            each = 1e6 * seconds / size**2
            base = base or each
            rows.append([f"{task} {preset} {size}", seconds, each, each / base, peak / 1e6])
            out[f"{task} {preset} {size}"] = [seconds, each / base, peak / 1e6]
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


SECTIONS: dict[str, Callable[[], dict[str, Any]]] = {
    f.__name__: f
    for f in (
        developable,
        flatten,
        denoise,
        breakdown,
        resolution,
        questions,
        general,
        sizes,
        components,
        startup,
    )
}


def machine() -> dict[str, Any]:
    """Describe the machine and the versions of packages."""
    packages = ("numpy", "scipy", "casadi", "libigl", "trimesh")
    return {
        "python": platform.python_version(),
        "machine": platform.machine(),
        "cores": os.cpu_count(),
        "packages": {p: version(p) for p in packages},
        "peak_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
    }


def run(sections: dict[str, Callable[[], dict[str, Any]]], description: str | None) -> None:
    """Run the sections named on the command line, or all of them."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("sections", nargs="*", choices=[*sections, []], help="default: all")
    parser.add_argument("--json", type=Path, help="also write the figures here")
    arguments = parser.parse_args()
    figures = {name: sections[name]() for name in arguments.sections or sections}
    if arguments.json:
        arguments.json.write_text(
            json.dumps({**figures, "machine": machine()}, indent=1, default=float)
        )


if __name__ == "__main__":
    run(SECTIONS, __doc__)

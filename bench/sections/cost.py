"""Cost of the optimiser: one iteration, larger grids, several components, and start-up."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from functools import partial
from typing import Any

import numpy as np
from harness import PRESETS, ROOT, progress, reference, run_apart, solver, tabulate, timed
from report.energy import last_problem
from report.measure import peak_mb

import gso
from gso import linalg, metrics
from gso.dataset import bezier


def breakdown() -> dict[str, Any]:
    """Time one iteration at 64 x 64: evaluation with assembly, and factorisation."""
    surface = reference()[0][0]
    every = sorted(k for k, module in linalg.backends().items() if module.available())

    def milliseconds(function: Any, *given: Any, repeats: int = 15) -> float:
        return 1e3 * float(np.median([timed(function, *given)[1] for _ in range(repeats)]))

    rows = {}
    for name, task, options in (
        ("normal offsets", "developable", "balanced"),
        ("free vertices", "developable", "accurate"),
        ("flat image", "flatten", "balanced"),
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
        rows[name] = row
    return tabulate("One iteration at 64 x 64, milliseconds", ["unknowns"], rows)


def sizes() -> dict[str, Any]:
    """Measure larger grids: time per vertex relative to 64 x 64, and peak memory."""
    rows: dict[str, dict[str, float]] = {}
    for task, preset, sides in (
        ("developable", "balanced", (64, 256, 512)),
        ("developable", "accurate", (64, 256)),
        ("flatten", "balanced", (64, 256, 512)),
    ):
        base = None
        for size in progress(sides, f"{task} {preset}"):
            seconds, peak = run_apart(_grid, task, preset, size)
            each = 1e6 * seconds / size**2
            base = base or each
            row = {"s": seconds, "us / vertex": each, "against 64": each / base, "peak GB": peak}
            rows[f"{task} {preset} {size}"] = row
    return tabulate("Size", ["solve"], rows)


def _grid(task: str, preset: str, size: int) -> tuple[float, float]:
    """Return the median seconds of solving a grid, and the peak memory of the process, GB."""
    shape, solve = bezier.generate(1, seed=77)[0], solver(task=task, options=preset)
    solve(shape.sample(64))
    points = shape.sample(size)
    spent = [timed(solve, points)[1] for _ in range(5 if size == 64 else 1)]
    return float(np.median(spent)), 1e-3 * peak_mb()


def components() -> dict[str, Any]:
    """Solve a panel of 4 m alone and beside copies; its result must not depend on them."""
    grid = bezier.generate(1, seed=5)[0].sample(33)
    panel = gso.Mesh.from_grid(4000.0 * grid / metrics.unit(grid))
    size, count = panel.frame.scale, len(panel.vertices)
    noise = 1e-12 * size * np.random.default_rng(0).standard_normal((count, 3))
    asked = [
        *(("developable", "curvature", o) for o in PRESETS),
        *(("developable", "isometry", o) for o in ("balanced", "jiang2020")),
        *(("flatten", f, "balanced") for f in ("strain", "lengths", "isometry")),
        *(("denoise", f, "balanced") for f in ("smooth", "crease")),
        *((task, "isometry", "balanced") for task in ("bend", "conformal")),
    ]

    def solved(shifts: list[list[float]], added: Any, wanted: tuple[str, str, str]) -> list[Any]:
        """Return the result of each copy, moved back to the panel's place."""
        points, copies = panel.vertices + added, range(len(shifts))
        faces = np.concatenate([panel.faces + k * count for k in copies])
        mesh = gso.Mesh(np.concatenate([points + s for s in shifts]), faces)
        keywords: dict[str, Any] = dict(zip(("task", "formulation", "options"), wanted))
        if wanted[0] == "bend":
            rows = np.arange(count).reshape(33, 33)
            held, lifted = (np.ravel(rows[r] + count * np.c_[copies]) for r in (0, -1))
            places = mesh.vertices[lifted] + np.array([-0.05, 0.0, 0.1]) * size
            keywords["constraints"] = [gso.Fixed(held), gso.Handle(lifted, places)]
        result = gso.tno.optimize(mesh, **keywords)
        parts = zip(result.components or [result], shifts, strict=True)
        if wanted[0] in ("flatten", "conformal"):
            return [np.asarray(part.flat) for part, _ in parts]
        return [part.mesh.vertices - s for part, s in parts]

    here, beside = [0.0, 0.0, 0.0], [[3.0 * size * k, 0.0, 0.0] for k in range(8)]
    far = [100.0 * size, 0.0, 0.0]
    cases = {
        "100 m away": ([here, [1e5, 0.0, 0.0]], 0.0),
        "duplicated": ([here, here], 0.0),
        "eight": (beside, 0.0),
        "100 sizes": ([here, far], 0.0),
        "moved alone": ([far], 0.0),
        "1e-12 noise": ([here], noise),
    }
    rows: dict[str, dict[str, Any]] = {}
    for wanted in progress(asked, "components"):
        alone = solved([here], 0.0, wanted)[0]
        found = {name: solved(*case, wanted) for name, case in cases.items()}
        row: dict[str, Any] = {}
        for name, points in {"alone": alone, "with copy": found["100 m away"][0]}.items():
            flat = points.shape[1] == 2
            row[name] = "-" if flat else np.linalg.norm(points - panel.vertices, axis=1).max()
        for name, copies in found.items():
            row[name] = max(float(np.abs(points - alone).max()) for points in copies) / size
        rows[" ".join(wanted)] = row
    title = "A panel of 4 m and copies of it: largest displacement in mm, alone and with a copy "
    title += "100 m away;\n  then the largest difference to the panel alone, in sizes"
    return tabulate(title, ["task"], rows)


def startup() -> dict[str, Any]:
    """Time a new process that solves the panel, and `import gso`."""

    def median(*words: str) -> float:
        run = partial(subprocess.run, check=True, capture_output=True)
        return float(np.median([timed(run, [sys.executable, *words])[1] for _ in range(5)]))

    with tempfile.TemporaryDirectory() as folder:
        panel = str(ROOT / "examples" / "panel.obj")
        cold = median("-m", "gso", "optimize", panel, "-o", f"{folder}/out.obj")
    more = median("-c", "import numpy, gso") - median("-c", "import numpy")
    rows = {
        "gso optimize panel.obj -o out.obj, cold": {"median s": cold, "at most": 2.0},
        "import gso over import numpy": {"median s": more, "at most": 0.1},
    }
    return tabulate("Start-up", ["what"], rows)


SECTIONS = (breakdown, sizes, components, startup)

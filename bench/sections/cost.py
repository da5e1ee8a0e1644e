"""Cost of the optimiser: one iteration, larger grids, several components, and start-up."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from typing import Any

import numpy as np
from harness import ROOT, progress, reference, table, timed
from report.energy import last_problem

import gso
from gso import linalg, metrics
from gso.dataset import bezier
from sections.tno import PRESETS


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
        cold = median([sys.executable, "-m", "gso", "optimize", panel, "-o", f"{folder}/out.obj"])
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


SECTIONS = (breakdown, sizes, components, startup)

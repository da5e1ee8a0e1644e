"""Speed: presets against an older checkout, the share of the factorisations, large grids.

Every figure comes from a process of its own with one thread. Times are what the user waits for,
with the solve, the flat pattern and the verdict as its parts; of several runs of one surface the
shortest counts.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from harness import ROOT, progress, table

#: Phases of a solve, and parts of the whole, in ``result.seconds``.
_PHASES = ("setup", "evaluate", "factor", "search")
_PARTS = ("pattern", "verdict", "total")

_PRESETS = """
import json, sys, warnings, numpy as np, gso
warnings.simplefilter("ignore")
with np.load(sys.argv[1]) as data:
    some = data["surfaces"][::int(sys.argv[2])].astype(float)
out = {}
for preset in sys.argv[3].split(","):
    rows = []
    for grid in some:
        runs = []
        for _ in range(3):
            seconds = gso.tno.optimize(grid, options=preset).seconds
            runs.append([seconds.get(k, 0.0) for k in NAMES])
        rows.append(min(runs, key=lambda run: run[-1]))
    out[preset] = np.median(rows, axis=0).tolist()
print(json.dumps(out))
""".replace("NAMES", repr((*_PHASES, *_PARTS)))

_GRID = """
import json, sys, warnings, gso
from gso.dataset import bezier
warnings.simplefilter("ignore")
task, size, runs = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
shape = bezier.generate(1, seed=77)[0]
gso.tno.optimize(shape.sample(64), task=task)
grid = shape.sample(size)
r = min((gso.tno.optimize(grid, task=task) for _ in range(runs)), key=lambda r: r.seconds["total"])
status = open("/proc/self/status").read() if sys.platform == "linux" else ""
peak = [int(line.split()[1]) * 1.024e-6 for line in status.splitlines() if "VmHWM" in line]
parts = [r.seconds.get(k, 0.0) for k in ("total", "pattern", "verdict", "factor")]
print(json.dumps([*parts, sum(r.energy.values()), *peak]))
"""

_FULL = """
import json, sys, warnings, gso
from dataclasses import replace
from gso.dataset import bezier
warnings.simplefilter("ignore")
size, count = int(sys.argv[1]), int(sys.argv[2])
full = replace(gso.DevelopableOptions(), iterations=60, refining_iterations=60,
               coarse_iterations=30, between_iterations=30, tolerance=1e-6)
out = []
for shape in bezier.generate(count, seed=77):
    runs = [gso.tno.optimize(shape.sample(size), options=o, verdict=False) for o in (None, full)]
    out.append([sum(r.energy.values()) for r in runs])
print(json.dumps(out))
"""


def presets(base: str = "", every: int = 3) -> dict[str, Any]:
    """Time presets on bench24, and those of an older checkout in the folder `base`."""
    bench24 = ROOT / "bench" / "data" / "bench24.npz"
    given = [str(bench24), str(every), "balanced,fast"]
    wanted = [("compiled", "", ROOT), ("NumPy", "numpy", ROOT)]
    if base:
        wanted.append(("base", "", Path(base)))
    found = {
        name: _run(_PRESETS, given, GSO_KERNELS=kernels, PYTHONPATH=str(folder))
        for name, kernels, folder in progress(wanted, "presets")
    }
    out, rows = {}, []
    for name, by_preset in found.items():
        for preset, figures in by_preset.items():
            row = dict(zip([*_PHASES, *_PARTS], (1e3 * x for x in figures), strict=True))
            solve = row["total"] - row["pattern"] - row["verdict"]
            row["by factor"] = solve / row["factor"]
            row["by solve"] = (row["pattern"] + row["verdict"]) / solve
            row["by base"] = figures[-1] / found["base"][preset][-1] if base else ""
            rows.append([name, preset, *row.values()])
            out[f"{name} {preset}"] = row
    title = "Milliseconds at 64 x 64, medians over bench24"
    table(title, ["kernels", "preset", *out["compiled fast"]], rows)
    return out


def grids(largest: int = 1024) -> dict[str, Any]:
    """Solve large grids: seconds, peak memory, and the exponent of time in the vertices."""
    out: dict[str, dict[str, Any]] = {}
    sizes = [n for n in (64, 128, 256, 512, 1024, 2048) if n <= largest]
    for task in ("developable", "flatten"):
        before: dict[str, Any] = {}
        for size in progress(sizes, task):
            runs = max(1, min(5, 256 // size))
            total, pattern, verdict, factor, energy, *peak = _run(
                _GRID, [task, str(size), str(runs)]
            )
            solve = total - pattern - verdict
            row = {"s": total, "solve": solve, "pattern": pattern, "verdict": verdict}
            row |= {"by factor": solve / factor, "energy": energy}
            row["peak GB"] = peak[0] if peak else ""
            row["exponent"] = np.log2(total / before["s"]) / 2.0 if before else ""
            out[f"{task} {size}"] = before = row
    rows = [[name, *row.values()] for name, row in out.items()]
    table("Grids", ["solve", *before], rows)
    return out


def full(size: int = 256, count: int = 8) -> dict[str, Any]:
    """Compare energies with those of a solve with many iterations on every grid."""
    pairs = np.array(_run(_FULL, [str(size), str(count)]))
    above = 100.0 * (pairs[:, 0] / pairs[:, 1] - 1.0)
    figures = {"median %": float(np.median(above)), "largest %": float(above.max())}
    title = f"Energy of balanced above that of 60 iterations on each grid, {size} x {size}"
    table(title, ["surfaces", *figures], [[str(count), *figures.values()]])
    return figures


def _run(code: str, given: list[str], **environment: str) -> Any:
    """Run code in a new process with one thread, and return what it prints as JSON."""
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-c", code, *given],
            env={**os.environ, **threads, **environment},
            cwd=folder,
            capture_output=True,
            text=True,
        )
    if done.returncode:
        raise RuntimeError(done.stderr[-2000:])
    return json.loads(done.stdout.splitlines()[-1])


SECTIONS = (presets, grids, full)

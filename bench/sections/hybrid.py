"""Time and energy of the optimiser with a warm start from a net, against a cold start.

The surfaces are those of the test split, which no net was trained on. They are drawn again from
the seed, or read from a set (``data=DIR``).
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import designs
import numpy as np
from harness import BENCH, axes_of, energy, progress, quietly, tabulate, timed
from report.store import Store
from report.surfaces import Surfaces, opened, screened

import gso
from gso import hybrid
from gso.executors import open_executor
from gso.hierarchy import resample
from gso.hybrid import time_model
from gso.hybrid.plain_solve import LARGE
from gso.hybrid.solving import LEFT, NEARLY
from gso.io.json_file import write_json
from gso.net import tasks
from gso.pipeline import add_verdict
from gso.tasks import Limits
from gso.tno import Start, optimize

#: Task and keywords.
Case = tuple[str, dict[str, Any]]
#: Cases that are compared.
CASES: dict[str, Case] = {
    "balanced": ("developable", {}),
    "accurate": ("developable", {"options": "accurate"}),
    "jiang2020": ("developable", {"options": "jiang2020"}),
    "isometry": ("developable", {"formulation": "isometry"}),
    "max_strain=0.5%": ("developable", {"max_strain": "0.5%"}),
}
#: Solves for which :func:`gso.hybrid.solve` makes no warm start: task, number of pieces into which
#: the design is cut along lines of the grid, and keywords.
ELSEWHERE: dict[str, tuple[str, int, dict[str, Any]]] = {
    "max_deviation=0.5%": ("developable", 1, {"max_deviation": "0.5%"}),
    "max_deviation=2%": ("developable", 1, {"max_deviation": "2%"}),
    "flatten, minimax": ("flatten", 1, {"formulation": "minimax"}),
    "2 pieces": ("developable", 2, {}),
    "4 pieces": ("developable", 4, {}),
    "4 strips": ("developable", 1, {"options": gso.RuledOptions(strips=4, lines=False)}),
}
#: Numbers of iterations at which the curve of the section "anytime" has points.
POINTS = (0, 1, 2, 3, 4, 6, 8, 12, 18, 24)
#: Vertices along the sides of grids of the sections "sizes" and "model", by preset, and the share
#: of the surfaces that are solved at this size.
SIZES = {
    "balanced": {64: 1.0, 128: 0.5, 256: 0.25, 512: 0.125},
    "accurate": {64: 0.5, 128: 0.25, 256: 0.1},
}
#: A program that prints the CPU seconds to load a net and the library that applies it, after a
#: cold solve: the first prediction without the time of another one.
LOAD = """
import sys, time
import numpy as np, gso
grid = np.dstack([*np.mgrid[:9.0, :9.0], np.eye(9)])
gso.tno.optimize(grid)
def spent():
    clock = time.process_time()
    gso.net.predict(grid, model=sys.argv[1])
    return time.process_time() - clock
print(spent() - spent())
"""
#: Share of the cold solve's time above which a hybrid solve counts as slower.
SLOWER = 1.05
#: Share by which the section "guard" stretches designs along x, to measure how much the cold solves
#: of two practically equal designs differ.
STRETCH = 1e-6


def split(name: str, data: Path | None) -> Surfaces:
    """Return a split of a set, or of the set of the published size."""
    out = BENCH / "out"
    if data is None:
        return screened(out / "surfaces", name, Store(out))
    return opened(out / "surfaces", data, name)


def first(count: int, data: Path | None) -> list[np.ndarray]:
    """Return the first surfaces of the test split."""
    surfaces = split("test", data)
    return [surfaces[k] for k in range(min(count, len(surfaces)))]


def compared(
    designs: Iterable[Any], case: Case, workers: int | None = 0, stretched: bool = False
) -> dict[str, np.ndarray]:
    """Solve every design cold and hybrid: CPU seconds, energies, strains, and use of the net.

    The solves of a design follow each other in one process. "solver" is without pattern and
    verdict, "total" with them. Times are meaningful with ``workers=0`` only. With `stretched`, the
    energies of cold solves of the stretched designs are included; they show how much such minima
    differ by chance.
    """
    rows = []
    solved = partial(_solved, case, stretched)
    with open_executor(workers, main=True) as executor:
        for done in executor.as_completed(solved, designs):
            if done.error is not None:
                raise SystemExit(f"design {done.index}: {done.error}")
            rows.append(done.result)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _cpu(function: Any, *given: Any, **keywords: Any) -> tuple[Any, float]:
    """Call a function without warnings; return its result and the CPU seconds."""
    clock = time.process_time()
    value = quietly(function, *given, **keywords)
    return value, time.process_time() - clock


def _solved(case: Case, stretched: bool, design: Any) -> dict[str, float]:
    task, keywords = case
    given = {"task": task, **keywords}
    # Energies are those without a verdict: where a result is not usable, another request is solved.
    cold, cold_solver = _cpu(optimize, design, **given, verdict=False)
    warm, warm_solver = _cpu(hybrid.solve, design, **given, verdict=False)
    judged_cold, cold_total = _cpu(optimize, design, **given)
    judged_warm, warm_total = _cpu(hybrid.solve, design, **given)
    strains = [max(r.metrics["strain_max"], 1e-9) for r in (judged_warm, judged_cold)]
    least = max(energy(cold), 1e-300)
    found = {
        "cold solver": cold_solver,
        "cold total": cold_total,
        "hybrid solver": warm_solver,
        "hybrid total": warm_total,
        "started": warm.warm_start == "net",
        "energy": energy(warm) / least,
        "strain": strains[0] / strains[1],
    }
    if "max_strain" not in keywords:
        begin = Start(None, remaining=LEFT[0])
        early, found["early solver"] = _cpu(optimize, design, **given, verdict=False, x0=begin)
        found["early energy"] = energy(early) / least
    if stretched:
        mesh = gso.as_mesh(design)
        near = mesh.replaced(mesh.vertices * [1.0 + STRETCH, 1.0, 1.0])
        found["stretched"] = energy(quietly(optimize, near, **given, verdict=False)) / least
    return found


def ratios(energies: np.ndarray) -> dict[str, float]:
    """Summarise energies relative to the cold solve's."""
    shares = {f"% <= {most}": 100.0 * float((energies <= most).mean()) for most in (1.005, 1.05)}
    high = float(np.quantile(energies, 0.9))
    return {"energy": float(np.median(energies)), "9 in 10": high, **shares} | {
        "worst": float(energies.max())
    }


def costs(found: dict[str, np.ndarray]) -> dict[str, Any]:
    """Summarise times and energies, cold and hybrid, and of a cold solve that ends as early."""
    out = {
        "n": len(found["energy"]),
        "cold ms": 1e3 * float(np.median(found["cold solver"])),
        "total ms": 1e3 * float(np.median(found["cold total"])),
    }
    for part in ("solver", "total"):
        share = found[f"hybrid {part}"] / found[f"cold {part}"]
        out |= {f"{part} ratio": float(np.median(share)), f"{part} worst": float(share.max())}
    slower = found["hybrid solver"] > SLOWER * found["cold solver"]
    out |= {"% slower": 100.0 * float(slower.mean())}
    out |= {"started %": 100.0 * float(found["started"].mean()), **ratios(found["energy"])}
    out["strain 9 in 10"] = float(np.quantile(found["strain"], 0.9))
    early: dict[str, Any] = {"early ratio": "", "early energy": ""}
    if "early solver" in found:
        share = found["early solver"] / found["cold solver"]
        early["early ratio"] = float(np.median(share))
        early["early energy"] = float(np.median(found["early energy"]))
    return out | early


def speed(n: int = 32, data: Path | None = None, case: str = "") -> dict[str, Any]:
    """Print time and energy of the same surfaces, cold and from the net's result.

    `case` is one of :data:`CASES`; all by default.
    """
    chosen = first(n, data)
    rows: dict[Any, dict[str, Any]] = {}
    for name, asked in {case: CASES[case]}.items() if case else CASES.items():
        compared(chosen[:1], asked)  # imports and code generation of the first use
        some = chosen if name in ("balanced", "accurate") else chosen[: max(n // 4, 1)]
        rows[name] = costs(compared(progress(some, name), asked))
    title = "Speed: CPU time; medians; energies and strains over the cold ones"
    return tabulate(title, ["case"], rows)


def sizes(n: int = 32, data: Path | None = None) -> dict[str, Any]:
    """Print time and energy on other sizes, PyTorch loaded before."""
    rows = {key: costs(found) for key, found in _by_size(n, data, "test").items()}
    title = "Sizes: CPU time; medians; energies and strains over the cold ones"
    return tabulate(title, ["grid", "preset"], rows)


def _by_size(
    n: int, data: Path | None, name: str, large: bool = True
) -> dict[tuple[str, str], dict[str, np.ndarray]]:
    """Compare surfaces of a split on grids of all sizes; fewer of the larger ones.

    `large` says whether grids are among them that are too large for a net.
    """
    surfaces, found = split(name, data), {}
    for preset, sides in SIZES.items():
        for side, share in sides.items():
            if not large and preset == "balanced" and side >= LARGE:
                continue
            case: Case = ("developable", {"options": preset})
            count = min(max(round(n * share), 2), len(surfaces))
            grids = [resample(np.asarray(surfaces[k], float), side, side) for k in range(count)]
            quietly(hybrid.solve, grids[0], options=preset)
            shown = progress(grids, f"{side} {preset}")
            found[f"{side} x {side}", preset] = compared(shown, case)
    return found


def model(n: int = 32, data: Path | None = None) -> dict[str, Any]:
    """Measure on the validation split what decides where nets are used, and write it.

    The file is that of :mod:`gso.hybrid.time_model`.
    """
    presets: dict[str, list[dict[str, float]]] = {preset: [] for preset in SIZES}
    for (grid, preset), found in _by_size(n, data, "validation", large=False).items():
        row = {
            "cold": np.median(found["cold total"]),
            "net": np.median(found["hybrid total"]),
            "energy": np.quantile(found["energy"], 0.9),
            "strain": np.quantile(found["strain"], 0.9),
        }
        size = {"vertices": int(grid.split(" ")[0]) ** 2}
        presets[preset].append(size | {k: float(f"{v:.4g}") for k, v in row.items()})
    _write({"presets": presets})
    rows = {(name, str(row["vertices"])): row for name in presets for row in presets[name]}
    title = "Model: total CPU seconds (medians), energy and strain (nine in ten)"
    return tabulate(title, ["preset", "vertices"], rows) | load()


def load(n: int = 5) -> dict[str, Any]:
    """Measure the time to load PyTorch and ONNX Runtime with the default net, and write it.

    The file is that of :mod:`gso.hybrid.time_model`. Each of n runs is a process of its own.
    """
    rows = {}
    with TemporaryDirectory() as folder:
        name = tasks.get("developable").start
        (file,) = gso.net.export(name, Path(folder, f"{name}.onnx"))
        for library, net in {"torch": name, "onnxruntime": str(file)}.items():
            program = [sys.executable, "-c", LOAD, net]
            spent = [
                float(subprocess.check_output(program, text=True))
                for _ in progress(range(n), library)
            ]
            rows[library] = {"s": round(float(np.median(spent)), 2), "least": min(spent)}
    seconds = {library: row["s"] for library, row in rows.items()}
    _write({"load": seconds})
    title = f"Load: CPU seconds of the first prediction without those of the next; {n} processes"
    return tabulate(title, ["library"], rows)


def _write(part: dict[str, Any]) -> None:
    """Replace a part of the file of :mod:`gso.hybrid.time_model`."""
    write_json(time_model.FILE, {**json.loads(time_model.FILE.read_text()), **part})


def guard(n: int = 0, data: Path | None = None) -> dict[str, Any]:
    """Print energies relative to the cold solve's, "balanced", on the splits test and hard."""
    rows = {}
    for name in ("test", "hard"):
        some = split(name, data)
        total = min(n or len(some), len(some))
        designs = (some[k] for k in progress(range(total), name))
        found = compared(designs, CASES["balanced"], workers=None, stretched=True)
        rows |= _against_chance(f"{name}, {total} surfaces", found)
    title = "Guard: energy of the hybrid solve over that of the cold one, balanced"
    return tabulate(title, ["surfaces", "solve"], rows)


def _against_chance(name: str, found: dict[str, np.ndarray]) -> dict[Any, dict[str, float]]:
    """Return rows of the hybrid solves, and of the cold ones of stretched designs."""
    started = {"started %": 100.0 * float(found["started"].mean())}
    stretched = f"cold, its input stretched by {STRETCH:g}"
    return {
        (name, "hybrid"): started | ratios(found["energy"]),
        (name, stretched): {"started %": ""} | ratios(found["stretched"]),
    }


def anytime(n: int = 16, data: Path | None = None, plot: str = "anytime.png") -> dict[str, Any]:
    """Plot energy relative to the cold solve's against time, for solves that are stopped early."""
    chosen = first(n, data)
    final = [energy(timed(quietly, optimize, p)[0]) for p in progress(chosen, "anytime")]
    solves = {
        "TNO": lambda p, most: optimize(p, x0=Start(None, iterations=most)),
        "hybrid": lambda p, most: hybrid.solve(p, polish=most or False),
    }
    rows: dict[Any, dict[str, float]] = {}
    for name, solve in solves.items():
        for most in progress(POINTS, "anytime"):
            done = [timed(quietly, solve, p, most) for p in chosen]
            relative = [
                energy(result) / last for (result, _), last in zip(done, final, strict=True)
            ]
            middle = 1e3 * float(np.median([spent for _, spent in done]))
            rows[name, str(most)] = {"ms": middle, "energy": float(np.median(relative))}
    labels = {"xlabel": "milliseconds for one surface", "ylabel": "energy / that of the cold solve"}
    with axes_of(plot, **labels) as axes:
        for name in solves:
            points = [[*row.values()] for (solve, _), row in rows.items() if solve == name]
            axes.plot(*np.array(points).T, marker=".", label=name)
        axes.plot(*rows["hybrid", "0"].values(), "o", color="black", label="net alone")
    title = f"Anytime: medians over {len(chosen)} surfaces; energy over that of the cold solve; "
    title += f"the net alone is the hybrid's first point; see {plot}"
    return tabulate(title, ["solve", "iterations"], rows)


def effort(n: int = 16, data: Path | None = None) -> dict[str, Any]:
    """Print what hybrid solves with the effort of a cold solve reach, balanced."""
    surfaces, rows = split("test", data), {}
    for side, share in SIZES["balanced"].items():
        count = min(max(round(n * share), 2), len(surfaces))
        grids = [resample(np.asarray(surfaces[k], float), side, side) for k in range(count)]
        _with_effort(grids[0])  # imports and code generation of the first use
        found = [_with_effort(grid) for grid in progress(grids, f"{side}")]
        median = {key: float(np.median([one[key] for one in found])) for key in found[0]}
        rows[f"{side} x {side}"] = {"n": count} | median
    title = "Effort: hybrid with effort=1 over cold: total CPU time, and metrics; medians"
    return tabulate(title, ["grid"], rows)


def _with_effort(grid: np.ndarray) -> dict[str, float]:
    """Solve a grid cold, and with a net and the effort of a cold solve."""
    cold, spent = _cpu(optimize, grid)
    warm, seconds = _cpu(hybrid.solve, grid, effort=1.0)
    row = {"time": seconds / spent, "energy": energy(warm) / max(energy(cold), 1e-300)}
    for name in ("loss_gc_worst", "loss_gc_half", "d_H", "fairness_ratio", "strain_max"):
        row[name] = warm.metrics[name] / max(cold.metrics[name], 1e-12)
    return row


def meshes(data: Path | None = None) -> dict[str, Any]:
    """Print time and energy on 30 meshes that are no grids, ten of each kind, balanced."""
    grids = [gso.as_mesh(surface) for surface in first(10, data)]
    kinds = {
        "quads with irregular vertices": [design.mesh for design in designs.irregular()],
        "with holes": [design.mesh for design in designs.holes()],
        "triangles": [gso.Mesh(mesh.vertices, mesh.triangles) for mesh in grids],
    }
    rows = {}
    for name, some in kinds.items():
        compared(some[:1], CASES["balanced"])  # imports and code generation of the first use
        rows[name] = costs(compared(progress(some, name), CASES["balanced"]))
    title = "Meshes that are no grids: CPU time; medians; energies and strains over the cold ones"
    return tabulate(title, ["meshes"], rows)


def elsewhere(n: int = 6, data: Path | None = None, case: str = "") -> dict[str, Any]:
    """Print time and energy from a net's result where hybrid solves start cold, on validation.

    All cases, or the one that is named. "early" is a cold solve that ends as early.
    """
    surfaces = split("validation", data)
    grids = [np.asarray(surfaces[k], float) for k in range(min(n, len(surfaces)))]
    rows = {}
    for name in [case] if case else ELSEWHERE:
        _started_anyway(name, grids[0])  # imports and code generation of the first use
        found = [_started_anyway(name, grid) for grid in progress(grids, name)]
        each = {key: np.array([one[key] for one in found]) for key in found[0]}
        rows[name] = {"n": len(found), "cold s": float(np.median(each["cold s"]))}
        for key in ("time", "energy", "strain"):
            rows[name] |= {key: float(np.median(each[key])), f"{key} worst": each[key].max()}
        rows[name] |= {key: float(np.median(each[key])) for key in ("early time", "early energy")}
        rows[name]["started %"] = 100.0 * float(each["started"].mean())
    title = (
        "Elsewhere: CPU time, energy and largest strain from a net's result, over the cold solve's"
    )
    return tabulate(title, ["case"], rows)


def _started_anyway(name: str, grid: np.ndarray) -> dict[str, float]:
    """Solve a grid cold, from a net's result, and cold with an earlier end."""
    task, pieces, keywords = ELSEWHERE[name]
    design: Any = gso.Mesh.from_grid(grid)
    if pieces > 1:
        lines = [design.grid_index[len(grid) // 2], design.grid_index[:, grid.shape[1] // 2]]
        edges = [np.stack([line[:-1], line[1:]], axis=1) for line in lines[: pieces // 2]]
        design = gso.cut(design, gso.seams.Edges(np.concatenate(edges)))
    solve = partial(optimize, design, task=task, verdict=False, **keywords)

    def warm() -> gso.Result:
        name = tasks.get(task).start or tasks.get(task).default
        moved = gso.net.predict(grid, task=task, model=name, guarded=False)
        points = moved.reshape(-1, moved.shape[-1])
        return solve(x0=Start(points, "net", guarded=True, tolerance=NEARLY))

    (cold, spent), (result, seconds) = _cpu(solve), _cpu(warm)
    early, soon = _cpu(solve, x0=Start(None, remaining=LEFT[0]))
    least = max(energy(cold), 1e-300)
    for solved in (result, cold):
        if solved.pattern is None:
            quietly(add_verdict, solved, Limits())
    strains = [max(solved.metrics["strain_max"], 1e-9) for solved in (result, cold)]
    return {
        "cold s": spent,
        "time": seconds / spent,
        "energy": energy(result) / least,
        "strain": strains[0] / strains[1],
        "early time": soon / spent,
        "early energy": energy(early) / least,
        "started": result.warm_start == "net",
    }


SECTIONS = (speed, sizes, meshes, model, load, guard, anytime, effort, elsewhere)

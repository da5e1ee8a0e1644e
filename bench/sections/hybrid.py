"""Time and energy of the optimiser with a warm start from a net, against a cold start.

The surfaces are those of the test split, which no net was trained on. They are drawn again from
the seed, or read from a set (``data=DIR``).
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from designs.base import shuffled, without
from harness import BENCH, PRESETS, axes_of, energy, progress, quietly, tabulate, timed
from report.store import Store
from report.surfaces import Surfaces, opened, screened

import gso
from gso import hybrid
from gso.executors import open_executor
from gso.hierarchy import resample
from gso.mesh import Mesh
from gso.net import available
from gso.net import tasks as net_tasks
from gso.tno import Start, optimize

#: Task and keywords.
Case = tuple[str, dict[str, Any]]
#: Cases that are compared.
CASES: dict[str, Case] = {
    "balanced": ("developable", {}),
    "accurate": ("developable", {"options": "accurate"}),
    "jiang2020": ("developable", {"options": "jiang2020"}),
    "strain": ("flatten", {}),
    "lengths": ("flatten", {"formulation": "lengths"}),
}
#: Numbers of iterations at which the curve of the section "anytime" has points.
POINTS = (0, 1, 2, 3, 4, 6, 8, 12, 18, 24)
#: Vertices along the sides of the section "sizes".
SIZES = (32, 64, 128, 256)
#: Share by which the sections "guard" and "general" stretch designs along x, to measure how much
#: the cold solves of two practically equal designs differ.
STRETCH = 1e-6
#: Side of the hole in general meshes, as a share of the mesh's side; every other mesh has no hole.
HOLES = (0.0, 0.15)


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
    """Solve every design cold and hybrid: seconds, energies, and which used the net's start.

    Times are meaningful with ``workers=0`` only. With `stretched`, the energies of cold solves of
    the stretched designs are included; they show how much such minima differ by chance.
    """
    rows = []
    solved = partial(_solved, case, stretched)
    with open_executor(workers, main=True) as executor:
        for done in executor.as_completed(solved, designs):
            if done.error is not None:
                raise SystemExit(f"design {done.index}: {done.error}")
            rows.append(done.result)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _solved(case: Case, stretched: bool, design: Any) -> dict[str, float]:
    task, keywords = case
    cold, slow = timed(quietly, optimize, design, task=task, **keywords)
    warm, quick = timed(quietly, hybrid.solve, design, task=task, **keywords)
    least = max(energy(cold), 1e-300)
    found = {
        "cold": slow,
        "hybrid": quick,
        "net": warm.seconds["net"],
        "started": warm.warm_start == "net",
        "energy": energy(warm) / least,
    }
    if stretched:
        mesh = gso.as_mesh(design)
        near = mesh.replaced(mesh.vertices * [1.0 + STRETCH, 1.0, 1.0])
        again, _ = timed(quietly, optimize, near, task=task, **keywords)
        found["stretched"] = energy(again) / least
    return found


def ratios(energies: np.ndarray) -> dict[str, float]:
    """Summarise energies relative to the cold solve's."""
    shares = {f"% <= {most}": 100.0 * float((energies <= most).mean()) for most in (1.01, 1.05)}
    return {"energy": float(np.median(energies)), **shares, "worst": float(energies.max())}


def costs(found: dict[str, np.ndarray]) -> dict[str, float]:
    """Summarise times and energies, cold and hybrid."""
    times = {f"{k} ms": 1e3 * float(np.median(found[k])) for k in ("cold", "hybrid", "net")}
    share = float(np.median(found["hybrid"] / found["cold"]))
    started = 100.0 * float(found["started"].mean())
    return times | {"of the time": share, "started %": started, **ratios(found["energy"])}


def speed(n: int = 64, data: Path | None = None) -> dict[str, Any]:
    """Print time and energy of the same surfaces, cold and from the net's result."""
    chosen = first(n, data)
    rows: dict[Any, dict[str, Any]] = {}
    for name, case in CASES.items():
        if net_tasks.get(case[0]).default not in available(case[0]):
            print(f"{name}: no net comes with the package")
            continue
        compared(chosen[:2], case)  # imports and code generation of the first use
        rows[name] = costs(compared(progress(chosen, name), case))
    cold = float(np.median([timed(quietly, optimize, p, task="denoise")[1] for p in chosen]))
    blank = dict.fromkeys(next(iter(rows.values()), ()), "")
    rows["denoise, in closed form: no start can help"] = blank | {"cold ms": 1e3 * cold}
    title = f"Speed: medians over {len(chosen)} surfaces; energies over the cold ones"
    return tabulate(title, ["case"], rows)


def sizes(n: int = 4, data: Path | None = None) -> dict[str, Any]:
    """Print time and energy on other sizes, which ``gso.hybrid.time_model`` was chosen from."""
    chosen, rows = first(n, data), {}
    for side, preset in product(SIZES, PRESETS[1:]):
        grids = [resample(np.asarray(p, float), side, side) for p in chosen]
        quietly(hybrid.solve, grids[0], options=preset)
        shown_grids = progress(grids, f"{side} {preset}")
        found = compared(shown_grids, ("developable", {"options": preset}))
        rows[f"{side} x {side}", preset] = costs(found)
    title = f"Sizes: medians over {len(chosen)} surfaces, PyTorch loaded before"
    return tabulate(title, ["grid", "preset"], rows)


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


def general(n: int = 32, data: Path | None = None) -> dict[str, Any]:
    """Print energies on triangulated patches in random order, half of them with a hole."""
    chosen = first(n, data)
    meshes = [patch(p, HOLES[k % len(HOLES)], seed=k) for k, p in enumerate(chosen)]
    found = compared(progress(meshes, "general"), CASES["balanced"], stretched=True)
    rows = _against_chance(f"{len(meshes)} meshes", found)
    title = "General meshes, triangulated in random order, half with a hole"
    return tabulate(title, ["meshes", "solve"], rows)


def _against_chance(name: str, found: dict[str, np.ndarray]) -> dict[Any, dict[str, float]]:
    """Return rows of the hybrid solves, and of the cold ones of stretched designs."""
    started = {"started %": 100.0 * float(found["started"].mean())}
    stretched = f"cold, its input stretched by {STRETCH:g}"
    return {
        (name, "hybrid"): started | ratios(found["energy"]),
        (name, stretched): {"started %": ""} | ratios(found["stretched"]),
    }


def patch(grid: np.ndarray, hole: float, seed: int) -> Mesh:
    """Return a grid as triangles in random order, with a hole in its middle."""
    whole, rng = Mesh.from_grid(grid), np.random.default_rng(seed)
    sides = (np.linspace(-1, 1, n) for n in grid.shape[:2])
    at = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1)
    middle = np.abs(at.reshape(-1, 2)[whole.triangles].mean(axis=1)).max(axis=1)
    points, faces = shuffled(*without(whole.vertices, whole.triangles, middle < hole), rng)
    return Mesh(points, faces[rng.permutation(len(faces))])


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


SECTIONS = (speed, sizes, guard, general, anytime)

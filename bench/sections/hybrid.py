"""Time and energy of the optimiser with a warm start from a net, against a cold start.

The surfaces are those of the test split, which no net was trained on. They are drawn again from
the seed, or read from a set (``data=DIR``).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from harness import BENCH, axes_of, progress
from harness import timed as clocked
from report.store import Store
from report.surfaces import Surfaces, opened, screened

import gso
from gso import hybrid
from gso.hierarchy import resample
from gso.io import as_mesh
from gso.mesh import Mesh
from gso.net import tasks as net_tasks
from gso.net.catalogue import available
from gso.parallel import spread
from gso.tno import Start, optimize

#: Cases that are compared: task and keywords.
CASES = {
    "balanced": ("developable", {}),
    "accurate": ("developable", {"options": "accurate"}),
    "jiang2020": ("developable", {"options": "jiang2020"}),
    "strain": ("flatten", {}),
    "lengths": ("flatten", {"formulation": "lengths"}),
}
#: Numbers of iterations at which the curve of the section "anytime" has points.
POINTS = (0, 1, 2, 3, 4, 6, 8, 12, 18, 24)
#: Vertices along the sides of the section "sizes", and the presets compared there.
SIZES, PRESETS = (32, 64, 128, 256), ("balanced", "accurate")
#: Share by which the sections "guard" and "general" stretch designs along x, to measure how much
#: the cold solves of two practically equal designs differ.
STRETCH = 1e-6
_STRETCHED = f"cold, its input stretched by {STRETCH:g}"
#: Side of the hole in general meshes, as a share of the mesh's side; every other mesh has no hole.
HOLES = (0.0, 0.15)


def timed(function: Callable[..., Any], *given: Any, **keywords: Any) -> tuple[Any, float]:
    """Call a function and return its result and the milliseconds."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gso.ConvergenceWarning)
        value, seconds = clocked(function, *given, **keywords)
    return value, 1e3 * seconds


def split(name: str, data: Path | None) -> Surfaces:
    """Return a split of a set, or of the set of the published size."""
    out = BENCH / "out"
    if data is None:
        return screened(out / "surfaces", name, Store(out))
    return opened(out / "surfaces", data, name)


def first(surfaces: Surfaces, count: int) -> list[np.ndarray]:
    """Return the first surfaces of a split."""
    return [surfaces[k] for k in range(min(count, len(surfaces)))]


def energy(result: gso.Result) -> float:
    """Return the final value of the objective."""
    return sum(result.energy.values())


def compared(
    designs: Iterable[Any],
    task: str,
    keywords: dict[str, Any],
    workers: int | None = 0,
    stretched: bool = False,
) -> dict[str, np.ndarray]:
    """Solve every design cold and hybrid: milliseconds, energies, and which used the net's start.

    Times are meaningful with ``workers=0`` only. With `stretched`, the energies of cold solves of
    the stretched designs are included; they show how much such minima differ by chance.
    """
    rows = []
    solved = partial(_solved, task, keywords, stretched)
    with closing(spread(solved, designs, workers=workers)) as results:
        for done in results:
            if done.error is not None:
                raise SystemExit(f"design {done.index}: {done.error}")
            rows.append(done.value)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _solved(task: str, keywords: dict[str, Any], stretched: bool, design: Any) -> dict[str, float]:
    cold, slow = timed(optimize, design, task=task, **keywords)
    warm, quick = timed(hybrid.solve, design, task=task, **keywords)
    least = max(energy(cold), 1e-300)
    found = {
        "cold": slow,
        "hybrid": quick,
        "net": 1e3 * warm.seconds["net"],
        "started": warm.warm_start == "net",
        "energy": energy(warm) / least,
    }
    if stretched:
        mesh = as_mesh(design)
        near = mesh.replaced(mesh.vertices * [1.0 + STRETCH, 1.0, 1.0])
        again, _ = timed(optimize, near, task=task, **keywords)
        found["stretched"] = energy(again) / least
    return found


def ratios(energies: np.ndarray) -> str:
    """Summarise energies relative to the cold solve's."""
    shares = ", ".join(f"{(energies <= most).mean():.2%} <= {most}" for most in (1.01, 1.05))
    return f"median {np.median(energies):.4f}, {shares}, worst {energies.max():.4f}"


def costs(found: dict[str, np.ndarray]) -> str:
    """Summarise times and energies, cold and hybrid."""
    share = np.median(found["hybrid"] / found["cold"])
    return (
        f"cold {np.median(found['cold']):6.0f}  hybrid {np.median(found['hybrid']):6.0f} "
        f"(net {np.median(found['net']):.0f})  {share:.2f} of the time; "
        f"started {found['started'].mean():.0%}; energy {ratios(found['energy'])}"
    )


def summary(found: dict[str, np.ndarray]) -> dict[str, float]:
    """Return the medians."""
    return {name: float(np.median(values)) for name, values in found.items()}


def speed(n: int = 64, data: Path | None = None) -> dict[str, Any]:
    """Print time and energy of the same surfaces, cold and from the net's result."""
    chosen = first(split("test", data), n)
    out = {}
    print(
        f"\nSpeed: medians over {len(chosen)} surfaces, milliseconds; energies over the cold ones"
    )
    for name, (task, keywords) in CASES.items():
        if net_tasks.get(task).default not in available(task):
            print(f"  {name:10s} no net comes with the package")
            continue
        compared(chosen[:2], task, keywords)  # imports and code generation of the first use
        found = compared(progress(chosen, name), task, keywords)
        print(f"  {name:10s} {costs(found)}", flush=True)
        out[name] = summary(found)
    denoised = [timed(optimize, p, task="denoise")[1] for p in chosen]
    print(f"  denoise    cold {np.median(denoised):6.0f}, in closed form: no start can help")
    return out


def sizes(n: int = 4, data: Path | None = None) -> dict[str, Any]:
    """Print time and energy on other sizes, which ``gso.hybrid.time_model`` was chosen from."""
    chosen = first(split("test", data), n)
    out = {}
    print(f"\nSizes: medians over {len(chosen)} surfaces, milliseconds, PyTorch loaded before")
    for side in SIZES:
        grids = [resample(np.asarray(p, float), side, side) for p in chosen]
        for preset in PRESETS:
            keywords = {"options": preset}
            timed(hybrid.solve, grids[0], **keywords)
            found = compared(progress(grids, f"{side} {preset}"), "developable", keywords)
            print(f"  {side:4d} x {side:<4d} {preset:9s} {costs(found)}", flush=True)
            out[f"{side} {preset}"] = summary(found)
    return out


def guard(n: int = 0, data: Path | None = None) -> dict[str, Any]:
    """Print energies relative to the cold solve's, "balanced", on the splits test and hard."""
    out = {}
    print("\nGuard: energy of the hybrid solve over that of the cold one, balanced")
    for name in ("test", "hard"):
        some = split(name, data)
        total = min(n or len(some), len(some))
        designs = (some[k] for k in progress(range(total), name))
        found = compared(designs, "developable", {}, workers=None, stretched=True)
        print(f"  {name:6s} {total:5d} surfaces: {ratios(found['energy'])}")
        print(f"  {_STRETCHED}: {ratios(found['stretched'])}", flush=True)
        out[name] = summary(found)
    return out


def general(n: int = 32, data: Path | None = None) -> dict[str, Any]:
    """Print energies on triangulated patches in random order, half of them with a hole."""
    chosen = first(split("test", data), n)
    meshes = [patch(p, HOLES[k % len(HOLES)], seed=k) for k, p in enumerate(chosen)]
    found = compared(progress(meshes, "general"), "developable", {}, stretched=True)
    print(f"\nGeneral meshes: {len(meshes)}, triangulated in random order, half with a hole")
    print(f"  started {found['started'].mean():.0%}; energy {ratios(found['energy'])}")
    print(f"  {_STRETCHED}: {ratios(found['stretched'])}")
    return summary(found)


def patch(grid: np.ndarray, hole: float, seed: int) -> Mesh:
    """Return a grid as triangles in random order, with a hole in its middle."""
    whole = Mesh.from_grid(grid)
    sides = (np.linspace(-1, 1, n) for n in grid.shape[:2])
    at = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1)
    middle = at.reshape(-1, 2)[whole.triangles].mean(axis=1)
    faces = whole.triangles[np.abs(middle).max(axis=1) >= hole]
    rng = np.random.default_rng(seed)
    used = rng.permutation(np.unique(faces))
    new = np.empty(len(whole.vertices), int)
    new[used] = np.arange(len(used))
    return Mesh(whole.vertices[used], new[faces][rng.permutation(len(faces))])


def anytime(n: int = 16, data: Path | None = None, plot: str = "anytime.png") -> dict[str, Any]:
    """Plot energy relative to the cold solve's against time, for solves that are stopped early."""
    curves: dict[str, list[tuple[float, float]]] = {"TNO": [], "hybrid": []}
    chosen = first(split("test", data), n)
    final = [energy(timed(optimize, p)[0]) for p in progress(chosen, "anytime")]
    for most in progress(POINTS, "anytime"):
        for name, points in curves.items():
            rows = []
            for p, last in zip(chosen, final, strict=True):
                if name == "TNO":
                    result, spent = timed(optimize, p, x0=Start(None, iterations=most))
                else:
                    result, spent = timed(hybrid.solve, p, polish=most or False)
                rows.append((spent, energy(result) / last))
            points.append(tuple(np.median(rows, axis=0)))
    print(f"\nAnytime: medians over {len(chosen)} surfaces; energy over that of the cold solve")
    for name, points in curves.items():
        print(f"  {name:7s}" + "  ".join(f"{e:.3g} in {t:.0f} ms" for t, e in points))
    print(f"  the net alone is the first point of the hybrid; see {plot}")
    with axes_of(
        plot, xlabel="milliseconds for one surface", ylabel="energy / that of the cold solve"
    ) as axes:
        for name, points in curves.items():
            axes.plot(*np.array(points).T, marker=".", label=name)
        axes.plot(*curves["hybrid"][0], "o", color="black", label="net alone")
    return curves


SECTIONS = (speed, sizes, guard, general, anytime)

"""Show that a change of the code left figures as they were.

``python bench/compare_commits.py record OLD.npz`` records figures of the package that is imported
(set PYTHONPATH to the checkout). ``python bench/compare_commits.py compare OLD.npz NEW.npz``
compares two records. Residuals and Jacobians must agree to 1e-12, final figures to 1e-9.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import gso

#: Largest relative differences that count as unchanged: of evaluations, and of final figures.
EVALUATED, FINAL = 1e-12, 1e-9

BENCH24 = Path(__file__).parent / "data" / "bench24.npz"

Entries = Iterator[tuple[str, Any]]


def first_of(*names: str) -> Any:
    """Import the first module of the package that exists, as modules were moved."""
    folder = Path(gso.__file__).parent.parent
    for name in names:
        place = folder.joinpath(*name.split("."))
        if place.is_dir() or place.with_suffix(".py").exists():
            return importlib.import_module(name)
    raise ModuleNotFoundError(names)


def surfaces(count: int) -> list[np.ndarray]:
    """Return the surfaces of bench24."""
    with np.load(BENCH24) as data:
        return [points.astype(float) for points in data["surfaces"][:count]]


def of_result(name: str, result: Any) -> Entries:
    """Yield the figures of a result."""
    yield f"{name}/vertices", result.mesh.vertices
    if result.flat is not None:
        yield f"{name}/flat", result.flat
    for term, value in result.energy.items():
        yield f"{name}/energy {term}", value
    for metric, value in result.metrics.items():
        yield f"{name}/{metric}", value
    yield f"{name}/status", result.status.name
    yield f"{name}/iterations", result.iterations


def terms() -> Entries:
    """Residuals and Jacobians of every term's examples."""
    registry = first_of("gso.energy", "gso.terms").registry()
    kernels = first_of("gso.solver.kernels", "gso.tno.codegen")
    x, y = np.meshgrid(np.linspace(-1, 1, 6), np.linspace(-1, 1, 7), indexing="ij")
    mesh = gso.Mesh.from_grid(np.stack([x, y, 0.3 * x * y + 0.1 * x**3], axis=-1))
    random = np.random.default_rng(0)
    sys.path.insert(0, str(Path(__file__).parents[1]))
    examples = importlib.import_module("tests.conformance.term_examples").examples
    sizes = {"surface": 3, "flat": 2, "scale": 1}
    for name, module in registry.items():
        # They were moved to the tests.
        own = getattr(module, "examples", None)
        for k, term in enumerate(examples(name, mesh) if own is None else own(mesh)):
            dims = [sizes[block] for block, ids in term.stencil for _ in range(ids.shape[1])]
            at = 0.5 + 0.1 * random.normal(size=(sum(dims), term.count))
            constants = term.constants if term.constants.size else np.empty((0, term.count))
            run = kernels.kernel(term.residual, tuple(dims), len(constants), True)
            for what, value in zip(("residual", "jacobian"), run(at, constants), strict=True):
                yield f"{name} {k}/{what}", value


def developable() -> Entries:
    """The presets on bench24."""
    for preset in ("fast", "balanced", "accurate", "jiang2020"):
        for k, points in enumerate(surfaces(24)):
            yield from of_result(f"{preset} {k}", gso.tno.optimize(points, options=preset))


def flatten() -> Entries:
    """The objectives of the flatten task, and conformal images."""
    for k, points in enumerate(surfaces(8)):
        for formulation in ("strain", "lengths", "isometry"):
            done = gso.tno.optimize(points, task="flatten", formulation=formulation)
            yield from of_result(f"{formulation} {k}", done)
        yield from of_result(f"conformal {k}", gso.tno.optimize(points, task="conformal"))


def denoise() -> Entries:
    """Both formulations of the denoise task."""
    random = np.random.default_rng(1)
    for k, points in enumerate(surfaces(6)):
        noisy = points + 0.01 * random.normal(size=points.shape)
        for formulation in ("smooth", "crease"):
            done = gso.tno.optimize(noisy, task="denoise", formulation=formulation)
            yield from of_result(f"{formulation} {k}", done)


def constraints() -> Entries:
    """Every kind of constraint, bounds, splines, sessions, and meshes that are no grids."""
    u, v = np.meshgrid(np.linspace(-1, 1, 17), np.linspace(-1, 1, 17), indexing="ij")
    mesh = gso.Mesh.from_grid(np.stack([u, v, 0.3 * u * v], axis=-1))
    lifted, rim = mesh.vertices[[0]] + np.array([0.0, 0.0, 0.1]), np.arange(17)
    line = np.stack([np.linspace(-1.2, 1.2, 30), np.full(30, 1.0), np.linspace(-0.4, 0.4, 30)], 1)
    lengths = [gso.FixedLengths(np.stack([rim[:-1], rim[1:]], axis=1))]
    kinds: dict[str, list[Any]] = {
        "fixed": [gso.Fixed([0, 16, 288])],
        "boundary": [gso.FixedBoundary()],
        "handle": [gso.Fixed([16]), gso.Handle([0], lifted)],
        "soft handle": [gso.Handle([0], lifted, weight=0.1)],
        "curve": [gso.OnCurve(rim * 17 + 16, line)],
        "sliding": [gso.SlidingBoundary()],
        "symmetry": [gso.SymmetryPlane([0, 0, 0], [1, -1, 0])],
        "planar": [gso.PlanarFaces()],
        "lengths": lengths,
    }
    far = mesh.vertices[[288]] + [-0.2, -0.2, 0.0]
    glued = [gso.Fixed([0]), gso.Handle([288], far + np.array([0.0, 0.0, 0.2]))]
    asked: dict[str, dict[str, Any]] = {
        **{name: {"constraints": given} for name, given in kinds.items()},
        "flat": {"task": "flatten", "constraints": lengths},
        "bend": {"task": "bend", "constraints": glued},
        "deviation": {"max_deviation": 0.05},
        "strain": {"max_strain": 0.01},
        "target": {"target_curvature": 0.05},
        "isometry": {"formulation": "isometry", "max_deviation": 0.1},
        "spline": {"options": gso.DevelopableOptions(variables="surface", controls=8)},
        "free": {"options": gso.DevelopableOptions(variables="free")},
        "warm": {"x0": mesh.vertices * [1.0, 1.0, 0.8]},
    }
    for name, keywords in asked.items():
        yield from of_result(name, gso.tno.optimize(mesh, **keywords))
    triangles = gso.Mesh(mesh.vertices, mesh.triangles)
    yield from of_result("triangles", gso.tno.optimize(triangles))
    points = np.concatenate([mesh.vertices, 2 * mesh.vertices + [9, 0, 0]])
    two = gso.Mesh(points, np.concatenate([mesh.faces, mesh.faces + len(mesh.vertices)]))
    yield from of_result("two", gso.tno.optimize(two))
    session = gso.tno.Session(mesh, constraints=glued)
    for height in (0.3, 0.4):
        session.move([288], far + np.array([0.0, 0.0, height]))
        yield f"session {height}/vertices", session.step(2)
    yield from of_result("session", session.settle())


def nets() -> Entries:
    """Predictions of the shipped nets, and hybrid solves."""
    for k, points in enumerate(surfaces(3)):
        for task in ("developable", "flatten", "denoise"):
            yield f"{task} net {k}/points", np.asarray(gso.net.predict(points, task=task))
        yield from of_result(f"hybrid {k}", gso.hybrid.solve(points))


def strips() -> Entries:
    """Strips of surfaces, by number and within a distance."""
    for k, points in enumerate(surfaces(4)):
        for name, keywords in {"4": {"strips": 4}, "near": {"max_deviation": "2%"}}.items():
            found = gso.strips(points, **keywords)
            yield f"{name} {k}/vertices", found.mesh.vertices
            yield f"{name} {k}/pattern", found.pattern.flat
            yield f"{name} {k}/farthest", found.ruled.farthest


def pieces() -> Entries:
    """Pieces of a dome and of a closed surface, as they are and within a distance."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
    whole = importlib.import_module("whole")
    for name in ("dome", "canopy"):
        for limits in ({"max_strain": 0.01}, {"max_deviation": "2%"}):
            found = gso.pieces(whole.DESIGNS[name](), workers=0, **limits)
            for key, value in found.metrics.items():
                yield f"{name} {next(iter(limits))}/{key}", value
            yield f"{name} {next(iter(limits))}/edges", np.asarray(found.edges)


GROUPS: dict[str, Callable[[], Entries]] = {
    f.__name__: f for f in (terms, developable, flatten, denoise, constraints, nets, strips, pieces)
}


def record(path: str, only: str | None) -> None:
    """Write the figures of the imported package."""
    found = {}
    for name, group in GROUPS.items():
        if only in (None, name):
            found |= {f"{name}/{key}": np.asarray(value) for key, value in group()}
            print(f"{name}: {len(found)} entries so far", file=sys.stderr)
    np.savez_compressed(path, **found)


def compare(old: str, new: str) -> int:
    """Print where two records differ; return the number of entries that differ too much."""
    with np.load(old) as a, np.load(new) as b:
        before, after = dict(a), dict(b)
    bad = 0
    for group in GROUPS:
        names = [n for n in before if n.startswith(f"{group}/") and n in after]
        lost = sum(n.startswith(f"{group}/") and n not in after for n in before)
        limit = EVALUATED if group == "terms" else FINAL
        far = [(difference(before[n], after[n]), n) for n in names]
        over = sorted((d, n) for d, n in far if d > limit)[::-1]
        same = sum(d == 0 for d, _ in far)
        differ = f"{same} equal, {len(over)} above {limit:g}, {lost} lost"
        print(f"{group}: {len(names)} entries, {differ}")
        for d, n in over[:8]:
            print(f"    {d:9.2e}  {n}")
        bad += len(over) + lost
    return bad


def difference(a: np.ndarray, b: np.ndarray) -> float:
    """Return the largest difference relative to the largest value; infinity for other shapes."""
    if a.shape != b.shape:
        return np.inf
    if a.dtype.kind not in "fi":
        return 0.0 if (a == b).all() else np.inf
    if not a.size or np.array_equal(a, b, equal_nan=True):
        return 0.0
    scale = max(float(np.nanmax(np.abs(a))), 1e-9)
    return float(np.nanmax(np.abs(a - b), initial=0.0)) / scale


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("action", choices=("record", "compare"))
    parser.add_argument("files", nargs="+")
    parser.add_argument("--only", choices=GROUPS)
    given = parser.parse_args()
    if given.action == "record":
        record(given.files[0], given.only)
    else:
        sys.exit(compare(*given.files) > 0)

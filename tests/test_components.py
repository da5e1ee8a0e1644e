"""Components of one mesh do not disturb each other."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import gso
from gso import Mesh, Status, metrics
from gso.components import average, combined, labels, split
from gso.executors import useful_workers
from gso.pipeline import Canonical
from gso.tasks import compute_metrics
from gso.tasks.developable import Options

#: Tasks and formulations, with options.
ASKED = [
    ("developable", "curvature", "fast"),
    ("developable", "curvature", "balanced"),
    ("developable", "isometry", "fast"),
    ("developable", "isometry", "jiang2020"),
    ("flatten", "strain", None),
    ("flatten", "lengths", None),
    ("flatten", "isometry", None),
    ("denoise", "smooth", None),
    ("denoise", "crease", None),
    ("bend", None, "fast"),
    ("conformal", None, None),
]
FLAT = ("flatten", "conformal")


def panel(n: int = 9) -> Mesh:
    u, v = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    return Mesh.from_grid(np.stack([u, v, 0.3 * u * v + 0.1 * np.sin(2 * u) * v**2], axis=-1))


def irregular() -> Mesh:
    """A panel with a corner cut off and a hole: no grid."""
    mesh = panel()
    kept = mesh.faces[np.setdiff1d(np.arange(64), [0, 1, 8, 36, 37])]
    ids = np.unique(kept)
    return Mesh(mesh.vertices[ids], np.searchsorted(ids, kept))


SHAPES = {"grid": panel, "irregular": irregular}


def together(*meshes: Mesh) -> Mesh:
    """Meshes as one."""
    starts = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    faces = [m.faces + k for m, k in zip(meshes, starts, strict=False)]
    return Mesh(np.concatenate([m.vertices for m in meshes]), np.concatenate(faces))


def moved(mesh: Mesh, shift: object, scale: float = 1.0) -> Mesh:
    return mesh.replaced(scale * mesh.vertices + shift)


def pulled(mesh: Mesh) -> list[gso.constraints.Constraint]:
    """A side of every component held, the opposite one lifted."""
    fixed, lifted = [], []
    for part in split(mesh):
        x, size = part.mesh.vertices[:, 0], part.mesh.frame.scale
        fixed.append(part.vertices[x < x.min() + 0.01 * size])
        lifted.append(part.vertices[x > x.max() - 0.01 * size])
    ids = np.concatenate(lifted)
    return [
        gso.Fixed(np.concatenate(fixed)),
        gso.Handle(ids, mesh.vertices[ids] + [-0.1, 0.0, 0.2]),
    ]


def solve(mesh: Mesh, task: str, formulation: str | None, options: str | None, **more: object):
    if task == "bend":
        more["constraints"] = pulled(mesh)
    return gso.tno.optimize(mesh, task=task, formulation=formulation, options=options, **more)


@cache
def solved(shape: str, *asked: str | None) -> gso.Result:
    """A panel of its own, solved once; no test may change the result."""
    return solve(SHAPES[shape](), *asked)


def outcome(result: gso.Result) -> np.ndarray:
    return result.mesh.vertices if result.task not in FLAT else np.asarray(result.flat)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("asked", ASKED, ids=lambda a: "-".join(filter(None, a)))
def test_copies_get_what_one_alone_gets(shape, asked):
    mesh, task = SHAPES[shape](), asked[0]
    size = mesh.frame.scale
    alone = solved(shape, *asked)
    assert not alone.components
    twice = solve(together(mesh, mesh), *asked)
    assert [np.array_equal(outcome(r), outcome(alone)) for r in twice.components] == [True] * 2
    if task not in FLAT:
        n = len(mesh.vertices)
        assert np.array_equal(twice.mesh.vertices[:n], alone.mesh.vertices)
        assert np.array_equal(twice.mesh.vertices[n:], alone.mesh.vertices)
    assert twice.metrics == alone.metrics
    assert twice.energy == pytest.approx(alone.energy, rel=1e-14)
    assert twice.status is alone.status
    # Copies are solved once, unless constraints tell them apart.
    assert twice.iterations == (2 if task == "bend" else 1) * alone.iterations
    for shifts in ([[3.0 * k, 0, 0] for k in range(8)], [[0.0, 0, 0], [100.0 * size, 0, 0]]):
        many = solve(together(*(moved(mesh, s) for s in shifts)), *asked)
        places = [0.0 if task in FLAT else s for s in shifts]
        for result, at in zip(many.components, places, strict=True):
            assert np.abs(outcome(result) - at - outcome(alone)).max() < 1e-9 * size
        assert many.metrics == pytest.approx(alone.metrics, rel=1e-6, abs=1e-9)
        assert many.status is alone.status


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("asked", ASKED, ids=lambda a: "-".join(filter(None, a)))
def test_a_panel_far_away_gets_what_it_gets_at_home(shape, asked):
    mesh, task = SHAPES[shape](), asked[0]
    size = mesh.frame.scale
    shift = np.array([100.0 * size, 0.0, 0.0])
    far = moved(mesh, shift)
    given = [Canonical(m).mesh.vertices for m in (mesh, far)]
    assert np.abs(given[0] - given[1]).max() < 1e-12
    noise = 1e-12 * size * np.random.default_rng(0).standard_normal(mesh.vertices.shape)
    alone = solved(shape, *asked)
    there, shaken = (solve(m, *asked) for m in (far, moved(mesh, noise)))
    at = 0.0 if task in FLAT else shift
    off = np.abs(outcome(there) - at - outcome(alone)).max() / size
    spread = np.abs(outcome(shaken) - outcome(alone)).max() / size
    said = f"moved by 100 sizes {off:.1e}, perturbed by 1e-12 {spread:.1e}, of the size"
    assert off < max(1e-6, 10 * spread), said


@pytest.mark.parametrize("asked", ASKED, ids=lambda a: "-".join(filter(None, a)))
def test_different_components_get_to_the_bit_what_each_gets_alone(asked):
    parts = [panel(), moved(irregular(), [40.0, 3.0, 0.0], 0.1), moved(panel(12), [0, 9.0, 1.0])]
    whole = together(*parts)
    result = solve(whole, *asked)
    # Lifted by a length, not by a share of the size.
    own_results = [solved("grid", *asked), *(solve(part, *asked) for part in parts[1:])]
    for alone, own in zip(own_results, result.components, strict=True):
        assert np.array_equal(outcome(own), outcome(alone))
        assert own.metrics == alone.metrics
        assert own.status is alone.status
    areas = [metrics.area(part) for part in parts]
    assert result.metrics == combined([own.metrics for own in result.components], areas)
    if result.cell_scale is not None:
        m = len(parts[0].faces)
        assert np.array_equal(result.cell_scale[:m], result.components[0].cell_scale)


def test_interleaved_numbering():
    a, b = panel(), moved(irregular(), [5.0, 0, 0])
    whole = together(a, b)
    rng = np.random.default_rng(3)
    order, of_face = rng.permutation(len(whole.vertices)), rng.permutation(len(whole.faces))
    place = np.argsort(order)
    mixed = Mesh(whole.vertices[order], place[whole.faces][of_face])
    loose = Mesh(
        np.concatenate([mixed.vertices, [[50.0, 0, 0]]]),
        mixed.faces,
    )
    for mesh in (mixed, loose):
        n = len(whole.vertices)
        result = gso.tno.optimize(mesh, task="conformal")
        plain = gso.tno.optimize(whole, task="conformal")
        assert len(result.components) == 2
        for own in result.components:
            assert np.array_equal(mesh.vertices[own.names], own.design.vertices)
        assert result.metrics == pytest.approx(plain.metrics, rel=1e-3, abs=1e-6)
        assert result.cell_scale == pytest.approx(plain.cell_scale[of_face], rel=1e-3)
        assert (result.flat[n:] == 0).all()
    denoised = gso.tno.optimize(loose, task="denoise")
    assert (denoised.mesh.vertices[-1] == loose.vertices[-1]).all()


def test_bounds_and_targets_are_those_of_every_component():
    big, small = panel(), moved(panel(12), [9.0, 0, 0], 0.2)
    whole = together(big, small)
    bounded = gso.tno.optimize(whole, max_deviation=0.01, options="fast")
    for part, own in zip((big, small), bounded.components, strict=True):
        far = metrics.point_to_surface(own.mesh.vertices, part)
        assert far.max() <= 0.01 * (1 + 1e-6)
    aimed = gso.tno.optimize(whole, target_curvature=0.02)
    for part, own in zip((big, small), aimed.components, strict=True):
        assert metrics.loss_gc(own.mesh, scale=metrics.unit(part)) <= 0.02 * 1.05
    assert aimed.status is Status.TARGET_REACHED


def test_starts_and_constraints_are_divided():
    a, b = panel(), moved(irregular(), [5.0, 0, 0])
    whole, n = together(a, b), len(a.vertices)
    x0 = whole.vertices + np.array([0.0, 0.0, 0.01])
    result = gso.tno.optimize(whole, x0=x0, constraints=[gso.Fixed([0, n])], options="fast")
    for k, (part, first) in enumerate([(a, 0), (b, n)]):
        own = x0[first : first + len(part.vertices)]
        alone = gso.tno.optimize(part, x0=own, constraints=[gso.Fixed([0])], options="fast")
        assert np.array_equal(result.components[k].mesh.vertices, alone.mesh.vertices)
    assert np.allclose(result.mesh.vertices[[0, n]], whole.vertices[[0, n]], atol=1e-12)
    assert result.warm_start == "x0"
    assert result.details["constraints"]["constraint 0 (Fixed)"] < 1e-9
    with pytest.raises(gso.MeshError, match="x0 has shape"):
        gso.tno.optimize(whole, x0=x0[:-1])


def test_flat_images_that_are_held_stay_and_others_lie_beside_them():
    a, b = panel(), irregular()
    whole, n = together(a, b), len(a.vertices)
    handle = gso.Handle([n, n + 3], [[10.0, 5.0], [10.0, 5.8]])
    flat = gso.tno.optimize(whole, task="flatten", constraints=[handle]).flat
    assert np.allclose(flat[[n, n + 3]], [[10.0, 5.0], [10.0, 5.8]], atol=1e-6)
    assert flat[:n, 0].min() > flat[n:, 0].max()


def test_sliding_boundaries_stay_on_their_own_component():
    near = together(panel(), moved(panel(), [2.01, 0, 0]))
    result = gso.tno.optimize(near, constraints=[gso.SlidingBoundary()], options="fast")
    alone = gso.tno.optimize(panel(), constraints=[gso.SlidingBoundary()], options="fast")
    assert np.array_equal(result.components[0].mesh.vertices, alone.mesh.vertices)


def test_a_misbehaving_component_is_named():
    ball = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [-1, -1, -1]])
    closed = Mesh(ball, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    quads = panel()
    quads = quads.replaced(quads.vertices * [1.0, 1.0, 0.5])
    triangles = Mesh(quads.vertices, quads.triangles)
    with pytest.raises(gso.MeshError, match=r"component 1 of 2 .* vertex 81\).*closed"):
        gso.tno.optimize(together(triangles, closed), task="flatten")
    whole = together(quads, moved(quads, [9.0, 0, 0]))
    apart = gso.Handle([81, 82], whole.vertices[[81, 82]] + [[0, 0, 0], [0, 0.1, 0]])
    locked = gso.FixedLengths([[0, 1], [81, 82]])
    with pytest.warns(gso.ConvergenceWarning):
        result = gso.tno.optimize(whole, constraints=[apart, locked], options="fast")
    assert result.status is Status.CONSTRAINTS_MISSED
    named = [note for note in result.notes if note.startswith("component 1: ") and "missed" in note]
    ids = [int(i) for i in named[0].split("(vertices ")[1].rstrip(")").split(",")]
    assert min(ids) >= 81


def test_progress_and_cancelling():
    whole = together(panel(), moved(irregular(), [5.0, 0, 0]), moved(panel(12), [9.0, 0, 0]))
    seen = []
    result = gso.tno.optimize(whole, options="fast", callback=seen.append)
    done = [p.stage / p.stages for p in seen]
    assert done == sorted(done)
    assert {p.name.split(",")[0] for p in seen} == {f"component {k}" for k in range(3)}
    assert len(result.history) == len(seen)
    after = []

    def stop(progress):
        after.append(progress)
        return len(after) < 3

    with pytest.warns(gso.ConvergenceWarning):
        for task in ("developable", "flatten"):
            after.clear()
            stopped = gso.tno.optimize(whole, task=task, callback=stop)
            assert stopped.status is Status.CANCELLED
            assert not stopped.usable
            assert len(after) == 3
            assert np.isfinite(stopped.mesh.vertices).all()


@pytest.mark.parametrize("task", ["developable", "flatten"])
def test_processes_give_what_one_process_gives(task, monkeypatch):
    whole = together(panel(), moved(irregular(), [5.0, 0, 0]), moved(panel(12), [9.0, 0, 0]))
    plain = gso.tno.optimize(whole, task=task, options="fast")
    monkeypatch.setattr("gso.pipeline.component_solves._useful_workers", lambda sizes: 2)
    seen = []
    shared = gso.tno.optimize(whole, task=task, options="fast", callback=seen.append)
    assert np.array_equal(plain.mesh.vertices, shared.mesh.vertices)
    assert plain.metrics == shared.metrics
    assert len(seen) == 3
    with pytest.warns(gso.ConvergenceWarning):
        stopped = gso.tno.optimize(whole, task=task, callback=lambda _: False)
    assert stopped.status is Status.CANCELLED


def test_scripts_without_a_guard_and_workers_of_a_batch(tmp_path, monkeypatch):
    script = tmp_path / "script.py"
    script.write_text(
        "import numpy as np, gso\n"
        "from gso.executors import base\n"
        "from gso.pipeline import component_solves\n"
        "print('once')\n"
        "component_solves._WORTH = 0\n"
        "base.processors = lambda: 2\n"
        "u, v = np.meshgrid(*2 * [np.linspace(-1, 1, 9)], indexing='ij')\n"
        "one = gso.Mesh.from_grid(np.stack([u, v, 0.3 * u * v], axis=-1))\n"
        "two = one.replaced(one.vertices * [1, 1, 2] + 9)\n"
        "both = gso.Mesh(np.r_[one.vertices, two.vertices], np.r_[one.faces, two.faces + 81])\n"
        "print(gso.tno.optimize(both, options='fast').iterations > 0)\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(gso.__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, check=True, env=environment
    )
    assert done.stdout.split() == ["once", "True"]
    assert useful_workers(1) == 0
    monkeypatch.setattr("gso.executors.base.processors", lambda: 2)
    assert useful_workers(3) == 2
    monkeypatch.setattr("gso.executors.base.parent_process", lambda: object())
    assert useful_workers(3) == 0


def test_written_and_read(tmp_path):
    whole = together(panel(), moved(irregular(), [5.0, 0, 0]))
    for task in ("developable", "conformal"):
        result = gso.tno.optimize(whole, task=task, options="fast")
        result.save(tmp_path / "r.npz")
        again = gso.Result.load(tmp_path / "r.npz")
        assert again.metrics == result.metrics
        for a, b in zip(result.components, again.components, strict=True):
            assert (a.status, a.metrics, a.notes) == (b.status, b.metrics, b.notes)
            assert np.array_equal(a.mesh.faces, b.mesh.faces)
            assert np.array_equal(a.names, b.names)
        assert again.usable is result.usable is True


def test_measures_of_the_whole():
    big, small = panel(), moved(panel(), [9.0, 0, 0], 0.01)
    whole = together(big, small)
    lifted = whole.replaced(whole.vertices * [1, 1, 0.5])
    alone = compute_metrics(
        "developable", big, moved(big, 0.0).replaced(big.vertices * [1, 1, 0.5]), None
    )
    assert compute_metrics("developable", whole, lifted, None) == pytest.approx(alone, rel=1e-9)
    assert average(metrics.loss_gc, whole) == pytest.approx(metrics.loss_gc(big), rel=1e-9)
    other = compute_metrics("developable", big, lifted, None)
    assert np.isfinite(list(other.values())).all()
    flips = [{"flipped_cells": 1.0, "scale_min": 0.5}, {"flipped_cells": 2.0, "scale_min": 0.2}]
    assert combined(flips, [1.0, 1.0]) == {"flipped_cells": 3.0, "scale_min": 0.2}
    assert {info.aggregation for info in metrics.INFO.values()} == {"mean", "max", "min", "sum"}


def test_labels_follow_the_numbering_and_links():
    whole = together(panel(3), panel(3), panel(3))
    assert labels(whole).tolist() == [0] * 9 + [1] * 9 + [2] * 9
    assert labels(whole, [(20, 1)]).tolist() == [0] * 9 + [1] * 9 + [0] * 9


#: Relative displacement by which a joined component may differ from one alone: both solves stop
#: by the change of the energy, one of it all.
JOINED = {"developable": 0.02, "flatten": 5e-3, "conformal": 1e-3}


@pytest.mark.parametrize(
    "asked", [a for a in ASKED if a[0] in JOINED], ids=lambda a: "-".join(filter(None, a))
)
def test_joined_components_keep_the_weights_of_their_own_sizes(asked):
    """Constraints of no weight keep two components in one solve."""
    big, small = panel(), moved(irregular(), [3.0, 0, 0], 0.02)
    whole, n = together(big, small), len(big.vertices)
    tie = gso.FixedLengths([[0, n]], weight=1e-13)
    joined = solve(whole, *asked, constraints=[tie])
    assert not joined.components
    shares, energies = [], []
    for part, ids in ((big, slice(0, n)), (small, slice(n, None))):
        free = solve(part, *asked, constraints=[gso.FixedLengths([[0, 1]], weight=1e-13)])
        edges = [[0, 1], [0, 20], [5, 50], [7, 66]]
        a, b = (
            np.linalg.norm(np.diff(p[edges], axis=1), axis=2) / part.frame.scale
            for p in (outcome(free), outcome(joined)[ids])
        )
        assert np.abs(a - b).max() < JOINED[asked[0]]
        shares.append(metrics.area(part))
        energies.append(sum(free.energy.values()))
    mean = np.average(energies, weights=shares)
    assert sum(joined.energy.values()) == pytest.approx(mean, rel=0.05)


def test_glue_joins_components_of_different_sizes_and_leaves_others():
    left, right = panel(), moved(panel(), [1.5, 0, 0], 0.5)
    whole = together(left, right, moved(irregular(), [9.0, 0, 0]))
    corners = gso.Glue([[76, 81 + 4]])
    result = gso.tno.optimize(whole, constraints=[corners])
    assert len(result.components) == 2
    assert any("joined by constraints" in note for note in result.notes)
    assert np.allclose(result.mesh.vertices[76], result.mesh.vertices[85], atol=1e-9)
    alone = gso.tno.optimize(moved(irregular(), [9.0, 0, 0]))
    assert np.array_equal(result.components[1].mesh.vertices, alone.mesh.vertices)
    assert result.metrics["loss_gc"] < 0.7 * result.metrics["loss_gc_before"]


def test_splines_belong_to_components(tmp_path):
    whole = together(panel(), moved(panel(12), [5.0, 0, 0]))
    options = Options(variables="surface", controls=6)
    result = gso.tno.optimize(whole, options=options)
    assert result.spline is None
    assert all(own.spline is not None for own in result.components)
    assert any("spline of its own" in note for note in result.notes)
    with pytest.raises(gso.MeshError, match="one by one"):
        result.save(tmp_path / "whole.step")


def test_hybrid_and_sessions():
    whole = together(panel(), moved(irregular(), [5.0, 0, 0]))
    result = gso.hybrid.solve(whole, options="fast")
    for own in result.components:
        alone = gso.hybrid.solve(own.design, options="fast")
        assert np.array_equal(own.mesh.vertices, alone.mesh.vertices)
        assert own.warm_start == alone.warm_start
    session = gso.tno.Session(whole, constraints=pulled(whole))
    settled = session.settle()
    assert settled.usable
    assert settled.metrics["edge_length_error"] < 0.05

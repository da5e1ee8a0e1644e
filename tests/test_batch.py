"""Batched solves: the same objective and results as one surface at a time."""

from __future__ import annotations

import subprocess
import sys
from functools import cache, partial

import numpy as np
import pytest

import gso
from gso import linalg
from gso.constraints import Compiled
from gso.dataset import generate
from gso.energy import registry
from gso.executors import SERIAL, ProcessExecutor
from gso.linalg import Pattern
from gso.pipeline import Case
from gso.solver import Problem, kernels
from gso.tasks import check
from gso.unknowns import DIMENSIONS
from gso.verdict import Code
from tests.conformance.term_examples import examples
from tests.conftest import codes, cylinder, meshes, saddle

torch = pytest.importorskip("torch")

from gso.solver import GaussNewton  # noqa: E402
from gso.tno.batched import (  # noqa: E402
    DeviceExecutor,
    batch_steps,
    check_batch,
    cholesky,
    device,
    minimise_elsewhere,
    solve_all,
    solve_batch,
)
from gso.tno.batched import tensor_kernels as on_tensors  # noqa: E402
from gso.tno.batched.batch_problem import Problem as Batch  # noqa: E402
from gso.tno.batched.stage_batch import TooLarge, Unbatchable, gather  # noqa: E402
from gso.tno.batched.tensor_terms import stack_losses  # noqa: E402

CPU = torch.device("cpu")
SIZE = 33


TERMS = [
    pytest.param(term, id=f"{name}-{kind}-{k}")
    for name in registry()
    for kind, mesh in meshes().items()
    for k, term in enumerate(examples(name, mesh))
]


@pytest.fixture(scope="module")
def designs():
    return np.stack([s.sample(SIZE) for s in generate(4, seed=11)])


def planned(task, points, **request):
    case = Case(
        check(task, **request), gso.Mesh.from_grid(points), Compiled(flat=task == "flatten")
    )
    return case.task.plan(case.analysis, case.solver_request)


def bump(n, height):
    """A surface far from any plane: its flat image needs the stages against collapse."""
    u, v = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    return np.stack([u, v, height * np.exp(-3.0 * (u * u + v * v))], axis=-1)


CASES = {
    "developable": ("developable", {}, None),
    "accurate": ("developable", {"options": "accurate"}, None),
    "flatten": ("flatten", {}, None),
    "lengths": ("flatten", {"formulation": "lengths"}, None),
    "strained": ("flatten", {}, (3.0, 3.2)),
}


@pytest.mark.parametrize("term", TERMS)
def test_kernels_are_those_of_the_solver(term):
    shape = tuple(DIMENSIONS[block] for block, index in term.stencil for _ in range(index.shape[1]))
    rng = np.random.default_rng(0)
    x = rng.standard_normal((sum(shape), 40))
    c = 0.5 + rng.random((len(term.constants), 40))
    given = torch.as_tensor(x).view(-1, 8, 5), torch.as_tensor(c).view(-1, 8, 5)
    pairs = [("kernel", term.residual, (False,)), ("kernel", term.residual, (True,))]
    if term.vectors is not None:
        pairs.append(("geometric_stiffness", term.vectors, ()))
    for name, function, more in pairs:
        key = function, shape, len(c), *more
        wanted = getattr(kernels, name)(*key)(x, c)
        found = getattr(on_tensors, name)(*key)(*given)
        for a, b in zip(found, wanted, strict=True):
            assert a.shape == (*b.shape[:-1], 8, 5)
            np.testing.assert_allclose(a.reshape(b.shape), b, rtol=1e-11, atol=1e-12)


def close(found, wanted):
    np.testing.assert_allclose(found, wanted, rtol=1e-10, atol=1e-10 * np.abs(wanted).max())


def lower(pattern, values):
    from scipy.sparse import csc_matrix

    return csc_matrix((values, pattern.indices, pattern.indptr), shape=(pattern.size,) * 2)


@pytest.mark.parametrize("name", CASES)
def test_energy_gradient_and_matrix_are_those_of_the_solver(name, designs):
    task, request, heights = CASES[name]
    points = designs[:2] if heights is None else np.stack([bump(21, h) for h in heights])
    plans = [planned(task, p, **request) for p in points]
    assert len({len(plan.stages) for plan in plans}) == 1
    rng = np.random.default_rng(0)
    coordinates = [plan.start for plan in plans]
    for own in zip(*(plan.stages for plan in plans), strict=True):
        coordinates = [s.enter(c) for s, c in zip(own, coordinates, strict=True)]
        gathered = gather(own, coordinates, "gauss-newton")
        problem, x = Batch([gathered], CPU), torch.as_tensor(gathered.start.T)
        losses = [stack_losses(each, CPU) for each in gathered.continuation]
        x = x + 1e-4 * torch.as_tensor(rng.standard_normal(x.shape))
        for number, loss in enumerate(losses or [None]):
            here = problem if loss is None else problem.with_loss(own[0].continued, loss)
            energy, gradient, values = here.linearise(x)
            step = torch.as_tensor(rng.standard_normal(x.shape))
            longest = here.largest_step(x, step)
            order = np.argsort(here.structure.entries.order)
            for k, stage in enumerate(own):
                one = Problem(stage.items, stage.unknowns(coordinates[k]), stage.limits)
                if loss is not None:
                    one = one.with_loss(stage.continued, stage.continuation[number])
                wanted = one.linearise(x[:, k].numpy())
                assert float(energy[k]) == pytest.approx(wanted[0], rel=1e-12)
                close(gradient[:, k].numpy(), wanted[1])
                # The patterns differ by entries that are always zero.
                matrix = lower(here.structure.pattern, values[:, k].numpy()[order])
                difference = matrix - lower(one.pattern, wanted[2])
                assert abs(difference).max() <= 1e-10 * np.abs(wanted[2]).max()
                assert float(here.energy(x)[k]) == pytest.approx(wanted[0], rel=1e-12)
                limit = one.largest_step(x[:, k].numpy(), step[:, k].numpy())
                assert float(longest[k]) == pytest.approx(limit, rel=1e-12)
        some = problem.of_surfaces(torch.tensor([1]))
        np.testing.assert_allclose(some.energy(x[:, 1:]), problem.energy(x)[1:], rtol=1e-13)


def banded(n, band, seed, count=3):
    """A band pattern, and values of positive definite matrices, (nnz, count)."""
    rows = [np.arange(j, min(j + band + 1, n)) for j in range(n)]
    indptr = np.r_[0, np.cumsum([len(r) for r in rows])]
    pattern = Pattern(n, indptr, np.concatenate(rows))
    values = np.random.default_rng(seed).standard_normal((pattern.nnz, count))
    values[indptr[:-1]] += 4.0 * band + 6.0
    return pattern, values


def dense(pattern, values):
    out = np.zeros((pattern.size, pattern.size))
    out[pattern.indices, pattern.columns] = values
    return out + np.tril(out, -1).T


@pytest.mark.parametrize(("n", "band"), [(60, 7), (61, 10), (5, 4), (40, 1), (96, 50)])
def test_factorisation_solves(n, band):
    pattern, values = banded(n, band, 3)
    order = np.random.default_rng(0).permutation(pattern.nnz)
    blocks = cholesky.divide(pattern)
    solver = cholesky.BlockBanded(pattern, order, blocks, CPU)
    rhs = np.random.default_rng(1).standard_normal((n, 3))
    for _ in range(2):
        assert not solver.factor(torch.as_tensor(values[order])).any()
        x = solver.solve(torch.as_tensor(rhs)).numpy()
        for k in range(3):
            np.testing.assert_allclose(dense(pattern, values[:, k]) @ x[:, k], rhs[:, k], atol=1e-9)


def test_only_indefinite_matrices_are_damped():
    pattern, values = banded(48, 6, 5)
    diagonal = pattern.indptr[:-1]
    values[diagonal[17], 1] = -30.0
    solver = cholesky.BlockBanded(pattern, np.arange(pattern.nnz), cholesky.divide(pattern), CPU)
    assert solver.factor(torch.as_tensor(values)).tolist() == [False, True, False]
    gradient = torch.as_tensor(np.random.default_rng(2).standard_normal((48, 3)))
    found = batch_steps.direction(
        solver,
        torch.as_tensor(values.copy()),
        torch.as_tensor(diagonal),
        gradient,
        torch.full((3,), 1e-9, dtype=torch.float64),
    )
    for k in (0, 2):
        exact = -np.linalg.solve(dense(pattern, values[:, k]), gradient[:, k].numpy())
        np.testing.assert_allclose(found[:, k], exact, rtol=1e-6)
    own = np.ascontiguousarray(values[:, 1])
    solver = linalg.find("banded").Solver(pattern)
    wanted = GaussNewton().step(solver, own, diagonal, gradient[:, 1].numpy())
    np.testing.assert_allclose(found[:, 1], wanted, rtol=1e-8)


def test_a_hopeless_matrix_gives_the_gradient():
    pattern, values = banded(24, 3, 5, 1)
    values[:] = 0.0
    values[pattern.indptr[:-1]] = -1.0
    values[0] = 1e-12
    solver = cholesky.BlockBanded(pattern, np.arange(pattern.nnz), cholesky.divide(pattern), CPU)
    gradient = torch.ones(24, 1, dtype=torch.float64)
    found = batch_steps.direction(
        solver,
        torch.as_tensor(values),
        torch.as_tensor(pattern.indptr[:-1]),
        gradient,
        torch.zeros(1, dtype=torch.float64),
    )
    assert (found < 0).all()
    assert float(found.std()) == 0.0


def energies(results):
    return [sum(r.energy.values()) for r in results]


@pytest.fixture(scope="module")
def batch(designs):
    """Results of the designs in one batch of this process, by the task."""
    return cache(lambda task: gso.tno.optimize_batch(designs, task=task, workers=0))


@pytest.fixture(scope="module")
def single(designs):
    """Results of single solves, by the number of the design; each is made once."""
    return cache(lambda k, **asked: gso.tno.optimize(designs[k], verdict=False, **asked))


@pytest.mark.parametrize(
    ("task", "options"),
    [
        ("developable", "balanced"),
        ("developable", "fast"),
        pytest.param("developable", "accurate", marks=pytest.mark.slow),
        ("flatten", "balanced"),
        pytest.param("flatten", "accurate", marks=pytest.mark.slow),
    ],
)
def test_results_are_those_of_single_solves(task, options, designs, batch, single):
    if options == "balanced":
        results = batch(task)
    else:
        few = designs[:2] if options == "accurate" else designs
        results = gso.tno.optimize_batch(few, task=task, options=options, workers=0)
    for k, found in enumerate(results):
        one = single(k, task=task, options=options)
        assert found.status is one.status
        assert found.iterations == one.iterations
        assert sum(found.energy.values()) == pytest.approx(sum(one.energy.values()), rel=1e-6)
        assert found.energy.keys() == one.energy.keys()
        assert len(found.history) == len(one.history)
        assert found.history[0].energy == pytest.approx(one.history[0].energy, rel=1e-9)
        assert found.history[-1].name == one.history[-1].name
        shape = "flat" if task == "flatten" else "mesh"
        a, b = (getattr(r, shape) for r in (found, one))
        a, b = (x.vertices if shape == "mesh" else x for x in (a, b))
        np.testing.assert_allclose(a, b, atol=1e-4)
        assert found.seconds["total"] > 0
        assert "cpu" in found.backend


@pytest.mark.parametrize("task", ["developable", "flatten"])
def test_a_result_does_not_depend_on_the_batch(task, designs, batch):
    together = batch(task)
    for order in ([2], [3, 2], [2, 0, 1]):
        other = gso.tno.optimize_batch(designs[order], task=task, workers=0)
        np.testing.assert_allclose(
            energies(other), [energies(together)[k] for k in order], rtol=1e-9
        )


def test_units_and_positions_do_not_matter(designs, batch):
    scales = np.array([1.0, 1000.0, 1e-3, 7.0])[:, None, None, None]
    moved = gso.tno.optimize_batch(scales * designs + 50.0 * scales, workers=0)
    np.testing.assert_allclose(energies(moved), energies(batch("developable")), rtol=1e-6)


def tube(n=SIZE):
    """A cylinder that nearly closes: it meets itself along a seam of the grid."""
    t = np.linspace(0.0, 2.0 * np.pi, n)
    return np.stack(
        np.broadcast_arrays(np.cos(t)[:, None], np.sin(t)[:, None], np.linspace(0, 2, n)), -1
    )


def odd_ones(n=SIZE):
    flat = np.dstack([*np.mgrid[:n, :n] / (n - 1.0), np.zeros((n, n))])
    noisy = cylinder(n) + 1e-3 * np.random.default_rng(0).standard_normal((n, n, 3))
    pole = saddle(n)
    pole[0] = pole[0].mean(axis=0)
    return {"flat": flat, "noisy": noisy, "pole": pole, "tube": tube(n), "bump": bump(n, 3.0)}


@pytest.mark.parametrize("task", ["developable", "flatten"])
def test_surfaces_with_other_stages_are_solved_too(task, designs):
    some = np.stack([designs[0], *odd_ones().values(), designs[1]])
    for design, found in zip(some, gso.tno.optimize_batch(some, task=task, workers=0), strict=True):
        one = gso.tno.optimize(design, task=task, verdict=False)
        assert found.status is one.status
        assert (found.pattern is None) == (one.pattern is None)
        assert sum(found.energy.values()) == pytest.approx(
            sum(one.energy.values()), rel=1e-3, abs=1e-12
        )
        assert found.notes == one.notes


@pytest.mark.parametrize(("height", "width"), [(5, 4), (21, 40), (40, 21), (3, 3)])
def test_other_shapes_of_grids(height, width):
    some = np.stack([saddle(height, width, s) for s in (0.3, 0.5)])
    for task in ("developable", "flatten"):
        found = energies(gso.tno.optimize_batch(some, task=task, workers=0))
        wanted = energies([gso.tno.optimize(p, task=task, verdict=False) for p in some])
        np.testing.assert_allclose(found, wanted, rtol=1e-6)


def test_other_unknowns_and_methods(designs):
    some = designs[:2]
    for options in (
        gso.DevelopableOptions(variables="spline"),
        gso.DevelopableOptions(variables="surface"),
        gso.DevelopableOptions(method="gauss-newton"),
        gso.DevelopableOptions(iterations=0, coarse_iterations=1),
    ):
        found = energies(gso.tno.optimize_batch(some, options=options, workers=0))
        wanted = energies([gso.tno.optimize(p, options=options, verdict=False) for p in some])
        np.testing.assert_allclose(found, wanted, rtol=1e-5)


@pytest.mark.parametrize("changed", [{"norm": "l1"}, {"norm": "l2"}, {"w_fairness": 1e-4}])
@pytest.mark.parametrize("formulation", ["strain", "lengths"])
def test_other_norms(formulation, changed, designs):
    asked = {"task": "flatten", "formulation": formulation}
    asked["options"] = gso.FlattenOptions(**changed)
    found = energies(gso.tno.optimize_batch(designs[:2], workers=0, **asked))
    wanted = energies([gso.tno.optimize(p, verdict=False, **asked) for p in designs[:2]])
    np.testing.assert_allclose(found, wanted, rtol=1e-5)


def test_verdict(designs):
    far, found = gso.tno.optimize_batch(designs[:2], workers=0, verdict=True)
    one = gso.tno.optimize(designs[1])
    assert (found.usable, codes(found.reasons)) == (one.usable, codes(one.reasons)) == (True, [])
    # Batches do not solve again within a distance, as a single solve does.
    assert (far.usable, codes(far.reasons)) == (False, [Code.FAR])
    assert gso.tno.optimize(designs[0]).usable
    assert found.pattern is not None
    assert far.pattern is not None


@pytest.mark.slow
def test_worker_processes_give_the_same(designs):
    some = np.concatenate([designs, 1.5 * designs, designs[:1]])
    here = gso.tno.optimize_batch(some, task="flatten", workers=0)
    spread = gso.tno.optimize_batch(some, task="flatten", workers=2)
    np.testing.assert_allclose(energies(spread), energies(here), rtol=1e-9)


def test_an_empty_batch():
    assert gso.tno.optimize_batch(np.zeros((0, 9, 9, 3))) == []


def test_tensors_are_taken(designs):
    found = gso.tno.optimize_batch(torch.as_tensor(designs[:1]), task="flatten", workers=0)
    assert found[0].flat.shape == (SIZE * SIZE, 2)


class TestRefused:
    def test_one_surface(self, designs):
        with pytest.raises(
            gso.MeshError, match=r"batch of grids \(B, H, W, 3\), not \(33, 33, 3\)"
        ):
            gso.tno.optimize_batch(designs[0])

    def test_different_sizes(self):
        with pytest.raises(gso.MeshError, match=r"surface 2 has shape \(5, 6, 3\) and surface 0"):
            gso.tno.optimize_batch([saddle(5), saddle(5), saddle(5, 6)])

    def test_no_numbers(self):
        with pytest.raises(gso.MeshError, match="array of numbers"):
            gso.tno.optimize_batch("panel.obj")

    def test_not_finite(self, designs):
        bad = designs.copy()
        bad[2, 3, 4] = np.nan
        with pytest.raises(gso.MeshError, match=r"surface 2: grid vertex \(3, 4\) is not finite"):
            gso.tno.optimize_batch(bad)

    def test_a_surface_without_extent(self, designs):
        bad = designs.copy()
        bad[1] = 0.5
        with pytest.raises(gso.MeshError, match="surface 1: "):
            gso.tno.optimize_batch(bad, workers=0)

    def test_grids_without_a_solve(self):
        with pytest.raises(gso.MeshError, match="surface 0: "):
            gso.tno.optimize_batch(np.zeros((1, 2, 2, 3)), workers=0)

    @pytest.mark.parametrize(
        "what",
        [
            {"task": "denoise"},
            {"task": "developable", "formulation": "isometry"},
            {"task": "developable", "options": "jiang2020"},
            {"task": "developable", "formulation": "ruled"},
            {"task": "flatten", "formulation": "minimax"},
            {"task": "bend"},
        ],
    )
    def test_what_has_no_batched_solve(self, what, designs):
        with pytest.raises(gso.OptionError, match=r"not solved in batches.*optimize_many"):
            gso.tno.optimize_batch(designs, **what)

    def test_unknown_device(self, designs):
        with pytest.raises(gso.OptionError, match="device 'quantum' cannot be used"):
            gso.tno.optimize_batch(designs, device="quantum")

    @pytest.mark.skipif(torch.cuda.is_available(), reason="CUDA is there")
    def test_a_device_that_is_not_there(self, designs):
        with pytest.raises(gso.OptionError, match="device 'cuda' cannot be used"):
            gso.tno.optimize_batch(designs, device="cuda")


def test_without_torch():
    code = (
        "import importlib.util as u; real = u.find_spec\n"
        "u.find_spec = lambda name, *a: None if name == 'torch' else real(name, *a)\n"
        "import gso\n"
        "try: gso.tno.optimize_batch\n"
        "except gso.BackendError as error: print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert 'need torch: pip install ".[net]"' in done.stdout


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs CUDA")
@pytest.mark.parametrize("task", ["developable", "flatten"])
def test_on_a_graphics_processor(task, designs):
    there = gso.tno.optimize_batch(designs, task=task, device="cuda")
    again = gso.tno.optimize_batch(designs, task=task, device="cuda")
    here = gso.tno.optimize_batch(designs, task=task, workers=0)
    np.testing.assert_allclose(energies(there), energies(here), rtol=1e-5)
    np.testing.assert_allclose(energies(there), energies(again), rtol=1e-12)
    assert "cuda" in there[0].backend


def test_unknowns_that_cannot_be_stacked(designs):
    plans = [
        planned("developable", p, options=gso.DevelopableOptions(variables="spline"))
        for p in designs[:2]
    ]
    own = [plan.stages[-1] for plan in plans]
    with pytest.raises(Unbatchable):
        gather(own, [p.reshape(-1) for p in designs[:2]], "gauss-newton")


def test_a_batch_is_halved_where_memory_is_short(designs, monkeypatch):
    real, sizes = device._solve, []

    def small(parts, *given):
        sizes.append(sum(map(len, parts)))
        if sizes[-1] > 1:
            raise torch.cuda.OutOfMemoryError
        return real(parts, *given)

    wanted = gso.tno.optimize_batch(designs[:3], task="flatten", workers=0)
    monkeypatch.setattr(device, "_solve", small)
    found = gso.tno.optimize_batch(designs[:3], task="flatten", workers=0)
    # Flattening has two stages.
    assert sizes == [3, 1, 1, 2, 1, 1, 1, 1]
    np.testing.assert_allclose(energies(found), energies(wanted), rtol=1e-9)


@pytest.fixture(scope="module")
def processes():
    """With a device two of them plan at a time."""
    with ProcessExecutor(3) as ready:
        yield ready


def on_cpu(parts):
    return device.solve(parts, "cpu")


def by_workers(processes, some, task, together=on_cpu, most=100):
    found = {}
    work = partial(solve_batch, check_batch(task), minimise=minimise_elsewhere)
    with DeviceExecutor(processes, together, most=most, enough=1.0) as ready:
        for done in ready.as_completed(work, list(some[:, None])):
            assert done.error is None
            found[done.index] = done.result[0]
    return [found[k] for k in range(len(some))]


def counting(sizes, most=100):
    """A device that has memory for so many surfaces, and tells how many it was given."""

    def together(parts):
        sizes.append(sum(map(len, parts)))
        if sizes[-1] > most:
            raise TooLarge
        return on_cpu(parts)

    return together


@pytest.mark.parametrize("task", ["developable", "flatten"])
def test_workers_plan_and_this_process_minimises(task, designs, processes):
    some = np.concatenate([designs, 1.5 * designs[:1], [odd_ones()["flat"]]])
    sizes = []
    wanted = gso.tno.optimize_batch(some, task=task, workers=0)
    for _ in range(2):
        found = by_workers(processes, some, task, counting(sizes))
        np.testing.assert_allclose(energies(found), energies(wanted), rtol=1e-6, atol=1e-18)
        assert [f.status for f in found] == [w.status for w in wanted]
    assert max(sizes) >= 2


def test_workers_share_a_device_with_little_memory(designs, processes, batch):
    sizes = []
    found = by_workers(processes, designs, "flatten", counting(sizes, 1))
    assert max(sizes) > 1
    np.testing.assert_allclose(energies(found), energies(batch("flatten")), rtol=1e-6)


def test_most_surfaces_of_a_device(designs, processes):
    sizes = []
    by_workers(processes, designs, "flatten", counting(sizes), most=1)
    assert max(sizes) == 1


def test_a_worker_that_dies_loses_nothing(designs, processes, batch):
    killed = []

    def together(parts):
        if not killed:
            killed.append(next(iter(processes._processes.values())))
            killed[0].kill()
            killed[0].join()
        return on_cpu(parts)

    found = by_workers(processes, designs, "flatten", together)
    np.testing.assert_allclose(energies(found), energies(batch("flatten")), rtol=1e-6)


def test_workers_are_ready_after_an_error(designs, processes):
    def broken(parts):
        raise RuntimeError("the device is gone")

    with pytest.raises(RuntimeError, match="the device is gone"):
        by_workers(processes, designs, "flatten", broken)
    assert len(by_workers(processes, designs[:1], "flatten")) == 1


def test_workers_are_ready_after_results_that_nobody_wanted(designs, processes):
    work = partial(solve_batch, check_batch("flatten"), minimise=minimise_elsewhere)
    with DeviceExecutor(processes, on_cpu) as ready:
        some = ready.as_completed(work, list(designs[:, None]))
        next(some)
        some.close()
    assert len(by_workers(processes, designs[:1], "flatten")) == 1


def test_an_executor_that_is_closed(designs):
    ready = ProcessExecutor(1)
    ready.shutdown()
    for there in ("cpu", "cuda"):
        with pytest.raises(gso.OptionError, match="closed"):
            list(solve_all(check_batch("flatten", device=there), list(designs), executor=ready))


def test_an_executor_without_processes_of_this_machine(designs):
    with pytest.raises(gso.OptionError, match="give a ProcessExecutor"):
        list(solve_all(check_batch("flatten", device="cuda"), list(designs), executor=SERIAL))


@pytest.mark.parametrize("count", [-1, 1.5, "two"])
def test_a_number_of_workers_that_cannot_be(count, designs):
    with pytest.raises(gso.OptionError, match="whole number of 0 or more"):
        gso.tno.optimize_batch(designs, workers=count)


def test_workers_of_a_processor_stay_for_the_next_batch(designs, processes, batch):
    wanted = batch("flatten")
    before = set()
    for _ in range(2):
        found = gso.tno.optimize_batch(designs, task="flatten", executor=processes)
        np.testing.assert_allclose(energies(found), energies(wanted), rtol=1e-9)
        now = {process.pid for process in processes._processes.values()}
        assert before <= now
        before = now


@pytest.fixture
def graphics(monkeypatch):
    """A graphics processor that is this one; the parts that it was given."""
    real, sizes = device.solve, []

    def solve(parts, device):
        if device == "cuda":
            sizes.append(sum(map(len, parts)))
        return real(parts, "cpu")

    monkeypatch.setattr(device, "solve", solve)
    monkeypatch.setattr(device, "check_device", lambda name: None)
    return sizes


@pytest.mark.parametrize("workers", [0, 1, "ready"])
def test_on_a_device(workers, designs, graphics, processes, batch):
    own = {"executor": processes} if workers == "ready" else {"workers": workers}
    found = gso.tno.optimize_batch(designs, task="flatten", device="cuda", **own)
    np.testing.assert_allclose(energies(found), energies(batch("flatten")), rtol=1e-6)
    assert max(graphics) > 1
    assert "cuda" in found[0].backend


def test_large_grids_are_planned_one_by_one(designs, graphics, processes, monkeypatch):
    monkeypatch.setattr("gso.tno.batched.many._VERTICES", SIZE * SIZE)
    monkeypatch.setattr("gso.tno.batched.many._MOST", 2 * SIZE * SIZE)
    gso.tno.optimize_batch(designs, task="flatten", device="cuda", executor=processes)
    assert max(graphics) <= 2


def test_what_fails_in_a_batch_is_solved_alone(designs, single, monkeypatch):
    def fail(*given):
        raise gso.MeshError("some surface has no image")

    monkeypatch.setattr("gso.tno.batched.stage_groups.solve", fail)
    found = gso.tno.optimize_batch(designs[:2], task="flatten", workers=0)
    assert [one.backend for one in found] == [
        single(k, task="flatten", options="balanced").backend for k in range(2)
    ]


def test_solved_yields_errors_in_place(designs):
    bad = designs.copy()
    bad[1] = 0.5
    found = list(solve_all(check_batch("flatten"), bad))
    assert [isinstance(one, gso.MeshError) for one in found] == [False, True, False, False]

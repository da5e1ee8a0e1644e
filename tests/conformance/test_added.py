"""What is added from outside the package works like its own, without a change to the package."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import numpy as np
import pytest

import gso
from gso import energy, io, linalg, tasks, unknowns
from gso.energy import Term, Weighted
from gso.geometry import sub
from gso.io import Surface
from gso.tasks import Formulation, Plan, Stage, Task
from gso.unknowns import Layout
from tests.conftest import saddle


def module(name, **members):
    made = ModuleType(name)
    made.__dict__.update(members)
    return made


@pytest.fixture
def added():
    """Register modules, and remove them and tasks after the test."""
    registries = {"term": energy._MODULES, "backend": linalg._MODULES}

    def add(kind, name, **members):
        registries[kind].add(name, module(name, **members))

    yield add
    for registry in registries.values():
        registry._added.clear()
    tasks._ADDED.clear()


def to_origin(points, constants):
    return sub(points[0], (0.0, 0.0, 0.0))


def origin_term(mesh):
    ids = np.arange(len(mesh.vertices))[:, None]
    return Term("origin", to_origin, (("surface", ids),), np.full(len(ids), 1.0 / len(ids)))


def near(points, constants):
    return sub(points[0], tuple(constants))


def shrink(analysis, request):
    """Plan to move every vertex half way to the centroid."""
    mesh = analysis.mesh
    layout = Layout.of(len(mesh.vertices), "surface")
    ids = np.arange(len(mesh.vertices))[:, None]
    stay = Term(
        "near", near, (("surface", ids),), np.full(len(ids), 1.0 / len(ids)), mesh.vertices.T.copy()
    )
    items = [Weighted(stay, 1.0), Weighted(origin_term(mesh), 1.0)]
    stage = Stage(
        "shrink", layout, items, lambda _: unknowns.free(layout), imposed=analysis.imposed
    )
    return Plan(layout, mesh.vertices.ravel(), [stage])


def test_a_term(added):
    added("term", "origin", residual=to_origin)
    assert energy.registry()["origin"].residual is to_origin


def test_a_task(added):
    half = Formulation(gso.DenoiseOptions, shrink)
    task = Task({"half": half}, lambda before, after, flat, scale: {"displacement_rms": 1.0})
    tasks.add("shrink", task)
    assert "shrink" in tasks.names()
    points = saddle(7)
    result = gso.tno.optimize(points, task="shrink", verdict=False)
    centre = points.reshape(-1, 3).mean(axis=0)
    np.testing.assert_allclose(result.grid - centre, 0.5 * (points - centre), atol=1e-9)
    assert result.metrics == {"displacement_rms": 1.0}
    held = gso.tno.optimize(points, task="shrink", constraints=[gso.Fixed([0])], verdict=False)
    np.testing.assert_allclose(held.mesh.vertices[0], points[0, 0])
    with pytest.raises(gso.OptionError, match="shrink"):
        tasks.add("shrink", task)


def test_a_backend(added):
    own = linalg.find("superlu")

    class Mine(own.Solver):
        made = 0

        def __init__(self, pattern):
            super().__init__(pattern)
            Mine.made += 1

    members = {"PACKAGE": "scipy", "available": own.available, "cost": own.cost}
    added("backend", "mine", Solver=Mine, **members)
    ours, plain = (
        gso.tno.optimize(saddle(9), options=gso.DevelopableOptions(backend=name))
        for name in ("mine", "superlu")
    )
    assert Mine.made > 0
    np.testing.assert_allclose(ours.mesh.vertices, plain.mesh.vertices, atol=1e-12)


def test_a_constraint_in_a_file(tmp_path):
    @dataclass(frozen=True)
    class Centre(gso.constraints.Constraint):
        def parts(self, subject):
            return gso.Fixed([len(subject.mesh.vertices) // 2]).parts(subject)

    gso.constraints.add(Centre)
    try:
        (tmp_path / "constraints.json").write_text('[{"type": "Centre"}]')
        (read,) = gso.constraints.read_constraints(tmp_path / "constraints.json")
        points = saddle(7)
        result = gso.tno.optimize(points, constraints=[read])
        np.testing.assert_allclose(result.grid[3, 3], points[3, 3], atol=1e-12)
        with pytest.raises(gso.OptionError, match="Centre"):
            gso.constraints.add(Centre)
    finally:
        gso.constraints.read._ADDED.remove(Centre)


@pytest.fixture
def lifted():
    """Register a task of nets that lifts surfaces, and a kind of nets that learns how far."""
    torch = pytest.importorskip("torch")
    from gso.net import tasks as net_tasks
    from gso.net.models import Net
    from gso.net.training import Batch

    class Lift(Net):
        def __init__(self, task="lift"):
            super().__init__(task)
            self.height = torch.nn.Parameter(torch.zeros(1))

        def displacements(self, surface, sigma=None, *, passes=None):
            up = torch.tensor([0.0, 0.0, 1.0], device=surface.device)
            return (self.height * up).expand(surface.shape)

        def displacements_at(self, surface, fine, sigma=None, *, passes=None):
            return self.displacements(fine)

    def energy(batch: Batch, phase, progress):
        return lambda result: (result - batch.surface)[..., 2].sub(0.5).square().mean(dim=(1, 2))

    gso.net.add_task(
        gso.net.tasks.NetTask(
            name="lift",
            components=3,
            default="lift",
            score="miss",
            figures=lambda design, result: {
                "miss": float(abs((result - design)[..., 2].mean() - 0.5))
            },
            terms=("in",),
            energy=energy,
        )
    )
    gso.net.add_kind("lift", Lift)
    yield Lift
    net_tasks._ADDED.clear()
    gso.net.KINDS.pop("lift")


def test_a_task_and_a_kind_of_nets(lifted, tmp_path):
    import torch

    from gso.net.models import normalise
    from gso.net.training import Batch, Objective, from_dict

    config = from_dict(
        {"task": "lift", "model": {"kind": "lift"}, "phase": [{"loss": "energy", "rate": 0.1}]}
    )
    assert config.task == "lift"
    net = lifted()
    surfaces = normalise(torch.tensor(np.stack([saddle(64)]), dtype=torch.float32))
    optimiser = torch.optim.SGD(net.parameters(), 0.5)
    for _ in range(20):
        optimiser.zero_grad()
        Objective(net)(Batch(surfaces), config.phases[0], 0.0)[0].backward()
        optimiser.step()
    gso.net.save(net, tmp_path / "lift.safetensors")
    design = surfaces[0].double().numpy()
    result = gso.net.predict(design, task="lift", model=tmp_path / "lift.safetensors")
    moved = gso.net.predict(design, task="lift", model=net)
    np.testing.assert_allclose(result, moved, atol=1e-3)
    assert gso.net.tasks.get("lift").figures(design, result)["miss"] < 0.01
    with pytest.raises(gso.OptionError, match="lift"):
        gso.net.add_kind("lift", lifted)


def test_a_format(tmp_path):
    def read(data):
        return Surface(np.frombuffer(data).reshape(-1, 3), np.array([[0, 1, 2, 3]]))

    def write(mesh, file):
        file.write(mesh.vertices.tobytes())

    with pytest.raises(gso.OptionError, match="obj"):
        io.add_format(".obj", module("raw"))
    io.add_format(".raw", module("raw", read=read, write=write))
    try:
        square = gso.Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), [[0, 1, 2, 3]])
        gso.save(square, tmp_path / "square.raw")
        np.testing.assert_array_equal(gso.load(tmp_path / "square.raw").vertices, square.vertices)
    finally:
        io._FORMATS.pop(".raw")

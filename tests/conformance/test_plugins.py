"""What installed packages offer by entry points is found by name, and loaded at first use."""

from __future__ import annotations

import subprocess
import sys
import textwrap
import warnings

import numpy as np
import pytest

import gso
from gso import energy, io, linalg, tasks
from tests.conftest import saddle

TERMS = """
from gso.energy import Term, mean_weights
from gso.geometry import sub
import numpy as np

def residual(points, constants):
    return sub(points[0], (0.0, 0.0, 0.0))

def build(mesh):
    ids = np.arange(len(mesh.vertices))[:, None]
    return Term("shrink", residual, (("surface", ids),), mean_weights(len(ids)))
"""
TASK = """
from gso import Options, unknowns
from gso.energy import Weighted
from gso.tasks import Formulation, Plan, Stage, Task
from gso.unknowns import Layout
from dataclasses import dataclass
from offered import terms

@dataclass(frozen=True)
class Own(Options):
    PRESETS = {"fast": {}, "balanced": {}, "accurate": {}}

def plan(analysis, request):
    layout = Layout.of(len(analysis.mesh.vertices), "surface")
    items = [Weighted(terms.build(analysis.mesh), 1.0)]
    stage = Stage("shrink", layout, items, lambda _: unknowns.free(layout))
    return Plan(layout, analysis.mesh.vertices.ravel(), [stage])

TASK = Task({"whole": Formulation(Own, plan)}, lambda *_: {"displacement_rms": 1.0})
"""
BACKEND = """
from gso import linalg
own = linalg.find("superlu")
available, cost, PACKAGE = own.available, own.cost, "scipy"

class Solver(own.Solver):
    name = "mine"
"""
FORMAT = """
import numpy as np
from gso.io import Surface

def read(data):
    return Surface(np.frombuffer(data).reshape(-1, 3), np.array([[0, 1, 2, 3]]))

def write(mesh, file):
    file.write(mesh.vertices.tobytes())
"""
NETS = """
import torch
from gso.net.models import Net
from gso.net.tasks import NetTask

class Lift(Net):
    def __init__(self, task="lift"):
        super().__init__(task)
        self.height = torch.nn.Parameter(torch.ones(1))

    def displacements(self, surface, sigma=None, *, passes=None):
        return self.height * torch.ones_like(surface)

TASK = NetTask(
    name="lift", components=3, default="lift", score="miss", terms=("in",),
    figures=lambda design, result: {"miss": 0.0},
)
"""
POINTS = """
[gso.terms]
shrinking = offered.terms
[gso.tasks]
shrink = offered.task:TASK
[gso.backends]
mine = offered.backend
[gso.formats]
raw = offered.raw
[gso.net.kinds]
lift = offered.nets:Lift
[gso.net.tasks]
lift = offered.nets:TASK
"""


def made(folder, package, modules, points):
    """A distribution as it lies in a folder of installed packages."""
    (folder / package).mkdir()
    for name, text in {"__init__": "", **modules}.items():
        (folder / package / f"{name}.py").write_text(text)
    info = folder / f"{package}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(points)


@pytest.fixture
def offered(tmp_path, monkeypatch):
    modules = {"terms": TERMS, "task": TASK, "backend": BACKEND, "raw": FORMAT, "nets": NETS}
    made(tmp_path, "offered", modules, POINTS)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield tmp_path
    for name in [n for n in sys.modules if n.partition(".")[0] == "offered"]:
        del sys.modules[name]


def test_names_are_known_without_loading(offered):
    assert "shrink" in tasks.names() and ".raw" in io.suffixes()
    assert not any(name.partition(".")[0] == "offered" for name in sys.modules)


def test_a_term(offered):
    assert energy.registry()["shrinking"].build(gso.Mesh.from_grid(saddle(4))).name == "shrink"


def test_a_task(offered):
    result = gso.tno.optimize(saddle(5), task="shrink", verdict=False)
    points = result.mesh.vertices
    np.testing.assert_allclose(
        points, np.broadcast_to(points.mean(axis=0), points.shape), atol=1e-9
    )


def test_a_backend(offered):
    options = gso.DevelopableOptions(backend="mine")
    assert gso.tno.optimize(saddle(5), options=options, verdict=False).backend == "mine"
    assert "mine" in linalg.backends()


def test_a_format(offered, tmp_path):
    square = gso.Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), [[0, 1, 2, 3]])
    gso.save(square, tmp_path / "square.raw")
    np.testing.assert_array_equal(gso.load(tmp_path / "square.raw").vertices, square.vertices)
    with pytest.raises(gso.OptionError, match="taken"):
        io.add_format(".raw", sys.modules[__name__])


def test_a_kind_and_a_task_of_nets(offered, tmp_path):
    pytest.importorskip("torch")
    from gso.net import kind_of, load, make, predict, save

    net = make({"kind": "lift", "task": "lift"})
    assert kind_of(net) == "lift"
    save(net, tmp_path / "lift.safetensors")
    again = load(tmp_path / "lift.safetensors")
    assert type(again) is type(net)
    unit = saddle(64)
    assert not np.allclose(predict(unit, task="lift", model=again), unit)


def test_the_command_line_sees_them(offered, tmp_path):
    gso.save(saddle(5), tmp_path / "saddle.obj")
    code = "import sys; sys.path.insert(0, sys.argv.pop(1)); from gso.cli import main; main()"
    words = ["optimize", "saddle.obj", "--task", "shrink", "-o", "out.npz", "--quiet"]
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path), *words],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=False,
    )
    assert (tmp_path / "out.npz").exists(), done.stderr


def test_a_broken_plug_in_is_left_out_with_a_warning(tmp_path, monkeypatch):
    broken = {"nothing": "raise RuntimeError('no licence')", "empty": ""}
    points = """
    [gso.tasks]
    spoilt = spoiling.nothing
    [gso.terms]
    spoilt = spoiling.empty
    [gso.backends]
    spoilt = spoiling.missing
    [gso.formats]
    spoilt = spoiling.nothing
    [gso.net.tasks]
    spoilt = spoiling.nothing
    """
    made(tmp_path, "spoiling", broken, textwrap.dedent(points))
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.warns(UserWarning, match="'spoilt' of spoiling .*gso.terms.*no residual, build"):
        assert "spoilt" not in energy.registry()
    with pytest.warns(UserWarning, match=r"'spoilt' of spoiling .*uninstall spoiling"):
        assert "spoilt" not in linalg.backends()
    with (
        pytest.warns(UserWarning, match="RuntimeError: no licence"),
        pytest.raises(gso.OptionError, match="no task 'spoilt'"),
    ):
        gso.tno.optimize(saddle(5), task="spoilt")
    with pytest.warns(UserWarning, match="spoiling"):
        assert "developable" in gso.net.tasks.names()
    (tmp_path / "a.spoilt").write_text("x")
    with pytest.warns(UserWarning), pytest.raises(gso.MeshError, match="cannot be used"):
        gso.load(tmp_path / "a.spoilt")
    with warnings.catch_warnings():
        # It is said once.
        warnings.simplefilter("error")
        assert "spoilt" not in tasks.names() and "spoilt" not in energy.registry()
        gso.tno.optimize(saddle(5), options="fast", verdict=False)


def test_names_of_the_package_stay_its_own(tmp_path, monkeypatch):
    made(tmp_path, "clashing", {"task": "TASK = 3"}, "[gso.tasks]\nflatten = clashing.task:TASK\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert tasks.get("flatten").flat
    assert tasks._PLUGINS.names() == ["flatten"]

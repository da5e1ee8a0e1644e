"""Compiled loops: the same numbers as NumPy on every term; the cache; without Numba."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from dataclasses import dataclass

import numpy as np
import pytest

import gso
from gso import unknowns
from gso.energy import Absolute, Distance, Squared, Weighted, registry
from gso.mesh import vertex_normals
from gso.solver import Problem, loops
from gso.unknowns import Layout, normal_offsets
from tests.conformance.term_examples import examples
from tests.conftest import meshes
from tests.test_pieces import dome

pytest.importorskip("numba")

MESHES = meshes()
CASES = [
    pytest.param(kind, term, id=f"{name}-{kind}-{k}")
    for name in registry()
    for kind, mesh in MESHES.items()
    for k, term in enumerate(examples(name, mesh))
    if all(block == "surface" for block, _ in term.stencil)
]


def forget_loops():
    loops._residual_loop.cache_clear()
    loops._stiffness_loop.cache_clear()


@pytest.fixture(autouse=True)
def choice(monkeypatch):
    monkeypatch.setenv(loops.VARIABLE, "numba")
    yield
    forget_loops()
    for cached in (loops._adder, loops._installed):
        cached.cache_clear()


@dataclass(frozen=True)
class Cubic:
    """A loss of a user."""

    def value(self, r):
        return np.abs(r) ** 3 / 3.0

    def weights(self, r):
        return r * np.abs(r), 2.0 * np.abs(r)


def both(problem, x, monkeypatch):
    """Energies, gradients and matrices of compiled loops and of NumPy."""
    out = []
    for how in ("numba", "numpy"):
        monkeypatch.setenv(loops.VARIABLE, how)
        out.append((problem.energy(x), *problem.linearise(x)))
    return out


def compared(problem, x, monkeypatch):
    ours, numpy = both(problem, x, monkeypatch)
    for one, two in zip(ours, numpy, strict=True):
        size = np.abs(two).max(initial=0.0)
        np.testing.assert_allclose(one, two, rtol=1e-10, atol=1e-12 * (size + 1e-300))


@pytest.mark.parametrize("loss", [Squared(), Absolute(0.1), Distance(0.1), Cubic()])
@pytest.mark.parametrize(("kind", "term"), CASES[::7])
def test_losses_agree(kind, term, loss, monkeypatch):
    check(kind, term, loss, monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "term"), CASES)
def test_every_term_agrees(kind, term, monkeypatch):
    check(kind, term, Absolute(0.05), monkeypatch)


def check(kind, term, loss, monkeypatch):
    mesh = MESHES[kind]
    rng = np.random.default_rng(0)
    points = mesh.vertices + 0.03 * rng.standard_normal(mesh.vertices.shape)
    layout = Layout.of(len(points), "surface")
    item = Weighted(term, 2.0, loss)
    problem = Problem([item], unknowns.free(layout))
    compared(problem, points.ravel(), monkeypatch)
    # Coordinates that are sums of unknowns.
    normals = vertex_normals(mesh) + 0.1 * rng.standard_normal(points.shape)
    offsets = normal_offsets(layout, points, normals)
    problem = Problem([item], offsets)
    compared(problem, 0.01 * rng.standard_normal(offsets.size), monkeypatch)


@pytest.mark.parametrize("task", ["developable", "flatten", "denoise"])
def test_solves_agree(task, monkeypatch):
    results = []
    for how in ("numba", "numpy"):
        monkeypatch.setenv(loops.VARIABLE, how)
        results.append(gso.tno.optimize(dome(17), task=task, verdict=False))
    one, two = results
    energies = [sum(r.energy.values()) for r in results]
    assert energies[0] == pytest.approx(energies[1], rel=1e-6)
    np.testing.assert_allclose(one.mesh.vertices, two.mesh.vertices, atol=1e-5)


def test_numpy_does_the_work_where_numba_is_missing(monkeypatch):
    loops._installed.cache_clear()
    monkeypatch.setattr(loops, "find_spec", lambda name: None)
    assert loops.residual(registry()["curvature"].residual, (3,) * 7, 0, 10**6) is None
    assert gso.tno.optimize(dome(9), verdict=False).mesh.vertices.shape == (81, 3)


def test_numpy_does_the_work_where_numba_fails(monkeypatch, caplog):
    def fail(source):
        raise RuntimeError("no compiler")

    forget_loops()
    monkeypatch.setattr(loops, "compile_source", fail)
    with caplog.at_level(logging.WARNING, "gso"):
        result = gso.tno.optimize(dome(9), verdict=False)
    assert np.isfinite(result.mesh.vertices).all()
    assert "no compiler" in caplog.text


def test_small_meshes_do_not_load_numba():
    code = "import sys, numpy as np, gso; u, v = np.mgrid[-1:1:17j, -1:1:17j]; "
    code += "gso.tno.optimize(np.dstack([u, v, 0.35 * (1 - u * u) * (1 - v * v)])); "
    code += "sys.exit('numba' in sys.modules)"
    environment = {k: v for k, v in os.environ.items() if k != loops.VARIABLE}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)


SOURCE = "def kernel(x):\n    return x + 1.0\n"
CODE = (
    "import logging; logging.basicConfig(); from gso.solver.cached_source import compile_source; "
    f"assert compile_source({SOURCE!r})(1.0) == 2.0"
)


def run(cache, count=1):
    """Run processes at the same time that compile a function; return what they say."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache)}
    running = [
        subprocess.Popen(
            [sys.executable, "-c", CODE], env=environment, stderr=subprocess.PIPE, text=True
        )
        for _ in range(count)
    ]
    said = [process.communicate()[1] for process in running]
    assert [process.returncode for process in running] == [0] * count, said
    return said


class TestCache:
    def test_processes_can_compile_at_the_same_time_and_later_ones_do_not(self, tmp_path):
        assert any("compiling" in said for said in run(tmp_path, count=2))
        assert "compiling" not in run(tmp_path)[0]
        folder = tmp_path / "gso" / "kernels"
        assert len(list(folder.glob("kernel_*.py"))) == 1
        assert len(list(folder.glob("__pycache__/*.nbi"))) == 1
        assert not list(folder.glob("*.tmp"))
        if os.name == "posix":
            assert folder.stat().st_mode & 0o077 == 0

    @pytest.mark.skipif(os.name != "posix", reason="permissions")
    def test_a_folder_that_others_can_write_to_is_not_used(self, tmp_path):
        folder = tmp_path / "gso" / "kernels"
        folder.mkdir(parents=True)
        folder.chmod(0o777)
        run(tmp_path)
        assert not list(folder.iterdir())

    def test_a_home_that_cannot_be_written_to_is_no_error(self, tmp_path):
        (tmp_path / "file").write_text("")
        run(tmp_path / "file")

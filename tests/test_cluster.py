"""Solves on a Dask cluster."""

from __future__ import annotations

import os
import signal

import numpy as np
import pytest
from click.testing import CliRunner

import gso
from gso import SchedulerError
from gso.cli import main
from tests.conftest import saddle

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def shared():
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as running:
        yield running


@pytest.fixture
def cluster(shared):
    """A cluster of two workers: one that a test has killed is there again."""
    shared.wait_for_workers(2, timeout=60)
    return shared


@pytest.mark.slow
def test_a_batch_is_the_same_though_a_worker_is_killed(cluster):
    meshes = [saddle(n) for n in (5, 6, 7, 8, 9, 10)]
    done = {}
    for item in gso.tno.optimize_many(meshes, scheduler=cluster.scheduler_address, task="denoise"):
        if not done:
            os.kill(cluster.workers[0].pid, signal.SIGKILL)
        done[item.index] = item
    assert sorted(done) == list(range(6))
    for k, mesh in enumerate(meshes):
        alone = gso.tno.optimize(mesh, task="denoise")
        np.testing.assert_allclose(done[k].result.grid, alone.grid, atol=1e-10)


@pytest.mark.slow
def test_a_cluster_serves_several_calls(cluster):
    with gso.executors.DaskExecutor(cluster.scheduler_address) as executor:
        assert executor.workers == 2
        assert executor.map(abs, [-1, 2, -3]) == [1, 2, 3]
        for _ in range(2):
            items = list(gso.tno.optimize_many([saddle(5)] * 3, task="denoise", executor=executor))
            assert sorted(item.index for item in items if item.ok) == [0, 1, 2]


@pytest.mark.slow
@pytest.mark.parametrize("method", ["tno", "auto"])
def test_the_command_solves_on_a_cluster(cluster, tmp_path, monkeypatch, method):
    monkeypatch.chdir(tmp_path)
    names = [f"{n}.obj" for n in (5, 6)]
    for name, n in zip(names, (5, 6), strict=True):
        gso.save(gso.as_mesh(saddle(n)), name)
    address = ["--scheduler", cluster.scheduler_address, "--method", method]
    done = CliRunner().invoke(main, ["optimize", *names, "missing.obj", "-o", "out", *address])
    assert done.exit_code == 1 and "missing.obj" in done.output
    for name in names:
        alone = gso.tno.optimize(tmp_path / name)
        np.testing.assert_allclose(
            gso.load(tmp_path / "out" / name).vertices, alone.mesh.vertices, atol=1e-9
        )


def test_a_scheduler_that_is_not_there_is_named(monkeypatch):
    monkeypatch.setattr("gso.executors.dask.PATIENCE", 0.5)
    with pytest.raises(SchedulerError, match="no Dask scheduler answers at tcp:"):
        list(gso.tno.optimize_many([saddle(5)], scheduler="tcp://127.0.0.1:9"))


def test_one_input_needs_no_scheduler(tmp_path):
    gso.save(gso.as_mesh(saddle(5)), tmp_path / "a.obj")
    words = ["optimize", str(tmp_path / "a.obj"), "-o", str(tmp_path / "b.obj")]
    done = CliRunner().invoke(main, [*words, "--scheduler", "tcp://127.0.0.1:9"])
    assert done.exit_code == 1 and "--scheduler is for many inputs" in done.output

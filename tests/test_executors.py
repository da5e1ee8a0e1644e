"""Executors: the same results in this process and in others, whatever happens to these."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from multiprocessing import Pipe, active_children
from pathlib import Path
from threading import Lock, Thread

import numpy as np
import pytest

import gso
from gso.executors import SERIAL, ProcessExecutor, exchange, open_executor
from gso.mesh import Mesh
from gso.pipeline import strains_of
from tests.conftest import sphere_cap
from tests.worker_functions import (
    large,
    leave,
    leave_others,
    lock,
    nested,
    odd,
    refuse,
    sleep,
    sleep_and_tell,
    square,
)


@pytest.fixture(scope="module")
def two():
    with ProcessExecutor(2) as executor:
        yield executor


@pytest.fixture(params=["serial", "one", "two"])
def executor(request, two):
    if request.param == "two":
        yield two
    else:
        with open_executor(["serial", "one"].index(request.param)) as own:
            yield own


def results(executor, function, items):
    return {item.index: item.result for item in executor.as_completed(function, items)}


class TestResults:
    def test_as_they_finish(self, executor):
        for _ in range(2):
            found = results(executor, square, range(9))
            assert {k: y for k, (y, _) in found.items()} == {k: k * k for k in range(9)}
        assert results(executor, square, []) == {}

    def test_in_order(self, executor):
        assert [y for y, _ in executor.map(square, range(9))] == [x * x for x in range(9)]
        assert executor.map(square, []) == []

    def test_of_one_call(self, executor):
        assert executor.submit(pow, 2, 5).result() == 32

    def test_errors_are_raised_or_kept(self, executor):
        with pytest.raises(ValueError, match="-1 is negative"):
            executor.map(square, [1, -1])
        items = {item.index: item for item in executor.as_completed(square, [1, -1, 2])}
        assert [items[k].ok for k in range(3)] == [True, False, True]
        assert items[1].error == "ValueError: -1 is negative"
        assert [i.error for i in executor.as_completed(refuse, [7])] == ["face 7 is bad"]
        assert [i.error for i in executor.as_completed(odd, [7])] == ["Odd: 7 and 7"]

    def test_items_are_read_as_workers_become_free(self, executor):
        taken = []
        items = (taken.append(x) or x for x in range(10**9))
        found = executor.as_completed(square, items)
        for _ in range(3):
            next(found)
        found.close()
        assert len(taken) <= 3 + 2 * executor.workers

    def test_two_calls_at_the_same_time(self, executor):
        one = executor.as_completed(square, range(4))
        first = next(one)
        assert len(results(executor, square, range(3))) == 3
        assert {first.index, *(item.index for item in one)} == set(range(4))

    def test_two_processes_share_the_work(self, two):
        with ProcessExecutor(1) as executor:
            assert len({pid for _, pid in executor.map(square, range(6))}) == 2
        assert len(set(results(two, sleep_and_tell, [0.2] * 4).values())) == 2


class TestSurvival:
    def test_the_item_that_ends_its_worker_is_found(self, two):
        items = {item.index: item for item in two.as_completed(leave, range(6))}
        assert [items[k].result for k in (0, 1, 3, 4, 5)] == [0, 10, 30, 40, 50]
        assert "the worker process died" in items[2].error

    def test_an_item_of_a_killed_worker_is_repeated(self, two):
        found = two.as_completed(sleep, [0.01, 0.5, 0.5])
        next(found)
        time.sleep(0.1)
        for process in active_children():
            os.kill(process.pid, signal.SIGKILL)
        assert [item.result for item in found] == [0.5, 0.5]

    def test_a_worker_may_die_while_it_sends_its_result(self, two):
        def kill():
            while not done:
                time.sleep(0.05)
                for process in active_children()[:1]:
                    os.kill(process.pid, signal.SIGKILL)
                if len(killed) == 4:
                    return
                killed.append(1)

        killed, done = [], []
        thread = Thread(target=kill)
        thread.start()
        items = list(two.as_completed(large, [200_000_000] * 4))
        done.append(1)
        thread.join()
        assert sorted(item.index for item in items) == [0, 1, 2, 3]
        assert results(two, square, [3])[0][0] == 9

    def test_the_work_of_a_process_that_dies_is_repeated_here(self, two):
        own = os.getpid()
        assert two.map(leave_others, [own, own, own]) == [own] * 3
        assert two.map(square, [3])[0][0] == 9

    def test_what_cannot_be_sent_is_an_error(self, two):
        for function, item in ((lock, 0), (square, Lock()), (lambda x: x, 0)):
            (done,) = two.as_completed(function, [item])
            assert "pickle" in done.error

    def test_results_that_nobody_wanted(self, two):
        found = two.as_completed(sleep, [0.0, 100.0, 100.0])
        next(found)
        clock = time.perf_counter()
        found.close()
        assert results(two, square, [3])[0][0] == 9
        assert time.perf_counter() - clock < 30

    def test_a_worker_has_workers(self, two):
        assert results(two, nested, [-3]) == {0: ([3], 0)}

    def test_ctrl_c_ends_the_workers(self, tmp_path):
        script = (
            "import os, time\n"
            "from multiprocessing import active_children\n"
            "from gso.executors import ProcessExecutor\n"
            "with ProcessExecutor(2) as executor:\n"
            "    for item in executor.as_completed(time.sleep, [0.0, 100.0, 100.0]):\n"
            "        print([p.pid for p in active_children()], flush=True)\n"
        )
        with running(script, tmp_path) as run:
            pids = json.loads(run.stdout.readline())
            run.send_signal(signal.SIGINT)
            assert run.wait(timeout=30) != 0
            assert "KeyboardInterrupt" in run.stderr.read()
        assert pids and not [pid for pid in pids if os.path.exists(f"/proc/{pid}")]

    def test_an_executor_that_nobody_closes_and_a_script_without_a_guard(self, tmp_path):
        script = (
            "from gso.executors import ProcessExecutor\n"
            "print('once')\n"
            "executor = ProcessExecutor(2)\n"
            "print(executor.map(abs, [-1, -2, -3]))\n"
        )
        with running(script, tmp_path) as run:
            assert run.wait(timeout=60) == 0
            assert run.stdout.read().split("\n") == ["once", "[1, 2, 3]", ""]


def running(script, folder):
    (folder / "script.py").write_text(script)
    environment = {**os.environ, "PYTHONPATH": str(Path(gso.__file__).parents[1])}
    return subprocess.Popen(
        [sys.executable, str(folder / "script.py")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    )


class TestUse:
    def test_an_executor_that_is_closed(self):
        executor = ProcessExecutor(1)
        executor.map(square, [1, 2])
        executor.shutdown()
        with pytest.raises(gso.OptionError, match="this executor is closed; make another"):
            executor.submit(square, 1)

    @pytest.mark.parametrize("count", [0, -1, 1.5, "two"])
    def test_a_number_of_processes_that_cannot_be(self, count):
        with pytest.raises(gso.OptionError, match="whole number of 1 or more"):
            ProcessExecutor(count)

    def test_a_negative_number_of_workers(self):
        with pytest.raises(gso.OptionError, match=r"workers is -2; .* whole number of 0 or more"):
            list(gso.tno.optimize_many([], workers=-2))

    def test_processes_stay_for_the_next_call(self, two):
        meshes = [sphere_cap(5, radius=1.0)] * 3
        before = set()
        for _ in range(2):
            many = gso.tno.optimize_many(meshes, task="denoise", executor=two)
            assert sorted(item.index for item in many if item.ok) == [0, 1, 2]
            now = {process.pid for process in active_children()}
            assert before <= now
            before = now

    def test_strains_of_many_components_do_not_depend_on_processes(self, two):
        cap = Mesh.from_grid(sphere_cap(24, radius=1.0))
        faces = cap.triangles
        count = 5
        points = np.concatenate([cap.vertices * [1, 1, 1 + 0.1 * k] for k in range(count)])
        points[:, 0] += np.repeat(3.0 * np.arange(count), len(cap.vertices))
        many = Mesh(points, np.concatenate([faces + k * len(cap.vertices) for k in range(count)]))
        alone = strains_of(many, SERIAL)
        assert strains_of(many, two) == alone
        one = [strains_of(Mesh(points[k * 576 : (k + 1) * 576], faces)) for k in range(count)]
        assert alone["strain_max"] == pytest.approx(max(s["strain_max"] for s in one), rel=0.05)


@pytest.mark.parametrize("shared", [True, False])
@pytest.mark.parametrize("size", [0, 3, 200_000])
def test_exchange_of_arrays(size, shared, monkeypatch):
    if not shared:
        monkeypatch.delattr(os, "memfd_create", raising=False)
    here, there = Pipe()
    value = {"a": np.arange(float(size)), "b": np.arange(2 * size)[::2], "c": "text"}
    value["a"].flags.writeable = False
    handles = len(os.listdir("/proc/self/fd")) if os.path.exists("/proc/self/fd") else 0
    for _ in range(3):
        sender = Thread(target=exchange.send, args=(here, value))
        sender.start()
        found = exchange.receive(there)
        sender.join()
        assert found["c"] == "text"
        assert found["b"].flags.writeable
        for name in "ab":
            np.testing.assert_array_equal(found[name], value[name])
    if handles:
        assert len(os.listdir("/proc/self/fd")) == handles
    here.close()
    with pytest.raises(exchange.Ended):
        exchange.receive(there)
    there.close()

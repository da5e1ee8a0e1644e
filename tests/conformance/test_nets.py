"""Every kind of net and task of nets: invariance, determinism, files, bad input."""

from __future__ import annotations

import numpy as np
import pytest

import gso
from tests.conftest import saddle

torch = pytest.importorskip("torch")

from gso import OptionError, WeightsError  # noqa: E402
from gso.net import (  # noqa: E402
    KINDS,
    available,
    kind_of,
    load,
    make,
    predict,
    save,
    tasks,
)

#: Small nets of every kind for every task; a kind may refuse a task.
SMALL = {
    "coarse": {"widths": [8, 8, 8], "depths": [1, 1, 1], "passes": 2},
    "gsonet": {"channels": 8, "blocks": 1},
}


def nets():
    for kind in KINDS:
        for task in tasks.names():
            if kind == "coarse" and tasks.get(task).noisy:
                continue
            yield pytest.param(kind, task, id=f"{kind}-{task}")


def disturbed(kind: str, task: str):
    """Return a small net with random weights."""
    torch.manual_seed(0)
    net = make({"kind": kind, "task": task, **SMALL[kind]})
    with torch.no_grad():
        for p in net.parameters():
            p.add_(0.02 * torch.randn_like(p))
    return net.eval()


@pytest.mark.parametrize(("kind", "task"), nets())
@pytest.mark.parametrize("size", [64, 40])
def test_unit_and_position_do_not_matter(kind, task, size):
    net, points = disturbed(kind, task), saddle(size)
    here = predict(points, task=task, model=net)
    assert here.shape == (size, size, tasks.get(task).components)
    assert np.isfinite(here).all()
    shift = np.array([400.0, -300.0, 70.0])
    there = predict(1000.0 * (points + shift), task=task, model=net) / 1000.0
    if not tasks.get(task).flat:
        there = there - shift
    np.testing.assert_allclose(there, here, atol=1e-4)


@pytest.mark.parametrize(("kind", "task"), nets())
def test_two_predictions_are_equal_to_the_last_bit(kind, task):
    net, points = disturbed(kind, task), saddle(64)
    one, two = (predict(points, task=task, model=net) for _ in range(2))
    np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize(("kind", "task"), nets())
def test_nets_are_saved_and_loaded(kind, task, tmp_path):
    net, points = disturbed(kind, task), saddle(64)
    save(net, tmp_path / "net.safetensors", dtype=torch.float32)
    again = load(tmp_path / "net.safetensors")
    assert (kind_of(again), again.task, again.settings) == (kind, task, net.settings)
    one, two = (predict(points, task=task, model=n) for n in (net, again))
    np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize(("kind", "task"), nets())
def test_bad_input_is_named(kind, task):
    net, points = disturbed(kind, task), saddle(64)
    points[3, 4, 1] = np.nan
    with pytest.raises(gso.MeshError, match=r"\(3, 4\)"):
        predict(points, task=task, model=net)
    with pytest.raises(gso.MeshError, match="too small"):
        predict(saddle(3), task=task, model=net)
    other = next(t for t in tasks.names() if t != task)
    with pytest.raises(OptionError, match=rf"'{task}'.*'{other}'"):
        predict(saddle(64), task=other, model=net)


@pytest.mark.parametrize("kind", KINDS)
def test_wrong_settings_are_named(kind):
    with pytest.raises(OptionError, match="nonsense"):
        make({"kind": kind, "task": "developable", "nonsense": 1})
    with pytest.raises(OptionError, match="nonsense"):
        make({"kind": kind, "task": "nonsense"})


@pytest.mark.parametrize("name", tasks.names())
def test_tasks_are_complete(name):
    task = tasks.get(name)
    surface = saddle(64)
    result = surface[..., : task.components]
    found = task.figures(surface, result)
    assert task.score in found
    assert all(np.isfinite(v) for v in found.values())
    assert task.default in available(name)
    with pytest.raises(WeightsError, match="nonsense"):
        predict(surface, task=name, model="nonsense")

"""Misspelt options: each is an OptionError that names the nearest one."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import json
import warnings

import numpy as np
import pytest

import gso
from gso import OptionError
from tests.conftest import saddle


def calls():
    """Calls with a misspelt option, and the option that is meant."""
    grid = saddle(5)
    many = gso.tno.optimize_many
    return {
        "optimize": (lambda: gso.tno.optimize(grid, max_deviatoin=1.0), "max_deviation"),
        "optimize_many": (lambda: many([grid], target_curvatur=1.0), "target_curvature"),
        "optimize_many itself": (lambda: many([grid], worker=0), "workers"),
        "session": (lambda: gso.tno.Session(grid, constraint=[]), "constraints"),
        "solve": (lambda: gso.hybrid.solve(grid, polsh=3), "polish"),
        "solve for the optimiser": (lambda: gso.hybrid.solve(grid, option="fast"), "options"),
        "solve_many": (lambda: gso.hybrid.solve_many([grid], sparring=True), "sparing"),
        "options": (lambda: gso.DevelopableOptions(w_curvatur=1.0), "w_curvature"),
        "replace": (
            lambda: dataclasses.replace(gso.DenoiseOptions(), ordre=2),
            "order",
        ),
        "constraint": (lambda: gso.Handle(id=[0], positions=[[0, 0, 0]]), "ids"),
        "load": (lambda: gso.load("a.obj", wled=0.1), "weld"),
        "task": (lambda: gso.tno.optimize(grid, task="flaten"), "flatten"),
        "formulation": (lambda: gso.tno.optimize(grid, formulation="isometrie"), "isometry"),
        "preset": (lambda: gso.tno.optimize(grid, options="balnced"), "balanced"),
        "method": (lambda: gso.Options(method="gauss newton"), "gauss-newton"),
        "backend": (
            lambda: gso.tno.optimize(grid, options=gso.DevelopableOptions(backend="superlo")),
            "superlu",
        ),
        "unit": (lambda: gso.io.save_flat(grid, grid, "a.svg", unit="MM"), "mm"),
    }


@pytest.mark.parametrize("name", calls())
def test_a_misspelt_option_names_the_nearest(name):
    call, meant = calls()[name]
    with pytest.raises(OptionError, match=f"did you mean '{meant}'"):
        call()


def test_predict():
    pytest.importorskip("torch")
    with pytest.raises(OptionError, match="did you mean 'repeat'"):
        gso.net.predict(saddle(5), repeats=2)


def test_what_is_like_nothing_lists_what_there_is():
    with pytest.raises(OptionError, match="takes no 'zebra'; there are mesh, task, formulation"):
        gso.tno.optimize(saddle(5), zebra=1)


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"type": "Handel", "ids": [0]}, "entry 1: .*'Handel'; did you mean 'Handle'"),
        ({"type": "Handle", "id": [0]}, "entry 1: Handle takes no 'id'; did you mean 'ids'"),
        ({"tpye": "Handle"}, "entry 1 needs a \"type\", not 'tpye'"),
        ({"type": ["Handle"]}, 'entry 1 needs a "type"'),
    ],
)
def test_constraints_in_json(entry, message, tmp_path):
    path = tmp_path / "c.json"
    path.write_text(json.dumps([{"type": "FixedBoundary"}, entry]))
    with pytest.raises(OptionError, match=message):
        gso.constraints.read_constraints(path)


def test_signatures_are_kept():
    assert list(inspect.signature(gso.tno.optimize).parameters)[:3] == [
        "mesh",
        "task",
        "formulation",
    ]
    assert list(inspect.signature(gso.Handle).parameters) == ["ids", "positions", "weight"]
    assert "w_curvature" in inspect.signature(gso.DevelopableOptions).parameters


def test_checked_dataclasses_are_copied():
    options = gso.DevelopableOptions(iterations=3)
    assert copy.deepcopy(options) == options
    handle = copy.deepcopy(gso.Handle([0], [[0.0, 0.0, 0.0]]))
    assert np.array_equal(handle.ids, [0])


def test_warnings_point_at_the_caller():
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        gso.tno.optimize(saddle(5), target_curvature=1e-12)
    assert [w.filename for w in caught] == [__file__]

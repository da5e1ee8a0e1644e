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
    return {
        "options": (lambda: gso.DevelopableOptions(w_curvatur=1.0), "w_curvature"),
        "replace": (
            lambda: dataclasses.replace(gso.DenoiseOptions(), ordre=2),
            "order",
        ),
        "constraint": (lambda: gso.Handle(id=[0], positions=[[0, 0, 0]]), "ids"),
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


@pytest.mark.parametrize(
    "call",
    [
        lambda grid, **keywords: list(gso.tno.optimize_many(grid, workers=0, **keywords)),
        lambda grid, **keywords: gso.hybrid.solve(grid[0], **keywords),
        lambda grid, **keywords: list(gso.hybrid.solve_many(grid, workers=0, **keywords)),
    ],
)
def test_keywords_that_are_passed_on_are_checked_before_anything_is_solved(call):
    with pytest.raises(TypeError, match="unexpected keyword argument 'max_deviatoin'"):
        call([saddle(5)], max_deviatoin=1.0)


def test_what_is_like_nothing_lists_what_there_is():
    with pytest.raises(OptionError, match="takes no 'zebra'; there are iterations, tolerance"):
        gso.DenoiseOptions(zebra=1)


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

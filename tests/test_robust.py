"""Whatever comes in: a clear error, or a finite result no worse in energy than the input."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import gso
from gso import tasks, unknowns
from gso.mesh import Mesh
from gso.pipeline import Case
from gso.solver import Problem
from gso.tasks import check
from tests.conftest import saddle

TASKS = tasks.names()
QUICK = settings(
    max_examples=25,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)


@st.composite
def anything(draw) -> Mesh | np.ndarray | tuple:
    """Grids and meshes: noisy, stretched, cut, renumbered, far away, tiny or huge."""
    seed = draw(st.integers(0, 2**16))
    rng = np.random.default_rng(seed)
    height, width = draw(st.integers(3, 9)), draw(st.integers(3, 9))
    points = saddle(height, width, strength=draw(st.sampled_from([0.0, 0.3, 3.0])))
    points = points + draw(st.sampled_from([0.0, 1e-3, 0.3])) * rng.standard_normal(points.shape)
    points = points * draw(st.sampled_from([[1, 1, 1], [1e-3, 1, 1], [1, 1, 0]]))
    points = points * draw(st.sampled_from([1.0, 1e-9, 1e6])) + draw(st.sampled_from([0.0, 1e4]))
    damage = draw(st.sampled_from(["none", "nan", "pole", "fold", "same"]))
    if damage == "nan":
        points[tuple(rng.integers(0, 3, 2))] = np.nan
    elif damage == "pole":
        points[0] = points[0, 0]
    elif damage == "fold":
        points[1] = points[2]
    elif damage == "same":
        points[:] = points[0, 0]
    if draw(st.booleans()):
        return points
    faces = gso.mesh.topology.grid_faces(height, width)
    faces = faces[rng.random(len(faces)) < draw(st.sampled_from([1.0, 0.8, 0.4]))]
    if draw(st.booleans()):
        faces = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    return points.reshape(-1, 3), faces


#: What an error about a surface names.
PLACE = re.compile(r"\b(vertex|vertices|faces?|edge|grid|mesh|surface|points?)\b")


@pytest.mark.parametrize("task", TASKS)
@QUICK
@given(surface=anything())
def test_a_clear_error_or_a_finite_result(task, surface):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gso.ConvergenceWarning)
        try:
            result = gso.tno.optimize(surface, task=task, options="fast")
        except gso.GSOError as error:
            assert re.search(
                r"\b(vertex|vertices|face|faces|edge|grid|mesh|surface|points?)\b", str(error)
            )
            return
        assert np.isfinite(result.mesh.vertices).all()
        assert all(np.isfinite(v) for v in result.energy.values())
        if result.flat is not None:
            assert np.isfinite(result.flat).all()
            assert result.metrics["flipped_cells"] == 0


@QUICK
@given(surface=anything())
def test_developable_results_have_no_more_energy_than_the_design(surface):
    try:
        result = gso.tno.optimize(surface, options="fast")
        case = Case(check("developable", options="fast"), result.design)
        frame = case.frame
    except gso.GSOError:
        return
    plan = case.task.plan(case.analysis, case.solver_request)
    if not plan.stages:
        return
    stage = plan.stages[-1]
    energy = Problem(stage.items, unknowns.free(stage.layout)).energy
    before = energy(frame.mesh.vertices.ravel())
    after = energy(frame.frame.to_unit(result.mesh.vertices)[frame.order].ravel())
    assert after <= before * (1 + 1e-6)


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("factor", [1e-9, 1.0, 1e3])
def test_nanometres_and_kilometres_far_from_the_origin(task, factor):
    points = saddle(12)
    near = gso.tno.optimize(points, task=task).mesh.vertices
    far = gso.tno.optimize(factor * (points + 1e5), task=task).mesh.vertices / factor
    in_plane = tasks.get(task).flat
    far = far - (0.0 if in_plane else 1e5)
    assert np.abs(far - near).max() < 1e-5

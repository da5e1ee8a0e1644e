"""Every task and formulation: invariance, determinism, files, cancellation, bad input."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import gso
from gso import tasks
from tests.conftest import rotation, saddle

#: Without strips, which have vertices of their own: see tests/test_ruled.py.
ON_DESIGN = [
    pytest.param(task, formulation, id=f"{task}-{formulation}")
    for task in tasks.names()
    for formulation in tasks.get(task).formulations
]
CASES = [*ON_DESIGN, pytest.param("developable", "ruled", id="strips")]
DESIGN = gso.Mesh.from_grid(saddle(9, 8))


def solve(mesh: gso.Mesh, task: str, formulation: str, **more) -> gso.Result:
    """Solve; tasks that need handles get the two ends of the sheet, one of them lifted."""
    if task == "bend":
        ends = np.array([0, 7, 64, 71])
        places = mesh.vertices[ends].copy()
        up = np.cross(places[1] - places[0], places[2] - places[0])
        places[2:] += 0.2 * up / np.sqrt(np.linalg.norm(up))
        more["constraints"] = [gso.Handle(ends, places)]
    return gso.tno.optimize(mesh, task=task, formulation=formulation, options="fast", **more)


@cache
def solved(task: str, formulation: str) -> gso.Result:
    """The design's result, solved once; no test may change it."""
    return solve(DESIGN, task, formulation)


def shape(result: gso.Result) -> np.ndarray:
    """Distances between vertices of the result, which no motion changes."""
    points = result.mesh.vertices
    return np.linalg.norm(points[:, None] - points[None], axis=2)


@pytest.mark.parametrize(("task", "formulation"), ON_DESIGN)
@pytest.mark.parametrize("factor", [1.0, 1000.0])
def test_unit_position_and_rotation_do_not_matter(task, formulation, factor):
    here = solved(task, formulation)
    moved = DESIGN.replaced(factor * (DESIGN.vertices @ rotation(3).T + [40.0, -30.0, 7.0]))
    there = solve(moved, task, formulation)
    assert there.status is here.status
    assert there.usable is here.usable
    np.testing.assert_allclose(
        shape(there) / factor, shape(here), atol=2e-6 * DESIGN.diagonal, rtol=0
    )


@pytest.mark.parametrize(("task", "formulation"), ON_DESIGN)
def test_numbering_does_not_matter(task, formulation):
    if task == "bend":
        pytest.skip("handles are given by number")
    meshes = [(DESIGN, 2e-6)]
    if (task, formulation) != ("developable", "isometry"):  # which needs quads
        # The initial flat images of triangle meshes differ with the numbering, and "fast" stops
        # before the solves have met.
        meshes.append((gso.Mesh(DESIGN.vertices, DESIGN.triangles), 1e-3))
    for mesh, tolerance in meshes:
        order = np.random.default_rng(0).permutation(len(mesh.vertices))
        new = np.argsort(order)
        faces = np.where(mesh.faces < 0, -1, new[mesh.faces])
        other = gso.Mesh(mesh.vertices[order], faces)
        result = solved(task, formulation) if mesh is DESIGN else solve(mesh, task, formulation)
        one, two = shape(result), shape(solve(other, task, formulation))
        np.testing.assert_allclose(two, one[np.ix_(order, order)], atol=tolerance * mesh.diagonal)


@pytest.mark.parametrize(("task", "formulation"), CASES)
def test_two_solves_are_equal_to_the_last_bit(task, formulation):
    one, two = solved(task, formulation), solve(DESIGN, task, formulation)
    np.testing.assert_array_equal(one.mesh.vertices, two.mesh.vertices)
    assert one.energy == two.energy
    assert one.metrics == two.metrics


@pytest.mark.parametrize(("task", "formulation"), CASES)
def test_results_are_saved_and_loaded(task, formulation, tmp_path):
    result = solved(task, formulation)
    result.save(tmp_path / "result.npz")
    again = gso.Result.load(tmp_path / "result.npz")
    np.testing.assert_array_equal(again.mesh.vertices, result.mesh.vertices)
    assert (again.task, again.formulation, again.status) == (task, formulation, result.status)
    assert again.usable is result.usable
    assert again.metrics == result.metrics


@pytest.mark.parametrize(("task", "formulation"), CASES)
def test_a_callback_ends_a_solve_with_the_best_so_far(task, formulation):
    seen = []

    def once(progress):
        seen.append(progress)
        return False

    result = solve(DESIGN, task, formulation, callback=once)
    assert np.isfinite(result.mesh.vertices).all()
    # Denoising solves one linear system; there is nothing to end.
    assert len(seen) == (task != "denoise")
    if seen:
        assert result.status is gso.Status.CANCELLED
        assert not result.usable


@pytest.mark.parametrize(("task", "formulation"), CASES)
def test_bad_input_is_named(task, formulation):
    holed = saddle(9, 8)
    holed[2, 3] = np.nan
    with pytest.raises(gso.MeshError, match=r"vertex (19|\(2, 3\))"):
        solve(holed, task, formulation) if task != "bend" else gso.tno.optimize(holed, task=task)
    with pytest.raises(gso.OptionError, match="no formulation 'nonsense'"):
        gso.tno.optimize(DESIGN, task=task, formulation="nonsense")
    with pytest.raises(TypeError, match="tolerances"):
        gso.tno.optimize(DESIGN, task=task, tolerances=1)
    with pytest.raises(gso.MeshError, match=r"x0|start"):
        gso.tno.optimize(DESIGN, task=task, x0=np.zeros((3, 3)))


@pytest.mark.parametrize("task", tasks.names())
def test_options_name_what_is_wrong(task):
    options = tasks.get(task).options
    assert {"fast", "balanced", "accurate"} <= set(options.PRESETS)
    for preset in options.PRESETS:
        assert options.preset(preset) == options.preset(preset)
    with pytest.raises(gso.OptionError, match="iterationz"):
        options(iterationz=3)
    with pytest.raises(gso.OptionError, match="nonsense"):
        gso.tno.optimize(DESIGN, task=task, options="nonsense")

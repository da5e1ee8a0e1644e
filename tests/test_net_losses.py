"""Training's losses and energies are those of the metrics and of the solver."""

from __future__ import annotations

import numpy as np
import pytest

from gso import metrics, parametrization
from gso.constraints import Compiled
from gso.mesh import Mesh, vertex_normals
from gso.tasks import check, developable, flatten
from tests.conftest import cylinder, saddle

torch = pytest.importorskip("torch")

from gso.net import models  # noqa: E402
from gso.net.training import Developable, Strain, training_losses  # noqa: E402


def batch(*surfaces):
    return torch.from_numpy(np.stack(surfaces))


@pytest.fixture(scope="module")
def pair(surfaces):
    """Two designs and two results."""
    rng = np.random.default_rng(0)
    designs = np.stack(surfaces[:2])
    return designs, designs + 1e-3 * rng.standard_normal(designs.shape)


def total(items, points):
    """Value of weighted terms at the vertices (n, d)."""
    out = {}
    for item in items:
        term = item.term
        ((_, stencil),) = term.stencil
        corners = [tuple(points[stencil[:, k]].T) for k in range(stencil.shape[1])]
        r = np.stack(np.broadcast_arrays(*term.residual(corners, term.constants)))
        value = item.weight * (item.loss.value(r).sum(axis=0) * term.weights).sum()
        out[term.name] = out.get(term.name, 0.0) + value
    return out


def last_stage(points):
    mesh = Mesh.from_grid(points, weld=False)
    analysis = developable.TASK.analysis(mesh, Compiled())
    return developable.TASK.plan(analysis, check("developable")).stages[-1]


def test_developable_energy_is_the_solvers(pair):
    designs, results = pair
    fast = Developable(batch(*designs), developable.Options())
    parts = fast.parts(batch(*results))
    for k, (design, result) in enumerate(zip(designs, results, strict=True)):
        last = last_stage(design)
        solver = total(last.items, result.reshape(-1, 3))
        # The solver smooths the design before it looks how much bending is its own.
        for name, value in solver.items():
            assert float(parts[name][k]) == pytest.approx(
                value, rel=1e-3 if name == "fairness" else 1e-9
            )


def test_elongation_energy_is_the_solvers_where_it_is_large(pair):
    designs, _ = pair
    results = designs * [0.4, 1.0, 1.6]
    parts = Developable(batch(*designs), developable.Options()).parts(batch(*results))
    for k, (design, result) in enumerate(zip(designs, results, strict=True)):
        last = last_stage(design)
        value = total(last.items, result.reshape(-1, 3))["elongation"]
        assert value > 1e-4
        assert float(parts["elongation"][k]) == pytest.approx(value, rel=1e-9)


def test_strain_energy_is_the_solvers(pair):
    designs, _ = pair
    rng = np.random.default_rng(1)
    flats = [
        parametrization.rectangle(p) + 3e-3 * rng.standard_normal((*p.shape[:2], 2))
        for p in designs
    ]
    strain = Strain(batch(*designs), flatten.Options())
    values, levels = strain(batch(*flats)), strain.level(strain.residuals(batch(*flats)))
    for k, (design, flat) in enumerate(zip(designs, flats, strict=True)):
        mesh, level = Mesh.from_grid(design, weld=False), float(levels[k])
        items = flatten.stages.strain_stage(flatten.Options(), mesh, level).items
        solver = sum(total(items, flat.reshape(-1, 2)).values()) / level
        assert float(values[k]) == pytest.approx(solver, rel=1e-9)


def test_losses_are_the_metrics(pair):
    designs, results = pair
    gc, fair = training_losses.gc(batch(*results)), training_losses.fair(batch(*results))
    compared = (training_losses.k_left, training_losses.d_h, training_losses.fair_ratio)
    left, near, ratio = (f(batch(*results), batch(*designs)) for f in compared)
    for k, (design, result) in enumerate(zip(designs, results, strict=True)):
        was, is_left = (metrics.loss_gc_mean(x, scale=1.0) for x in (design, result))
        assert float(left[k]) == pytest.approx(is_left / was, rel=1e-12)
        assert float(near[k]) == pytest.approx(metrics.d_H(design, result), rel=1e-12)
        assert float(gc[k]) == pytest.approx(is_left, rel=1e-12)
        one = training_losses.loss_gc(batch(result))
        assert float(one) == pytest.approx(metrics.loss_gc(result, scale=1.0), rel=1e-12)
        assert float(fair[k]) == pytest.approx(metrics.fairness(result, scale=1.0), rel=1e-6)
        grew = metrics.fairness_ratio(design, result)
        assert float(ratio[k]) == pytest.approx(grew, rel=1e-6)


@pytest.mark.parametrize("steps", [(0, 0), (1, -1), (2, 1)])
def test_distances_are_to_the_nearest_vertex(steps):
    design = saddle(12, 9)
    slid = np.roll(design, steps, axis=(0, 1))[2:-2, 2:-2]
    result = design.copy()
    result[2:-2, 2:-2] = slid + 1e-3
    near = training_losses.d_h(batch(result), batch(design))
    assert float(near) == pytest.approx(metrics.d_H(design, result), rel=1e-12)


def test_iso_and_the_metric():
    surface = saddle(9, 8)
    flat = parametrization.rectangle(surface)
    defect = training_losses.iso(batch(surface), batch(flat))
    by_hand = metrics.isometry_defect(surface, flat, scale=1.0)
    assert float(defect) <= (by_hand**2).mean() <= 3 * float(defect)
    cell = float(training_losses.iso_cell(batch(surface), batch(flat)))
    assert cell == pytest.approx(metrics.loss_iso_cell(surface, flat, scale=1.0), rel=1e-12)
    bent = cylinder(9)
    assert float(training_losses.iso(batch(bent), batch(bent))) == 0.0


def test_the_strain_is_that_of_the_metric():
    surface = saddle(9, 8)
    flat = parametrization.rectangle(surface)
    mean = float(training_losses.strain(batch(surface), batch(flat)))
    assert mean == pytest.approx(metrics.principal_strains(surface, flat).mean, rel=1e-6)
    plane = np.dstack([*np.mgrid[:5.0, :4.0], np.zeros((5, 4))])
    still = batch(plane[..., :2]).requires_grad_()
    none = training_losses.strain(batch(plane), still)
    none.sum().backward()
    assert 0.0 <= float(none.detach()) <= 2e-6 and still.grad.isfinite().all()


def test_curvature_weights():
    surface = saddle(9, 8)
    weights = training_losses.iso_weights(batch(surface))[0].numpy()
    assert weights.shape == (8, 7)
    assert weights.min() == pytest.approx(0.0, abs=1e-12) and weights.max() < 1.0
    k = np.abs(metrics.curvature_grid(surface))
    inner = 0.25 * (k[1:, 1:] + k[:-1, 1:] + k[1:, :-1] + k[:-1, :-1])
    # Cells in the corners have one vertex inside the surface, others on the border two.
    sides = [0.5 * (x[1:] + x[:-1]) for x in (k[0], k[-1], k[:, 0], k[:, -1])]
    largest = max(inner.max(), max(x.max() for x in sides), k[[0, 0, -1, -1], [0, -1, 0, -1]].max())
    np.testing.assert_allclose(weights[1:-1, 1:-1], 1.0 - inner / largest, atol=1e-12)
    np.testing.assert_allclose(weights[0, 1:-1], 1.0 - sides[0] / largest, atol=1e-12)
    assert weights[0, 0] == pytest.approx(1.0 - k[0, 0] / largest, abs=1e-12)


def test_normals_and_rectangle_are_the_packages(pair):
    designs, _ = pair
    p = models.planes(batch(*designs))
    normals = models.points(models.normals(p)).numpy()
    flat = models.rectangle(p).numpy()
    for k, design in enumerate(designs):
        expected = vertex_normals(Mesh.from_grid(design, weld=False)).reshape(design.shape)
        np.testing.assert_allclose(normals[k], expected, atol=1e-12)
        start = parametrization.rectangle(design)
        np.testing.assert_allclose(flat[k], start - start.mean(axis=(0, 1)), atol=1e-12)


def test_degenerate_surfaces_have_finite_gradients():
    point = torch.zeros(1, 8, 8, 3, requires_grad=True)
    value = (
        training_losses.gc(point).sum()
        + Strain(point.detach(), flatten.Options())(point[..., :2]).sum()
    )
    value.backward()
    assert torch.isfinite(value) and torch.isfinite(point.grad).all()

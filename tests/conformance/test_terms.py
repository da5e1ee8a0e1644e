"""Every registered term: the same in all numbers, exact derivatives, declared invariances."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gso.energy import Term, registry
from gso.solver import kernels
from gso.unknowns import DIMENSIONS
from tests.conformance.term_examples import examples
from tests.conftest import meshes

MESHES = meshes()
CASES = [
    pytest.param(module, term, id=f"{name}-{kind}-{k}")
    for name, module in registry().items()
    for kind, mesh in MESHES.items()
    for k, term in enumerate(examples(name, mesh))
]


def coordinates(term: Term, seed: int = 0, collapse: bool = False) -> tuple[np.ndarray, tuple]:
    """Coordinates (k, e) of a term's elements at a disturbed surface, and point dimensions."""
    mesh = next(m for m in MESHES.values() if _fits(term, m))
    rng = np.random.default_rng(seed)
    points = mesh.vertices + 0.03 * rng.standard_normal(mesh.vertices.shape)
    if collapse:
        points = np.zeros_like(points)
    rows, shape = [], []
    for block, index in term.stencil:
        block_points = points[:, : DIMENSIONS[block]]
        if block == "scale":
            block_points = 1.0 + 0.03 * rng.standard_normal((int(index.max()) + 1, 1))
        for k in range(index.shape[1]):
            rows.append(block_points[index[:, k]].T)
            shape.append(block_points.shape[1])
    return np.concatenate(rows), tuple(shape)


def _fits(term: Term, mesh) -> bool:
    ids = [int(i.max()) for block, i in term.stencil if block != "scale"]
    return max(ids, default=0) < len(mesh.vertices)


def constants(term: Term) -> np.ndarray:
    return term.constants if term.constants.size else np.empty((0, term.count))


def split(x, shape):
    ends = np.cumsum(shape)
    return [
        tuple(x[k] for k in range(end - dim, end)) for dim, end in zip(shape, ends, strict=True)
    ]


@pytest.mark.parametrize(("module", "term"), CASES)
def test_numpy_torch_casadi_and_kernel_agree(module, term):
    torch = pytest.importorskip("torch")
    x, shape = coordinates(term)
    c = constants(term)
    by_kernel, jacobian = kernels.kernel(term.residual, shape, len(c), True)(x, c)
    mapped = kernels.casadi_function(term.residual, shape, len(c), True).map(x.shape[1])
    by_casadi, casadi_jacobian = map(np.array, mapped(x, c))
    casadi_jacobian = casadi_jacobian.reshape(len(by_casadi), -1, x.shape[1])
    by_numpy = np.stack([np.broadcast_to(r, term.count) for r in term.residual(split(x, shape), c)])
    xt, ct = torch.tensor(x, requires_grad=True), torch.tensor(c)
    by_torch = torch.stack(list(term.residual(split(xt, shape), ct)))
    scale = 1.0 + np.abs(by_numpy).max()
    for other in (by_kernel, by_casadi, by_torch.detach().numpy()):
        np.testing.assert_allclose(other, by_numpy, atol=1e-12 * scale, rtol=1e-12)
    np.testing.assert_allclose(
        jacobian, casadi_jacobian, atol=1e-11 * (1 + np.abs(jacobian).max()), rtol=1e-10
    )
    gradient = torch.autograd.grad(by_torch.sum(), xt)[0].numpy()
    np.testing.assert_allclose(
        gradient, jacobian.sum(axis=0), atol=1e-11 * (1 + np.abs(jacobian).max()), rtol=1e-9
    )


@pytest.mark.parametrize(("module", "term"), CASES)
def test_jacobian_is_that_of_central_differences(module, term):
    x, shape = coordinates(term, seed=1)
    c = constants(term)
    _, jacobian = kernels.kernel(term.residual, shape, len(c), True)(x, c)
    run = kernels.kernel(term.residual, shape, len(c), False)
    h = 1e-6
    for k in range(len(x)):
        step = np.zeros_like(x)
        step[k] = h
        numeric = (run(x + step, c)[0] - run(x - step, c)[0]) / (2 * h)
        np.testing.assert_allclose(
            jacobian[:, k], numeric, atol=1e-6 * (1 + np.abs(jacobian).max()), rtol=1e-5
        )
    if term.linear:
        _, elsewhere = kernels.kernel(term.residual, shape, len(c), True)(x + 1.0, c)
        np.testing.assert_allclose(jacobian, elsewhere, atol=1e-12)


@pytest.mark.parametrize(("module", "term"), CASES)
def test_declared_invariances_hold(module, term):
    x, shape = coordinates(term, seed=2)
    c = constants(term)
    run = kernels.kernel(term.residual, shape, len(c), False)
    here = run(x, c)[0]
    size = 1.0 + np.abs(here)
    if "translation" in module.INVARIANT:
        # A point of one component is a number, not a place.
        shift = np.concatenate([np.array([0.3, -0.7, 0.5])[:dim] * (dim > 1) for dim in shape])
        np.testing.assert_array_less(np.abs(run(x + shift[:, None], c)[0] - here), 1e-10 * size)
    if "rotation" in module.INVARIANT:
        turn = Rotation.from_rotvec([0.0, 0.0, 0.8]).as_matrix()
        if 2 not in shape:
            turn = Rotation.from_rotvec([0.4, -0.9, 0.3]).as_matrix()
        moved = np.concatenate(
            [turn[:d, :d] @ np.stack(p) if d > 1 else np.stack(p) for p, d in _points(x, shape)]
        )
        norms = [np.linalg.norm(v, axis=0) for v in (here, run(moved, c)[0])]
        np.testing.assert_allclose(norms[0], norms[1], atol=1e-10 * size.max())


def _points(x, shape):
    return list(zip(split(x, shape), shape, strict=True))


@pytest.mark.parametrize(("module", "term"), CASES)
def test_degenerate_elements_stay_finite(module, term):
    x, shape = coordinates(term, collapse=True)
    c = constants(term)
    value, jacobian = kernels.kernel(term.residual, shape, len(c), True)(x, c)
    if getattr(module, "UNBOUNDED", False):
        assert not np.isnan(value).any()
        return
    assert np.isfinite(value).all()
    assert np.isfinite(jacobian).all()


def test_average_terms_weigh_one_in_total():
    for mesh in MESHES.values():
        for name in ("curvature", "proximity"):
            total = sum(t.weights.sum() for t in examples(name, mesh))
            assert total == pytest.approx(1.0)


def test_kernels_refuse_what_they_cannot_print():
    import casadi

    from gso import BackendError

    with pytest.raises(BackendError, match="operation"):
        kernels.kernel(lambda p, c: (casadi.erf(p[0][0]),), (3,), 0, False)

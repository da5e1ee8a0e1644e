"""Smoothing: what is known exactly, invariance, and blind results on noisy surfaces."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from gso import Mesh, MeshError, OptionError
from gso.smoothing import Smoothed, estimate_sigma, smooth_grid, smooth_mesh
from gso.smoothing.local_fits import neighbours, residuals, rings, umbrella
from gso.smoothing.select import best_weight, factoring, gcv
from gso.smoothing.spectrum import CENTRE, Spectrum
from tests.conftest import rotation

SIGMA = 0.01


def parameters(height=32, width=32):
    return np.meshgrid(np.linspace(-1, 1, height), np.linspace(-1, 1, width), indexing="ij")


def polynomial(rng, height, width, degree):
    """Grid with independent random polynomials of a degree per parameter."""
    u, v = np.linspace(-1, 1, height), np.linspace(-1, 1, width)
    net = rng.standard_normal((degree + 1, degree + 1, 3))
    return np.einsum("ia,jb,abk->ijk", np.vander(u, degree + 1), np.vander(v, degree + 1), net)


def wavy(height=32, width=32):
    u, v = parameters(height, width)
    return np.stack([u, v, 0.3 * np.sin(2 * u) * np.cos(1.5 * v) + 0.2 * u * v], axis=-1)


def roof(height=32, width=32, slant=0.0):
    """Two planes that meet along a line, slanted against the grid lines."""
    u, v = parameters(height, width)
    return np.stack([u, v, 0.5 * np.abs(u + slant * v - 0.1)], axis=-1)


def folded_paper(n=32):
    """A parabolic cylinder reflected in a plane: two curved sheets with a curved crease."""
    u, v = parameters(n, n)
    sheet, plane = 0.5 * u**2, 0.25 + 0.2 * v + 0.1 * u
    return np.stack([u, v, np.minimum(sheet, 2 * plane - sheet)], axis=-1)


def noisy(points, seed=0, sigma=SIGMA):
    return points + sigma * np.random.default_rng(seed).standard_normal(points.shape)


def angle(a, b):
    cross = np.linalg.norm(np.cross(a, b), axis=-1)
    return float(np.degrees(np.arctan2(cross, (a * b).sum(axis=-1))).mean())


def theta(p, q):
    """Mean angle between the cell normals of two grids, degrees."""

    def normals(g):
        return np.cross(g[:-1, :-1] - g[1:, 1:], g[:-1, 1:] - g[1:, :-1])

    return angle(normals(p), normals(q))


def mesh_theta(p, q, faces):
    """Mean angle between the face normals of two meshes, degrees."""

    def normals(x):
        corner = x[faces.T]
        if faces.shape[1] == 3:
            return np.cross(corner[1] - corner[0], corner[2] - corner[0])
        return np.cross(corner[2] - corner[0], corner[3] - corner[1])

    return angle(normals(p), normals(q))


def quads(height, width):
    v = np.arange(height * width).reshape(height, width)
    corners = v[:-1, :-1], v[1:, :-1], v[1:, 1:], v[:-1, 1:]
    return np.stack([c.ravel() for c in corners], axis=1)


def renumbered(points, faces, seed=0):
    order = np.random.default_rng(seed).permutation(len(points))
    return points[order], np.argsort(order)[faces]


def patch_mesh(grid, seed=0):
    """The grid in triangles, numbered at random."""
    f = quads(*grid.shape[:2])
    triangles = np.concatenate([f[:, [0, 1, 2]], f[:, [0, 2, 3]]])
    return renumbered(grid.reshape(-1, 3), triangles, seed)


def holed_quads(seed=0, count=220):
    """Irregular quads over a square with a round hole: a Delaunay mesh, each triangle in three."""
    rng = np.random.default_rng(seed)
    side = int(np.sqrt(count))
    u, v = parameters(side, side)
    plane = np.stack([u, v], axis=-1).reshape(-1, 2)
    plane += rng.uniform(-0.5, 0.5, plane.shape) / side
    triangles = Delaunay(plane).simplices
    centre = plane[triangles].mean(axis=1)
    triangles = triangles[np.hypot(*(centre - [0.2, -0.1]).T) > 0.35]
    sides = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1), axis=-1)
    edges, which = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    middle = len(plane) + which.reshape(-1, 3)
    inside = len(plane) + len(edges) + np.arange(len(triangles))
    faces = np.concatenate(
        [
            np.stack([triangles[:, k], middle[:, k], inside, middle[:, k - 1]], axis=1)
            for k in range(3)
        ]
    )
    plane = np.concatenate([plane, plane[edges].mean(axis=1), plane[triangles].mean(axis=1)])
    used, faces = np.unique(faces, return_inverse=True)
    u, v = plane[used].T
    height = 0.3 * np.sin(2 * u) * np.cos(1.5 * v) + 0.2 * u * v
    return renumbered(np.stack([u, v, height], axis=1), faces.reshape(-1, 4), seed)


def sphere(steps=3):
    """A closed triangle mesh: the octahedron, subdivided."""
    points = np.concatenate([np.eye(3), -np.eye(3)])
    signs = [(a, b, c) for a in (0, 3) for b in (1, 4) for c in (2, 5)]
    faces = np.array([s if sum(i > 2 for i in s) % 2 == 0 else s[::-1] for s in signs])
    for _ in range(steps):
        sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1), axis=-1)
        edges, which = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
        a, b, c = (len(points) + which.reshape(-1, 3)).T
        points = np.concatenate([points, points[edges].mean(axis=1)])
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        i, j, k = faces.T
        faces = np.concatenate(
            [np.stack(t, axis=1) for t in ((i, a, c), (a, j, b), (c, b, k), (a, b, c))]
        )
    return points, faces


def motion(points, shift=50.0, scale=300.0):
    """The points turned, scaled and moved away, and the way back."""
    turn = rotation(5)
    return scale * points @ turn.T + shift, lambda q: (q - shift) @ turn / scale


@pytest.mark.parametrize("shape", [(3, 3), (3, 7), (16, 9), (40, 40), (300, 9)])
@pytest.mark.parametrize("order", [2, 3, 4, 6, 8])
def test_a_weight_leaves_polynomials_of_lower_degree(shape, order):
    degree = min(order, *(n - 1 for n in shape)) - 1
    clean = polynomial(np.random.default_rng(order), *shape, degree)
    result = smooth_grid(clean, order=order, weight=1.0)
    assert np.abs(result.points - clean).max() < 1e-9 * np.abs(clean).max()


def test_a_weight_solves_the_penalised_least_squares():
    height, width, order, weight = 9, 7, 3, 1e-5
    p = noisy(wavy(height, width))
    du = np.diff(np.eye(height), order, axis=0) * (height - 1) ** order
    dv = np.diff(np.eye(width), order, axis=0) * (width - 1) ** order
    penalty = np.kron(du.T @ du, np.eye(width)) + np.kron(np.eye(height), dv.T @ dv)
    smoother = np.linalg.inv(np.eye(height * width) + weight * penalty)
    result = smooth_grid(p, order=order, weight=weight)
    expected = (smoother @ p.reshape(-1, 3)).reshape(p.shape)
    np.testing.assert_allclose(result.points, expected, atol=1e-9)
    assert result.dof == pytest.approx(np.trace(smoother), rel=1e-8)


@pytest.mark.parametrize(("n", "order"), [(3, 2), (3, 8), (20, 4), (64, 8), (300, 8)])
def test_modes_are_complete_and_heavier_weights_keep_fewer(n, order):
    p = noisy(wavy(n, 5))
    np.testing.assert_allclose(smooth_grid(p, order=order, weight=0.0).points, p, atol=1e-10)
    dof = [smooth_grid(p, order=order, weight=w).dof for w in (0.0, 1e-20, 1e-10, 1.0, 1e10)]
    assert dof[0] == pytest.approx(5 * n)
    assert (np.diff(dof) <= 0).all()
    # What is left in the end are the polynomials, which no weight changes.
    assert dof[-1] == pytest.approx(min(order, n - 1) * min(order, 4), rel=0.01)


def test_the_criterion_has_the_stated_gradient():
    low = np.add.outer(np.arange(24.0) / 24, np.arange(20.0) / 20)
    coefficients = np.random.default_rng(0).standard_normal((3, 24, 20)) * np.exp(-8 * low)
    spectrum = Spectrum((coefficients**2).sum(axis=0) + 1e-6)
    point = CENTRE + np.array([-3.0, 0.4, 0.1, 0.1, -0.5])
    gradient = -spectrum._expand(point)[1]
    step = 1e-5 * np.eye(5)
    numeric = (spectrum._scores(point + step) - spectrum._scores(point - step)) / 2e-5
    np.testing.assert_allclose(gradient, numeric, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("sigma", [0.001, 0.01, 0.05])
@pytest.mark.parametrize("shape", [(64, 64), (40, 25)])
def test_noise_is_measured_and_removed_blind(shape, sigma):
    clean = wavy(*shape)
    dirty = noisy(clean, sigma=sigma)
    result = smooth_grid(dirty)
    assert isinstance(result, Smoothed)
    assert result.sigma == pytest.approx(sigma, rel=0.05)
    assert np.std(result.points - clean) < 0.2 * sigma
    # About as good as the best weight that one could pick knowing the truth.
    plain = [smooth_grid(dirty, order=4, weight=w).points for w in 10.0 ** np.arange(-14, 0)]
    assert theta(clean, result.points) < 1.3 * min(theta(clean, q) for q in plain)


@pytest.mark.parametrize(("size", "left"), [(4, 0.4), (6, 0.2), (8, 0.12), (12, 0.05)])
def test_noise_of_small_planes_is_removed(size, left):
    u, v = parameters(size, size)
    plane = np.stack([u, v, 0.3 * u - 0.2 * v], axis=-1)
    results = [smooth_grid(noisy(plane, seed, 0.02)) for seed in range(60)]
    rest = [np.var(result.points - plane) for result in results]
    assert np.mean(rest) < left * 0.02**2
    assert np.median([result.sigma for result in results]) == pytest.approx(0.02, rel=0.2)


@pytest.mark.parametrize("order", [None, 4])
@pytest.mark.parametrize("sigma", [0.0, 0.001, 0.01])
def test_waves_are_not_taken_for_noise(order, sigma):
    u, v = parameters(64, 64)
    for along, across in [(12, 12), (20, 20), (25, 25), (40, 0), (25, 6)]:
        clean = np.stack([u, v, 0.06 * np.cos(along * u) * np.cos(across * v)], axis=-1)
        result = smooth_grid(noisy(clean, sigma=sigma), order=order)
        assert result.sigma < 1.1 * sigma + 0.0005
        assert np.std(result.points - clean) < 0.7 * sigma + 0.0005


def test_random_polynomials_are_denoised_to_a_fraction_of_a_degree():
    angles = []
    for seed in range(6):
        clean = polynomial(np.random.default_rng(seed), 64, 64, 5)
        clean /= np.sqrt((clean**2).sum(axis=-1).max())
        angles.append(theta(clean, smooth_grid(noisy(clean, seed, 0.005)).points))
    assert np.mean(angles) < 1.5


@pytest.mark.parametrize("norm", ["l2", "l1"])
def test_grids_do_not_care_for_unit_position_and_direction(norm):
    dirty = noisy(wavy(20, 28))
    moved, back = motion(dirty)
    one, two = smooth_grid(dirty, norm=norm), smooth_grid(moved, norm=norm)
    assert np.abs(back(two.points) - one.points).max() < 1e-8
    assert two.sigma == pytest.approx(300 * one.sigma, rel=1e-6)
    assert (two.order, two.weight) == (one.order, pytest.approx(one.weight, rel=1e-6))


def test_grids_do_not_care_for_the_order_of_rows_and_columns():
    dirty = noisy(wavy(20, 28))
    expected = smooth_grid(dirty).points
    flipped = smooth_grid(dirty[::-1]).points[::-1]
    swapped = np.swapaxes(smooth_grid(np.swapaxes(dirty, 0, 1)).points, 0, 1)
    assert np.abs(flipped - expected).max() < 1e-8
    assert np.abs(swapped - expected).max() < 1e-8


@pytest.mark.parametrize("norm", ["l2", "l1"])
@pytest.mark.parametrize(
    "clean",
    [wavy(24, 24), roof(24, 24), 1e8 + wavy(24, 24), np.ones((9, 9, 3)), roof(8, 8) * [1, 1, 0]],
    ids=["wavy", "roof", "far", "point", "plane"],
)
def test_grids_without_noise_come_back(clean, norm):
    points = smooth_grid(clean, norm=norm).points
    assert np.isfinite(points).all()
    assert np.abs(points - clean).max() < 1e-4


@pytest.mark.parametrize("norm", ["l2", "l1"])
@pytest.mark.parametrize("shape", [(3, 3), (3, 4), (5, 3), (4, 30)])
@pytest.mark.parametrize("sigma", [0.0, 0.01, 10.0])
def test_small_grids(shape, norm, sigma):
    result = smooth_grid(noisy(wavy(*shape), sigma=sigma), norm=norm)
    assert result.points.shape == (*shape, 3)
    assert np.isfinite(result.points).all()
    assert np.isfinite([result.sigma, result.weight, result.dof]).all()


def test_the_returned_weight_smooths_alike_and_more_weight_smooths_more():
    dirty = noisy(wavy())
    blind = smooth_grid(dirty)
    again = smooth_grid(dirty, order=blind.order, weight=blind.weight)
    assert again.dof == pytest.approx(blind.dof, rel=0.05)
    spent = [smooth_grid(dirty, order=4, weight=w).dof for w in (0.0, 1e-9, 1e-6, 1e-3)]
    assert spent[0] == dirty[..., 0].size
    assert (np.diff(spent) < 0).all()


@pytest.mark.parametrize(
    "clean",
    [roof(), roof(slant=0.7), folded_paper()],
    ids=["along grid lines", "across grid lines", "curved"],
)
def test_creases_of_grids_are_kept(clean):
    dirty = noisy(clean, sigma=0.005)
    kept, rounded = smooth_grid(dirty, norm="l1"), smooth_grid(dirty)
    assert theta(clean, kept.points) < 0.7 * theta(clean, rounded.points)
    assert kept.sigma == pytest.approx(0.005, rel=0.1)


def test_flat_pieces_are_found_between_creases():
    assert smooth_grid(noisy(roof(), sigma=0.005), norm="l1", order=2).dof < 60


@pytest.mark.parametrize("norm", ["l2", "l1"])
def test_more_charge_for_kinks_leaves_fewer(norm):
    weights = (1e-9, 1e-6, 1e-3) if norm == "l2" else (0.5, 3.0, 30.0)
    dirty = noisy(roof())
    rough = [
        np.abs(np.diff(smooth_grid(dirty, norm=norm, order=2, weight=w).points, 2, axis=0)).sum()
        for w in weights
    ]
    assert rough[0] > rough[1] > rough[2]


@pytest.mark.parametrize("order", [2, 3, 4])
def test_patches_do_not_see_polynomials_of_lower_degree(order):
    rng = np.random.default_rng(order)
    plane = rng.uniform(-1, 1, (300, 2))
    faces = Delaunay(plane).simplices
    points = np.column_stack([plane, np.zeros(300)]) @ np.linalg.qr(rng.random((3, 3)))[0]
    local = residuals(points, rings(neighbours(Mesh(points, faces)), 2), order)
    penalty = local.penalty()
    u, v = plane.T
    below = np.stack([u**a * v**b for a in range(order) for b in range(order - a)], axis=1)
    seen = np.einsum("ij,ij->j", below, penalty @ below)
    assert seen.max() < 1e-6 * (u**order @ penalty @ u**order)
    assert abs(penalty - penalty.T).max() < 1e-9 * abs(penalty).max()


def test_rings_and_boundary_of_a_mixed_mesh():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [9, 9, 9]])
    mesh = Mesh(points, [[0, 1, 2, 3], [1, 4, 2, -1]])
    one = rings(neighbours(mesh)[:5, :5], 1)
    assert one.index[4][one.real[4]].tolist() == [1, 2, 4]
    assert one.index[2][one.real[2]].tolist() == [0, 1, 2, 3, 4]
    laplacian = umbrella(mesh, neighbours(mesh)).toarray()
    assert laplacian[4].tolist() == [0, -0.5, -0.5, 0, 1, 0]
    assert not laplacian[5].any()


def test_rings_of_a_pole_are_a_sample():
    angle = 2 * np.pi * np.arange(500) / 500
    points = np.vstack([np.zeros(3), np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)])
    fan = Mesh(points, [[0, i, i % 500 + 1] for i in range(1, 501)])
    patches = rings(neighbours(fan), 1)
    assert patches.index.shape[1] == 64
    assert len(np.unique(patches.index[0])) == 64
    assert patches.real[1].sum() == 4


def test_the_weight_is_the_one_of_exact_cross_validation():
    points, faces = patch_mesh(wavy(16, 16))
    dirty = noisy(points)
    dirty = dirty - dirty.mean(axis=0)
    penalty = residuals(points, rings(neighbours(Mesh(points, faces)), 2), 3).penalty()
    values, vectors = np.linalg.eigh(penalty.toarray())
    energy = ((vectors.T @ dirty) ** 2).sum(axis=1)
    weights = 10.0 ** np.arange(-9, 3, 0.05)
    removed = 1 - 1 / (1 + weights[:, None] * np.maximum(values, 0))
    exact = weights[np.argmin(np.log(removed**2 @ energy) - 2 * np.log(removed.sum(axis=1)))]
    choice = best_weight(penalty, dirty, 1e-6, gcv(1.0))
    assert abs(np.log10(choice.weight / exact)) < 0.5
    expected = factoring(penalty)(choice.weight)(dirty)
    assert np.abs(choice.points - expected).max() < 1e-4


def best_of_trimesh(clean, dirty, faces):
    """Least angle of trimesh's smoothers over a range of settings, chosen with the truth."""
    trimesh = pytest.importorskip("trimesh")
    smoothing = trimesh.smoothing
    triangles = faces if faces.shape[1] == 3 else np.vstack([faces[:, :3], faces[:, [0, 2, 3]]])
    fresh = trimesh.Trimesh(dirty, triangles, process=False)
    angles = []
    for equal in (True, False):
        laplacian = smoothing.laplacian_calculation(fresh, equal_weight=equal)
        shared = {"laplacian_operator": laplacian}
        for n in (4, 8, 16, 32):
            for filtering, settings in (
                (smoothing.filter_laplacian, {"lamb": 0.3, "volume_constraint": False}),
                (smoothing.filter_laplacian, {"lamb": 0.6, "volume_constraint": False}),
                (smoothing.filter_humphrey, {"alpha": 0.0, "beta": 0.5}),
                (smoothing.filter_humphrey, {"alpha": 0.1, "beta": 0.5}),
                (smoothing.filter_taubin, {"lamb": 0.5, "nu": 0.4}),
                (smoothing.filter_taubin, {"lamb": 0.5, "nu": 0.2}),
                (smoothing.filter_mut_dif_laplacian, {"lamb": 0.5, "volume_constraint": False}),
            ):
                mesh = fresh.copy()
                filtering(mesh, iterations=n, **settings, **shared)
                angles.append(mesh_theta(clean, np.asarray(mesh.vertices), faces))
    return min(angles)


@pytest.mark.parametrize(
    "mesh", [patch_mesh(wavy(33, 33)), holed_quads()], ids=["triangles", "quads with a hole"]
)
def test_meshes_are_denoised_better_than_by_trimesh(mesh):
    clean, faces = mesh
    dirty = noisy(clean, sigma=0.005 * np.linalg.norm(np.ptp(clean, axis=0)))
    result = smooth_mesh(Mesh(dirty, faces))
    assert mesh_theta(clean, result.points, faces) < 0.75 * best_of_trimesh(clean, dirty, faces)


@pytest.mark.parametrize("order", [2, 3, 4])
def test_boundaries_and_holes_do_not_shrink(order):
    clean, faces = holed_quads()
    rim = np.concatenate(Mesh(clean, faces).boundary_loops)
    sigma = 0.005
    error = smooth_mesh(Mesh(noisy(clean, sigma=sigma), faces), order=order).points - clean
    inner = np.setdiff1d(np.arange(len(clean)), rim)
    outwards = (error[rim, :2] * clean[rim, :2]).sum(axis=1)
    assert abs(outwards.mean()) < 0.2 * sigma
    assert np.std(error[rim, 2]) < sigma
    assert np.std(error[inner, 2]) < 0.6 * sigma


def test_closed_meshes_keep_their_size():
    clean, faces = sphere()
    result = smooth_mesh(Mesh(noisy(clean), faces))
    radius = np.linalg.norm(result.points, axis=1)
    assert abs(radius.mean() - 1) < 0.1 * SIGMA
    assert radius.std() < 0.7 * SIGMA
    assert result.sigma == pytest.approx(SIGMA, rel=0.1)


@pytest.mark.parametrize("norm", ["l2", "l1"])
def test_meshes_do_not_care_for_unit_position_and_direction(norm):
    points, faces = patch_mesh(wavy(16, 16))
    dirty = noisy(points)
    moved, back = motion(dirty)
    one, two = (
        smooth_mesh(Mesh(dirty, faces), norm=norm),
        smooth_mesh(Mesh(moved, faces), norm=norm),
    )
    assert np.abs(back(two.points) - one.points).max() < 1e-7
    assert two.sigma == pytest.approx(300 * one.sigma, rel=1e-5)


@pytest.mark.parametrize(
    "clean",
    [roof(24, 24), roof(24, 24, slant=0.7), folded_paper(24)],
    ids=["along", "across", "curved"],
)
def test_creases_of_meshes_are_kept(clean):
    points, faces = patch_mesh(clean)
    dirty = noisy(points, sigma=0.003)
    kept, rounded = smooth_mesh(Mesh(dirty, faces), norm="l1"), smooth_mesh(Mesh(dirty, faces))
    assert mesh_theta(points, kept.points, faces) < 0.7 * mesh_theta(points, rounded.points, faces)


def test_triangles_quads_and_both_give_much_the_same():
    grid = wavy(20, 20)
    four = quads(20, 20)
    split = np.arange(len(four)) % 3 == 0
    blank = np.full(split.sum(), -1)
    mixed = np.concatenate(
        [
            four[~split],
            np.column_stack([four[split][:, [0, 1, 2]], blank]),
            np.column_stack([four[split][:, [0, 2, 3]], blank]),
        ]
    )
    dirty = noisy(grid.reshape(-1, 3))
    first, second = smooth_mesh(Mesh(dirty, four)), smooth_mesh(Mesh(dirty, mixed))
    assert np.std(first.points - second.points) < 0.3 * SIGMA


@pytest.mark.parametrize("shape", [(64, 64), (120, 50)])
def test_noise_is_told_from_waves_and_creases(shape):
    u, v = parameters(*shape)
    waves = np.stack([u, v, 0.06 * np.sin(20 * u) * np.sin(20 * v)], axis=-1)
    cliff = np.stack([u, v, np.where(u + 0.3 * v > 0.1, 0.4, 0.0)], axis=-1)
    for clean in (wavy(*shape), waves, roof(*shape), roof(*shape, slant=0.6), cliff):
        assert estimate_sigma(clean) < 6e-5
        for sigma in (0.001, 0.01, 0.1):
            found = [estimate_sigma(noisy(clean, seed, sigma)) for seed in range(8)]
            assert np.mean(found) == pytest.approx(sigma, rel=0.06)
            assert np.std(found) < 0.04 * sigma


@pytest.mark.parametrize("size", [16, 24, 40])
def test_waves_of_many_vertices_are_not_noise(size):
    u, v = parameters(size, size)
    around = np.pi * (size - 1) / 10  # Ten vertices to a wave.
    clean = np.stack([u, v, 0.06 * np.cos(around * u) * np.cos(around * v)], axis=-1)
    assert estimate_sigma(clean) < 2e-4


def test_estimates_do_not_care_for_unit_position_and_direction():
    dirty = noisy(wavy(20, 28))
    assert estimate_sigma(motion(dirty)[0]) == pytest.approx(300 * estimate_sigma(dirty), rel=1e-6)
    for turned in (dirty[::-1], np.swapaxes(dirty, 0, 1)):
        assert estimate_sigma(turned) == pytest.approx(estimate_sigma(dirty), rel=1e-12)
    for size in (1e-200, 1e200):
        assert estimate_sigma(size * dirty) == pytest.approx(size * estimate_sigma(dirty))


@pytest.mark.parametrize("shape", [(3, 3), (3, 4), (5, 3), (4, 30)])
def test_noise_of_small_grids(shape):
    found = [estimate_sigma(noisy(np.ones((*shape, 3)), seed)) for seed in range(200)]
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(SIGMA, rel=0.15)
    assert estimate_sigma(np.ones((*shape, 3))) == 0.0


def test_a_mesh_without_noise_hardly_moves():
    points, faces = patch_mesh(wavy(24, 24))
    for norm in ("l2", "l1"):
        moved = smooth_mesh(Mesh(points, faces), norm=norm).points - points
        assert np.abs(moved).max() < 0.01


def test_small_meshes_and_unused_vertices_survive():
    tetrahedron = np.vstack([np.zeros(3), np.eye(3), [5.0, 5.0, 5.0]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    for norm in ("l2", "l1"):
        result = smooth_mesh(Mesh(tetrahedron, faces), norm=norm)
        assert np.isfinite(result.points).all()
        np.testing.assert_allclose(result.points[4], tetrahedron[4])
    assert np.isfinite(smooth_mesh(Mesh(np.eye(3), [[0, 1, 2]])).points).all()


def test_a_mesh_weight_of_zero_changes_nothing_and_more_smooths_more():
    points, faces = patch_mesh(wavy(12, 12))
    dirty = noisy(points)
    results = [smooth_mesh(Mesh(dirty, faces), order=3, weight=w) for w in (0.0, 1e-4, 1e-1)]
    np.testing.assert_allclose(results[0].points, dirty, atol=1e-12)
    assert results[0].dof > results[1].dof > results[2].dof


def test_bad_input_is_named():
    bad = wavy(4, 4)
    bad[1, 2, 0] = np.nan
    with pytest.raises(MeshError, match=r"vertex \(1, 2\)"):
        smooth_grid(bad)
    for grids in (smooth_grid, estimate_sigma):
        with pytest.raises(MeshError, match="2 x 4"):
            grids(wavy(2, 4))
    with pytest.raises(MeshError, match=r"\(H, W, 3\), not \(4, 4\)"):
        smooth_grid(np.zeros((4, 4)))
    with pytest.raises(OptionError, match="order 1"):
        smooth_grid(wavy(4, 4), order=1)
    with pytest.raises(OptionError, match="order 4"):
        smooth_grid(wavy(4, 4), order=4, norm="l1")
    with pytest.raises(OptionError, match="weight"):
        smooth_grid(wavy(4, 4), weight=-1.0)
    with pytest.raises(OptionError, match="norm"):
        smooth_grid(wavy(4, 4), norm="l3")
    with pytest.raises(OptionError, match="order 4"):
        smooth_mesh(Mesh(wavy(4, 4).reshape(-1, 3), quads(4, 4)), order=4, norm="l1")

"""Flattening: truths that are known, peers, validity, frames, meshes of every kind."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gso
from gso import energy, metrics, parametrization
from gso.dataset import generate
from gso.mesh import Mesh
from gso.mesh.topology import corner_triangles
from gso.tasks import flatten
from gso.unknowns import Layout
from tests.conftest import cylinder, saddle, shuffled, sphere_cap

stretch = energy.registry()["stretch"]

Options = flatten.Options


def solve(surface, **more):
    return gso.tno.optimize(surface, task="flatten", **more)


def cone(n: int) -> np.ndarray:
    """A patch of a cone, its apex outside, rulings across the grid lines."""
    u, v = np.meshgrid(np.linspace(-0.6, 0.6, n), np.linspace(1.0, 1.8, n), indexing="ij")
    radius, angle = v + 0.2 * u, u + 0.5 * v
    slope = 0.6
    return np.stack(
        [
            slope * radius * np.cos(angle / slope),
            slope * radius * np.sin(angle / slope),
            radius * np.sqrt(1 - slope**2),
        ],
        axis=-1,
    )


def with_hole(mesh: Mesh) -> Mesh:
    """A mesh without the faces in its middle."""
    centre = np.stack([mesh.vertices[f].mean(axis=0) for f in mesh.faces])
    away = np.linalg.norm(centre - centre.mean(axis=0), axis=1)
    faces = mesh.faces[away > np.quantile(away, 0.08)]
    used, number = np.unique(faces, return_inverse=True)
    return Mesh(mesh.vertices[used], number.reshape(faces.shape))


def disk_mesh(n: int = 15) -> Mesh:
    """A disk of quads with an irregular vertex of valence three in the middle, bulged."""
    s = np.linspace(0.0, 1.0, n)
    u, v = np.meshgrid(s, s, indexing="ij")
    points, faces = [], []
    for k in range(3):
        a, b = (np.exp(2j * np.pi * (k + d) / 3) for d in (0, 1))
        z = (u * a + v * b).ravel() * (1 + 0.2 * (u * v).ravel())
        faces.append(gso.mesh.topology.grid_faces(n, n) + k * n * n)
        points.append(np.stack([z.real, z.imag, 0.3 * np.cos(2 * z.real) - 0.2 * z.imag**2], 1))
    v, f = np.concatenate(points), np.concatenate(faces)
    _, first, number = np.unique(v.round(9), axis=0, return_index=True, return_inverse=True)
    return Mesh(v[first], number.ravel()[f])


def libigl_arap(mesh: Mesh) -> np.ndarray:
    """Image by libigl's as-rigid-as-possible energy after 100 iterations."""
    import igl

    v, f = mesh.vertices.copy(), mesh.triangles.copy()
    loop = igl.boundary_loop(f)
    start = igl.harmonic(v, f, loop.astype(np.int64), igl.map_vertices_to_circle(v, loop), 1)
    area = np.linalg.norm(np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]]), axis=1)
    start = np.ascontiguousarray(start * np.sqrt(area.sum() / (2 * np.pi)))
    data = igl.ARAPData()
    data.max_iter = 100
    held = np.array([len(v) // 2], np.int32)
    igl.arap_precomputation(v, f, 2, held, data)
    return igl.arap_solve(np.ascontiguousarray(start[held]), data, start)


def figures(mesh: Mesh, flat: np.ndarray) -> np.ndarray:
    """Mean strain, its 99th percentile, edge-length error."""
    strain = metrics.principal_strains(mesh, flat)
    return np.array([strain.mean, strain.p99, metrics.edge_length_error(mesh, flat)])


@pytest.mark.parametrize("formulation", flatten.TASK.formulations)
def test_a_plane_comes_out_exactly(formulation):
    plane = saddle(17, 12, strength=0.0)
    sheared = plane @ Rotation.from_rotvec([0.3, 0.2, 0.1]).as_matrix() @ np.diag([1, 1.3, 0.8])
    result = solve(sheared, formulation=formulation)
    assert result.metrics["strain_max"] < 1e-6
    assert result.metrics["edge_length_error"] < 1e-7
    mesh = Mesh.from_grid(sheared)
    triangles = solve(Mesh(mesh.vertices, mesh.triangles), formulation=formulation)
    assert triangles.metrics["strain_max"] < 1e-6


@pytest.mark.parametrize("patch", [cylinder, cone])
def test_developable_patches_unroll_to_second_order(patch):
    strain = [solve(patch(n), options="accurate").metrics["strain_mean"] for n in (17, 33)]
    assert strain[1] < 1e-3
    assert strain[0] / strain[1] > 3.0
    result = solve(patch(33))
    assert result.metrics["strain_mean"] < 1e-3
    assert result.metrics["edge_length_error"] < 5e-4
    assert result.metrics["flipped_cells"] == 0


def test_cylinder_unrolls_to_the_arc_length():
    n = 41
    t = np.linspace(-1, 1, n)
    straight = np.stack(
        [np.broadcast_to(f[:, None], (n, 21)) for f in (np.sin(t), np.cos(t))]
        + [np.broadcast_to(np.linspace(0, 1, 21), (n, 21))],
        axis=-1,
    )
    flat = solve(straight, options="accurate").flat_grid
    chords = (n - 1) * 2 * np.sin(1 / (n - 1))
    exact = np.stack(
        np.meshgrid(np.linspace(0, chords, n), np.linspace(0, 1, 21), indexing="ij"), axis=-1
    )
    assert np.abs(flat - exact).max() < 1e-3


def test_better_than_libigl_on_random_surfaces(surfaces):
    ours, theirs = [], []
    for points in surfaces:
        mesh = Mesh.from_grid(points)
        ours.append(figures(mesh, solve(points).flat))
        theirs.append(figures(mesh, libigl_arap(mesh)))
    assert (np.mean(ours, axis=0) < np.mean(theirs, axis=0)).all()


@pytest.mark.parametrize("kind", ["triangles", "quads", "hole", "hole in triangles"])
def test_no_worse_than_libigl_on_general_meshes(kind, surfaces):
    mesh = disk_mesh() if "hole" in kind else shuffled(Mesh.from_grid(surfaces[2]))
    if "triangles" in kind:
        mesh = Mesh(mesh.vertices, mesh.triangles)
    if "hole" in kind:
        mesh = with_hole(mesh)
        assert len(mesh.boundary_loops) == 2
    if kind == "quads":
        mesh = Mesh(mesh.vertices, mesh.faces[1:])
    assert mesh.grid_index is None
    result = solve(mesh)
    assert result.metrics["flipped_cells"] == 0
    # Meshes that are finer in places have more triangles there: peaks weigh differently.
    slack = np.array([1.0, 1.03, 1.0])
    assert (figures(mesh, result.flat) <= slack * figures(mesh, libigl_arap(mesh))).all()


@pytest.mark.parametrize("formulation", flatten.TASK.formulations)
@pytest.mark.parametrize("norm", ["mixed", "l1", "l2"])
def test_nothing_turns_over_on_strongly_curved_surfaces(formulation, norm):
    curved = [s.sample(24) for s in generate(3, seed=77, max_loss_gc=3.0)]
    u, v = np.meshgrid(np.linspace(-0.6, 0.6, 20), np.linspace(-0.6, 0.6, 20), indexing="ij")
    curved.append(np.stack([u, v, np.sqrt(0.75 - u * u - v * v)], axis=-1))
    for points in curved:
        result = solve(points, formulation=formulation, options=Options(norm=norm))
        assert result.metrics["flipped_cells"] == 0
        assert metrics.corner_areas(result.flat, result.design.faces).min() > 0
        last = [p for p in result.history if p.stage == result.history[-1].stage]
        assert sum(result.energy.values()) <= last[0].energy * (1 + 1e-9)


def test_norms_do_what_they_say(surfaces):
    by_norm = {
        norm: np.mean(
            [figures(s, solve(s, options=Options(norm=norm)).flat) for s in surfaces], axis=0
        )
        for norm in ("mixed", "l1", "l2")
    }
    assert by_norm["l1"][0] < by_norm["mixed"][0] < by_norm["l2"][0]
    assert by_norm["mixed"][1] < by_norm["l2"][1] < by_norm["l1"][1]
    assert by_norm["mixed"][2] < by_norm["l2"][2]


def test_minimax_lowers_the_largest_strains(surfaces):
    for points in surfaces:
        strain = solve(points)
        least = solve(points, formulation="minimax")
        assert least.metrics["flipped_cells"] == 0
        assert least.metrics["strain_p99"] < 0.9 * strain.metrics["strain_p99"]
        assert least.metrics["strain_max"] < 0.8 * strain.metrics["strain_max"]
        # The lengths of the edges, which are not minimised, are distorted less, too.
        edges = strain.design.edges
        one, two = (_stretched(strain.design, x.flat, edges) for x in (strain, least))
        assert two < one


def _stretched(mesh, flat, edges):
    """Return the largest relative change of the lengths of edges."""
    here, there = (
        np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1) for x in (mesh.vertices, flat)
    )
    return np.abs(there / here - 1.0).max()


def test_lengths_reach_the_published_metric(surfaces):
    for points in surfaces:
        strain = solve(points).metrics
        lengths = solve(points, formulation="lengths").metrics
        assert lengths["loss_iso_cell"] < 0.2 * strain["loss_iso_cell"]
        assert lengths["flipped_cells"] == 0
    mesh = Mesh.from_grid(surfaces[0])
    triangles = Mesh(mesh.vertices, mesh.triangles)
    edges = [solve(triangles, formulation=f).metrics for f in flatten.TASK.formulations]
    assert edges[1]["edge_length_error"] < edges[0]["edge_length_error"]
    assert "loss_iso_cell" not in edges[0]


def test_pattern_does_not_depend_on_the_frame(surfaces):
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    for mesh in (Mesh.from_grid(surfaces[0]), disk_mesh(9)):
        here = solve(mesh).flat
        for factor, shift in ((1000.0, 0.0), (1e-3, 5.0)):
            moved = mesh.replaced(factor * (mesh.vertices @ turn.T) + shift)
            assert np.abs(solve(moved).flat / factor - here).max() < 1e-5 * np.ptp(here)


def test_resolution_does_not_change_the_pattern():
    surface = generate(1, seed=3)[0]
    fine, coarse = (solve(surface.sample(n)).flat_grid for n in (65, 33))
    assert np.abs(fine[::2, ::2] - coarse).max() < 5e-3


def test_grids_lie_like_their_rectangle():
    points = saddle(21, 15)
    flat = solve(points).flat_grid
    start = parametrization.rectangle(points)
    assert flat.reshape(-1, 2).min(axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)
    centred = flat - flat.mean(axis=(0, 1)), start - start.mean(axis=(0, 1))
    assert np.abs(centred[0] - centred[1]).max() < 0.2
    reordered = shuffled(Mesh.from_grid(points))
    assert reordered.grid_index is not None
    again = solve(reordered)
    spans = sorted(np.ptp(again.flat, axis=0)), sorted(np.ptp(flat.reshape(-1, 2), axis=0))
    assert spans[0] == pytest.approx(spans[1], rel=1e-6)


def test_long_axis_of_a_mesh_lies_along_x():
    mesh = Mesh.from_grid(saddle(9, 21, strength=0.2) * [0.4, 1.0, 1.0])
    flat = solve(Mesh(mesh.vertices, mesh.triangles)).flat
    span = np.ptp(flat, axis=0)
    assert span[0] > 2 * span[1]
    assert flat.min(axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_start_is_used_unless_it_has_flips(surfaces):
    cold = solve(surfaces[1], options="accurate")
    angle = 2.0
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = cold.flat @ turn.T + 3.0
    warm = solve(surfaces[1], x0=moved)
    assert warm.iterations <= 2
    assert np.abs(warm.flat - moved).max() < 1e-3
    stretched = solve(surfaces[1], x0=cold.flat * [1.6, 0.7], options="accurate")
    assert sum(stretched.energy.values()) == pytest.approx(sum(cold.energy.values()), rel=1e-3)
    mirrored = solve(surfaces[1], x0=cold.flat[:, ::-1])
    assert any("x0" in note for note in mirrored.notes)
    assert mirrored.metrics["flipped_cells"] == 0


def test_components_lie_side_by_side_and_loose_vertices_at_the_origin():
    one, two = Mesh.from_grid(saddle(9)), disk_mesh(6)
    n = len(one.vertices)
    loose = [[40.0, 0.0, 0.0]]
    both = Mesh(
        np.concatenate([one.vertices, loose, two.vertices + 0.1]),
        np.concatenate([one.faces, two.faces + n + 1]),
    )
    result = solve(both)
    text = " ".join(result.notes)
    assert "side by side" in text
    assert "origin" in text
    first, second = result.flat[:n], result.flat[n + 1 :]
    assert first[:, 0].max() < second[:, 0].min()
    assert (result.flat[n] == 0).all()
    assert result.metrics["flipped_cells"] == 0


def test_arrow_shaped_quads_keep_their_shape():
    plane = saddle(7, strength=0.0)
    plane[3, 3] += [0.25, 0.25, 0.0]
    mesh = Mesh(plane.reshape(-1, 3), gso.mesh.topology.grid_faces(7, 7)[1:])
    assert stretch.corner_shares(mesh.vertices, mesh.faces).min() < 0
    result = solve(mesh, options="accurate")
    assert result.metrics["flipped_cells"] == 0
    assert result.metrics["edge_length_error"] < 1e-6


def test_what_cannot_be_flattened_is_said():
    box = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    with pytest.raises(gso.MeshError, match=r"closed.*cut it open"):
        solve(Mesh(box, np.array(sides)))
    n, m = 12, 8
    a, b = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    torus = np.stack(
        [(2 + np.cos(b)) * np.cos(a), (2 + np.cos(b)) * np.sin(a), np.sin(b)], -1
    ).reshape(-1, 3)
    ids = np.arange(n * m).reshape(n, m)
    right, up = np.roll(ids, -1, axis=0), np.roll(ids, -1, axis=1)
    quads = np.stack([ids, right, np.roll(right, -1, axis=1), up], -1).reshape(-1, 4)
    with pytest.raises(gso.MeshError, match=r"1 handle .*cut it open"):
        solve(Mesh(torus, quads[1:]))
    with pytest.raises(gso.OptionError, match=r"constraint 0 \(Fixed\).*Handle"):
        solve(saddle(5), constraints=[gso.Fixed([0])])
    for wrong in ({"norm": "l7"}, {"eps": 0.0}, {"coarse_size": 2}, {"w_edges": -1.0}):
        with pytest.raises(gso.OptionError):
            Options(**wrong)


@pytest.mark.parametrize("shape", [(3, 3), (3, 40), (5, 4)])
@pytest.mark.parametrize("formulation", flatten.TASK.formulations)
def test_small_grids(shape, formulation):
    result = solve(saddle(*shape), formulation=formulation)
    assert result.metrics["flipped_cells"] == 0
    assert np.isfinite(result.flat).all()


@pytest.mark.parametrize("backend", ["banded", "superlu"])
def test_backends_agree(backend, surfaces):
    one = solve(surfaces[2], options=Options(backend=backend))
    assert one.backend == backend
    assert np.abs(one.flat - solve(surfaces[2]).flat).max() < 1e-6


def test_orientation_limit_is_the_first_collapse():
    flat = np.array([[0.0, 0], [1, 0], [0, 1], [1, 1]])
    triangles = np.array([[0, 1, 2], [1, 3, 2]])
    limit = parametrization.orientation(triangles, Layout((("flat", 4, 2),)))
    move = np.zeros((4, 2))
    assert limit(flat.ravel(), move.ravel()) == 1.0
    move[2] = [0.0, -2.0]
    assert limit(flat.ravel(), move.ravel()) == pytest.approx(parametrization.SAFETY * 0.5)
    rng = np.random.default_rng(0)
    cells = corner_triangles(gso.mesh.topology.grid_faces(6, 6))
    limit = parametrization.orientation(cells, Layout((("flat", 36, 2),)))
    flat = np.stack(np.meshgrid(np.arange(6.0), np.arange(6.0), indexing="ij"), -1).reshape(-1, 2)
    steps = []
    for _ in range(20):
        move = rng.standard_normal(flat.shape) * rng.choice([0.2, 1.0, 30.0])
        step = limit(flat.ravel(), move.ravel())
        areas = [metrics.corner_areas(flat + s * move, cells).min() for s in (step, step / 0.9)]
        assert areas[0] > 0
        steps.append(step)
        assert step == 1.0 or areas[1] < 1e-9
    assert min(steps) < 1.0


@pytest.mark.parametrize(
    "loss",
    [
        stretch.TwoPowerLoss(0.02),
        stretch.TwoPowerLoss(0.1, knee=np.inf, eps=0.03),
        stretch.PowerLoss(0.05, 2.0),
        stretch.PowerLoss(0.05, 4.0),
        stretch.PowerLoss(0.05, 16.0),
    ],
)
def test_spread_has_the_derivative_it_says(loss):
    r = np.random.default_rng(1).standard_normal((12, 5)) * 0.05
    first, second = loss.weights(r)
    for k in range(12):
        step = np.zeros_like(r)
        step[k] = 1e-7
        slope = (loss.value(r + step) - loss.value(r - step)).sum(axis=0) / 2e-7
        np.testing.assert_allclose(first[k], slope, rtol=1e-5, atol=1e-9)
    assert (second > 0).all()
    assert loss.value(0 * r).sum() == 0.0


def test_starts_are_valid_and_relaxing_lowers_their_strain():
    mesh = with_hole(disk_mesh(11))
    triangles = corner_triangles(mesh.faces)
    start = parametrization.embeddings(mesh, triangles, triangles)[0]
    assert metrics.corner_areas(start, triangles).min() > 0
    before = parametrization.strain_level(mesh.vertices, triangles, start)
    relaxed = parametrization.relax(mesh.vertices, triangles, start)
    assert metrics.corner_areas(relaxed.flat, triangles).min() > 0
    assert relaxed.level < before
    assert relaxed.level == pytest.approx(
        parametrization.strain_level(mesh.vertices, triangles, relaxed.flat)
    )


def test_steps_near_the_image_need_no_factorisation():
    mesh = Mesh.from_grid(sphere_cap(33))
    triangles = corner_triangles(mesh.faces)
    good = parametrization.relax(mesh.vertices, triangles, mesh.vertices[:, :2])
    noisy = good.flat + 1e-3 * np.random.default_rng(0).standard_normal(good.flat.shape)
    for near in (False, True):
        steps = parametrization.quasi_newton.QuasiNewton(
            mesh.vertices, triangles, triangles, near=near
        )
        again = steps.lower(noisy, iterations=8, tolerance=1e-3)
        assert again.level < 1.1 * good.level
        assert again.level == pytest.approx(parametrization.strain(mesh, again.flat))
    assert parametrization.strain(mesh, noisy) > 2.0 * good.level


def test_low_strain_is_as_low_as_that_of_the_task():
    """On results of the recipe, from which patterns are made."""
    ratios = []
    for shape in generate(5, seed=43):
        mesh = gso.tno.optimize(shape.sample(40), options="fast", verdict=False).mesh
        image = parametrization.low_strain(mesh).flat
        assert not metrics.flips(mesh, image)
        task = solve(mesh, options="fast").flat
        found, known = (metrics.strains(mesh, flat) for flat in (image, task))
        ratios.append([found[k] / known[k] for k in ("strain_max", "strain_p99", "strain_mean")])
    assert (np.median(ratios, axis=0) <= [1.0, 1.0, 1.02]).all()
    assert np.max(ratios) <= 1.1


@pytest.mark.parametrize("make", [disk_mesh, lambda: with_hole(disk_mesh(11))])
def test_low_strain_of_meshes_that_are_no_grids(make):
    mesh = make()
    image = parametrization.low_strain(mesh)
    found, known = (
        metrics.strains(mesh, flat) for flat in (image.flat, solve(mesh, options="fast").flat)
    )
    assert not metrics.flips(mesh, image.flat)
    assert found["strain_mean"] <= 1.02 * known["strain_mean"]
    assert found["strain_max"] <= 1.05 * known["strain_max"]


def test_components_have_low_strain_as_they_have_alone():
    one, two = Mesh.from_grid(cone(21)), disk_mesh(9)
    count = len(one.vertices)
    both = Mesh(
        np.r_[two.vertices + 5.0, one.vertices], np.r_[two.faces, one.faces + len(two.vertices)]
    )
    image = parametrization.low_strain(both).flat
    for mesh, own in ((two, image[:-count]), (one, image[-count:])):
        alone = metrics.strains(mesh, parametrization.low_strain(mesh).flat)
        assert metrics.strains(mesh, own)["strain_max"] == pytest.approx(
            alone["strain_max"], rel=0.05, abs=1e-6
        )


def test_tutte_image_always_exists(monkeypatch):
    mesh = with_hole(disk_mesh(9))
    rng = np.random.default_rng(4)
    rough = mesh.replaced(mesh.vertices + 0.05 * rng.standard_normal(mesh.vertices.shape))
    outer = max(rough.boundary_loops, key=len)
    turn = np.linspace(0.0, 2.0 * np.pi, len(outer), endpoint=False)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    for _ in range(2):
        image = parametrization.spanned(rough, outer, circle)
        assert metrics.corner_areas(image, rough.faces).min() > 0
        # Tutte's image is the one that is left without the harmonic one.
        monkeypatch.setattr("gso.parametrization.embedding._harmonic", lambda *_: None)


def test_a_cap_of_a_sphere_strains_as_little_as_it_must():
    result = solve(sphere_cap(25))
    assert result.metrics["strain_mean"] < 0.01
    assert result.details["strain_level"] == pytest.approx(result.metrics["strain_mean"], rel=0.5)

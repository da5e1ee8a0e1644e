"""The joint isometry solve of Jiang et al. 2020, and flat images by isometry."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gso
from gso import energy, metrics
from gso.dataset import generate
from gso.mesh import Nearest, vertex_normals

proximity = energy.registry()["proximity"]

JOINT = {"formulation": "isometry"}
FLAT = {"task": "flatten", "formulation": "isometry"}


def square(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    return np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")


def cylinder(rows: int, columns: int, skew: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Grid on a cylinder of radius 1 and its smooth unrolling."""
    u, v = square(rows, columns)
    s, z = 2.0 * (u + skew * v), 1.5 * v
    return np.stack([np.cos(s), np.sin(s), z], -1), np.stack([s, z], -1)


def cylinder_polyhedron(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """The same along rulings, unrolled as the prism that its faces make."""
    points, flat = cylinder(rows, columns)
    step = 2.0 / (rows - 1)
    return points, flat * [2.0 * np.sin(step / 2.0) / step, 1.0]


def cone_polyhedron(rows: int, columns: int, angle: float = 0.6) -> tuple[np.ndarray, np.ndarray]:
    """Grid along the rulings of a cone, unrolled as the pyramid that its faces make."""
    u, v = square(rows, columns)
    u, v = 2.0 * u, 0.5 + v
    across = np.sin(angle) * np.stack([np.cos(u), np.sin(u)], -1)
    rulings = np.dstack([across, np.full(u.shape, np.cos(angle))])
    turn = np.arccos(rulings[0, 0] @ rulings[1, 0]) * np.arange(rows)[:, None] + 0.0 * v
    return v[..., None] * rulings, v[..., None] * np.stack([np.cos(turn), np.sin(turn)], -1)


def tangent_developable(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Tangents of a helix, parametrised across the rulings, and their smooth unrolling."""
    u, v = square(size, size)
    t, s = 1.2 * u, 0.4 + 0.8 * v + 0.36 * u
    a, b = 1.0, 0.5
    length = np.hypot(a, b)
    tangent = np.stack([-a * np.sin(t), a * np.cos(t), b + 0.0 * t], -1) / length
    points = np.stack([a * np.cos(t), a * np.sin(t), b * t], -1) + s[..., None] * tangent
    radius = (a * a + b * b) / a
    turn = length * t / radius
    along = np.stack([-np.sin(turn), np.cos(turn)], -1)
    flat = radius * np.stack([np.cos(turn), np.sin(turn)], -1) + s[..., None] * along
    return points, flat


def cap(size: int) -> np.ndarray:
    """Piece of the unit sphere."""
    u, v = square(size, size)
    u, v = 1.2 * u - 0.6, 1.2 * v - 0.6
    return np.stack([u, v, np.sqrt(1.0 - u * u - v * v)], -1)


def apart(flat: np.ndarray, wanted: np.ndarray) -> float:
    """Largest distance after the best motion of the plane, relative to the size."""
    p, q = (x.reshape(-1, 2) - x.reshape(-1, 2).mean(axis=0) for x in (flat, wanted))
    found = []
    for mirror in ([1, 1], [1, -1]):
        u, _, vt = np.linalg.svd(p.T @ (q * mirror))
        found.append(np.abs(p @ u @ vt - q * mirror).max())
    return min(found) / np.linalg.norm(q, axis=1).max()


@pytest.fixture(scope="module")
def curved() -> np.ndarray:
    return generate(3, seed=5)[2].sample(24)


@pytest.fixture(scope="module")
def classical(curved) -> gso.Result:
    """The reference of the curved surface; no test may change it."""
    return gso.tno.optimize(curved, options="jiang2020")


@pytest.fixture(scope="module")
def irregular():
    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
    import irregular

    yield irregular
    sys.path.pop(0)


class TestTruths:
    @pytest.mark.parametrize("shape", [cylinder_polyhedron, cone_polyhedron])
    @pytest.mark.parametrize("options", ["balanced", "jiang2020"])
    def test_polyhedra_along_rulings_unroll_exactly(self, shape, options):
        points, flat = shape(25, 17)
        pattern = gso.tno.optimize(points, **FLAT, options=options)
        assert apart(pattern.flat_grid, flat) <= 1e-6
        assert pattern.metrics["flipped_cells"] == 0
        assert not pattern.notes

    @pytest.mark.parametrize("shape", [cylinder_polyhedron, cone_polyhedron])
    @pytest.mark.parametrize("options", ["balanced", "jiang2020"])
    def test_developable_designs_come_back_untouched_with_their_unrolling(self, shape, options):
        points, flat = shape(25, 17)
        result = gso.tno.optimize(points, **JOINT, options=options)
        assert result.status is gso.Status.ALREADY_GOOD
        np.testing.assert_array_equal(result.grid, points)
        assert apart(result.flat_grid, flat) <= 1e-6
        assert result.metrics["isometry_energy"] < 1e-12

    @pytest.mark.parametrize("shape", [lambda n: cylinder(n, n, 0.3), tangent_developable])
    def test_smooth_unrollings_are_approached_at_second_order(self, shape):
        errors = []
        for size in (13, 25, 49):
            points, flat = shape(size)
            result = gso.tno.optimize(points, options="jiang2020")
            assert result.status is gso.Status.ALREADY_GOOD
            pattern = gso.tno.optimize(points, **FLAT, options="accurate")
            errors.append((apart(result.flat_grid, flat), apart(pattern.flat_grid, flat)))
        orders = -np.diff(np.log2(errors), axis=0)
        assert orders.min() > 1.8

    def test_a_sphere_cannot_be_flattened_and_the_result_says_so(self):
        pattern = gso.tno.optimize(cap(17), **FLAT)
        assert any("not developable" in note and "%" in note for note in pattern.notes)
        assert pattern.metrics["strain_mean"] > 0.01

    def test_a_sphere_becomes_developable_only_by_moving(self):
        result = gso.tno.optimize(cap(25), options="jiang2020")
        assert result.metrics["isometry_energy"] < 1e-5
        assert result.metrics["distance_max"] > 2.0
        assert result.metrics["loss_gc"] < 0.3 * result.metrics["loss_gc_before"]

    def test_edges_that_the_diagonals_do_not_hold_are_remarked(self):
        narrow = generate(3, seed=5)[2].sample(65)[:, ::8]
        pattern = gso.tno.optimize(narrow, **FLAT)
        assert metrics.isometry_energy(narrow, pattern.flat_grid) < (2 * 2e-3) ** 2
        assert pattern.metrics["edge_length_error"] > 0.01
        assert any("not developable" in note for note in pattern.notes)

    def test_a_ring_is_told_to_be_cut(self, irregular):
        result = gso.tno.optimize(irregular.with_hole(), options="fast", **JOINT)
        assert any("cut open" in note for note in result.notes)


class TestJoint:
    def test_surface_and_flat_image_are_isometric(self, curved, classical):
        result = classical
        m = result.metrics
        assert result.formulation == "isometry"
        assert m["loss_gc"] < 0.2 * m["loss_gc_before"]
        assert m["isometry_energy"] < 1e-5
        assert m["parallelogram_strain"] < 3e-3
        assert m["flipped_cells"] == 0
        assert result.flat_grid.shape == (*curved.shape[:2], 2)
        assert set(result.energy) == {"isometry", "mapping", "fairness", "closest", "proximity"}
        assert metrics.isometry_energy(result.mesh, result.flat) == pytest.approx(
            m["isometry_energy"]
        )

    def test_other_presets_start_from_the_curvature_solution(self, curved):
        result = gso.tno.optimize(curved, **JOINT)
        assert result.metrics["loss_gc"] < 0.2 * result.metrics["loss_gc_before"]
        assert metrics.isometry_energy(result.mesh, result.pattern.flat) < 1e-5
        stages = [p.name for p in result.history]
        assert "normal" in stages[: len(stages) // 2 + 1]
        # It never has more curvature than the usual result, unless that halves the strain.
        usual = gso.tno.optimize(curved)
        one, two = (r.metrics for r in (result, usual))
        curved_more = one["loss_gc_worst"] > 1.5 * two["loss_gc_worst"]
        assert not curved_more or one["strain_max"] < 0.5 * two["strain_max"]

    def test_a_moved_scaled_and_renumbered_copy_gives_the_same_shape(self, curved, classical):
        mesh = gso.Mesh.from_grid(curved)
        turn = Rotation.from_rotvec([0.4, -1.1, 0.3])
        order = np.random.default_rng(0).permutation(len(mesh.vertices))
        number = np.argsort(order)
        moved = turn.apply(1e3 * mesh.vertices)[order] + [5e4, -2e4, 1e4]
        here = classical
        there = gso.tno.optimize((moved, number[mesh.faces]), options="jiang2020")
        back = turn.inv().apply(there.mesh.vertices[number] - [5e4, -2e4, 1e4]) / 1e3
        assert np.abs(back - here.mesh.vertices).max() < 1e-6 * mesh.diagonal
        assert apart(there.flat[number] / 1e3, here.flat) < 1e-5

    def test_keeps_hard_constraints(self, curved):
        mesh = gso.Mesh.from_grid(curved)
        corner = mesh.grid_index[:2, :2].ravel()
        other = mesh.grid_index[-1:, -1]
        place = mesh.vertices[other] + 0.02 * mesh.diagonal
        held = [gso.Fixed(corner), gso.Handle(other, place)]
        result = gso.tno.optimize(mesh, options="jiang2020", constraints=held)
        np.testing.assert_allclose(
            result.mesh.vertices[corner], mesh.vertices[corner], atol=1e-12 * mesh.diagonal
        )
        np.testing.assert_allclose(result.mesh.vertices[other], place, atol=1e-12 * mesh.diagonal)
        assert result.metrics["isometry_energy"] < 1e-5

    def test_irregular_vertices_and_holes(self, irregular):
        vertices, faces = irregular.disk_with_hole()
        mesh = gso.Mesh(vertices, faces)
        assert len(mesh.boundary_loops) == 2
        valence = np.bincount(mesh.edges.ravel())
        assert {3, 5} <= set(valence.tolist())
        result = gso.tno.optimize(mesh, options="jiang2020")
        assert result.metrics["loss_gc"] < 0.15 * result.metrics["loss_gc_before"]
        assert result.metrics["isometry_energy"] < 1e-6
        assert result.metrics["flipped_cells"] == 0

    def test_triangle_meshes_keep_their_sides(self, curved):
        grid = gso.Mesh.from_grid(curved)
        result = gso.tno.optimize((grid.vertices, grid.triangles), options="jiang2020")
        assert result.metrics["loss_gc"] < 0.3 * result.metrics["loss_gc_before"]
        assert result.metrics["edge_length_error"] < 5e-3
        assert "loss_iso_cell" not in result.metrics

    def test_a_spline_can_be_isometric_to_the_plane(self, curved):
        options = gso.IsometryOptions(variables="surface", controls=10)
        result = gso.tno.optimize(curved, options=options)
        assert result.formulation == "isometry"
        np.testing.assert_allclose(result.spline.sample(*curved.shape[:2]), result.grid, atol=1e-9)
        assert result.metrics["loss_gc"] < 0.3 * result.metrics["loss_gc_before"]

    def test_fairness_falls_until_the_defect_is_small_enough(self, curved):
        options = gso.IsometryOptions.preset("jiang2020")
        often = gso.tno.optimize(curved, options=replace(options, isometry_threshold=0.0))
        once = gso.tno.optimize(curved, options=replace(options, isometry_threshold=1.0))
        last = [p.name for p in often.history][-1], [p.name for p in once.history][-1]
        assert last == ("24x24, fairness 1e-04", "24x24, fairness 1e-03")

    def test_nothing_is_promised_that_only_the_start_keeps(self):
        noise = 1e-3 * np.random.default_rng(0).standard_normal((15, 15))
        sheet = np.dstack([*square(15, 15), noise])
        assert any("but for noise" in note for note in gso.tno.optimize(sheet).notes)
        assert gso.tno.optimize(sheet, **JOINT).notes == ()

    def test_a_spline_is_the_result_although_fairness_need_not_fall(self, curved):
        options = gso.IsometryOptions(variables="surface", controls=6, isometry_threshold=1.0)
        result = gso.tno.optimize(curved, options=options)
        np.testing.assert_allclose(result.spline.sample(*curved.shape[:2]), result.grid, atol=1e-9)

    @pytest.mark.parametrize("kept", [[0, 0, 0], [1, 0, 0]])
    def test_a_start_without_area_is_refused(self, curved, kept):
        with pytest.raises(gso.MeshError, match=r"x0.* no area"):
            gso.tno.optimize(curved, options="jiang2020", x0=curved * kept)

    def test_warm_start(self, curved, classical):
        cold = classical
        options = replace(gso.IsometryOptions.preset("jiang2020"), w_fairness_start=1e-4)
        warm = gso.tno.optimize(curved, options=options, x0=cold.mesh)
        assert warm.iterations < cold.iterations
        assert sum(warm.energy.values()) <= 1.01 * sum(cold.energy.values())

    def test_file_keeps_surface_and_flat_image(self, classical, tmp_path):
        result = classical
        result.save(tmp_path / "panel.npz")
        again = gso.Result.load(tmp_path / "panel.npz")
        np.testing.assert_array_equal(again.flat, result.flat)
        np.testing.assert_array_equal(again.mesh.vertices, result.mesh.vertices)
        result.save(tmp_path / "pattern.svg")
        result.save(tmp_path / "panel.obj")
        assert np.ptp(gso.load(tmp_path / "panel.obj").vertices[:, 2]) > 0

    def test_a_file_whose_flat_image_does_not_fit_is_refused(self, curved, tmp_path):
        gso.tno.optimize(curved[:4, :4], options="jiang2020").save(tmp_path / "panel.npz")
        arrays = dict(np.load(tmp_path / "panel.npz"))
        np.savez(tmp_path / "panel.npz", **{**arrays, "flat": arrays["flat"][:3]})
        with pytest.raises(gso.MeshError, match=r"panel\.npz .*flat is an array \(3, 2\)"):
            gso.Result.load(tmp_path / "panel.npz")


class TestOptions:
    def test_the_reference_preset_is_frozen(self):
        o = gso.IsometryOptions.preset("jiang2020")
        weights = (o.w_isometry, o.w_mapping, o.w_fairness, o.w_fairness_start, o.w_flat)
        assert weights == (100.0, 3.0, 1e-4, 1e-3, 0.01)
        assert (o.w_closest, o.w_place, o.isometry_threshold) == (0.5, 0.5, 1e-8)
        assert (o.iterations, o.coarse_iterations, o.coarse_size) == (15, 12, 32)
        assert (o.begin, o.variables, o.tolerance) == ("design", "free", 1e-3)

    def test_the_formulation_follows_from_the_options(self, curved):
        assert gso.tno.check("developable", None, "jiang2020").formulation == "isometry"
        assert gso.tno.check("developable", None, gso.IsometryOptions()).formulation == "isometry"
        assert gso.tno.check("flatten", None, "jiang2020").formulation == "isometry"
        assert gso.tno.check("developable", None, "fast").formulation == "curvature"

    @pytest.mark.parametrize(
        ("keywords", "message"),
        [
            ({"formulation": "curvature", "options": "jiang2020"}, "those of the formulation"),
            (
                {"formulation": "isometry", "options": gso.DevelopableOptions()},
                r"joint_isometry\.Options.*not gso\.tasks\.developable\.options\.Options",
            ),
            (
                {"formulation": "isometry", "max_deviation": 0.1, "target_curvature": 0.1},
                "curvature",
            ),
            ({"options": "jiang2020", "target_curvature": 0.1}, "curvature"),
            ({"formulation": "isometrie"}, "no formulation"),
        ],
    )
    def test_contradictions_are_refused(self, curved, keywords, message):
        with pytest.raises(gso.OptionError, match=message):
            gso.tno.optimize(curved, **keywords)

    @pytest.mark.parametrize(
        "wrong",
        [
            {"begin": "there"},
            {"variables": "normal"},
            {"controls": 3},
            {"w_isometry": 0.0},
            {"w_closest": 0.0, "w_place": 0.0},
        ],
    )
    def test_bad_settings_are_refused(self, wrong):
        with pytest.raises(gso.OptionError, match=next(iter(wrong))):
            gso.IsometryOptions(**wrong)

    def test_a_closed_surface_has_no_flat_image(self):
        import trimesh

        ball = trimesh.creation.icosphere(2)
        with pytest.raises(gso.MeshError, match=r"closed|boundary|cut"):
            gso.tno.optimize(ball, options="jiang2020")


class TestNearest:
    def test_feet_on_a_sphere(self):
        mesh = gso.Mesh.from_grid(cap(41))
        rng = np.random.default_rng(0)
        inner = mesh.vertices[mesh.grid_index[5:-5:3, 5:-5:3].ravel()]
        away = rng.uniform(0.9, 1.1, len(inner))
        feet = Nearest(mesh, vertex_normals(mesh)).feet(away[:, None] * inner)
        np.testing.assert_allclose(feet.distances, np.abs(away - 1.0), atol=1e-3)
        np.testing.assert_allclose(feet.points, inner, atol=2e-3)
        np.testing.assert_allclose(np.abs((feet.normals * inner).sum(axis=1)), 1.0, atol=1e-3)

    def test_closest_follows_vertices_that_slide(self):
        mesh = gso.Mesh.from_grid(np.dstack([*square(9, 9), np.zeros((9, 9))]))
        term = proximity.closest(mesh, vertex_normals(mesh), tangential=0.0)
        slid = mesh.vertices * [0.5, 0.5, 1.0] + [0.2, 0.2, 0.1]
        constants = term.refresh({"surface": slid})
        residual = term.residual([tuple(slid.T)], constants)
        np.testing.assert_allclose(np.abs(residual[2]), 0.1)
        np.testing.assert_allclose(residual[:2], 0.0, atol=1e-12)


class TestBounds:
    """`max_deviation` and `max_strain` by isometry."""

    def test_the_deviation_is_held_both_ways(self, curved):
        mesh = gso.Mesh.from_grid(curved)
        bound = 0.02 * mesh.diagonal
        result = gso.tno.optimize(mesh, formulation="isometry", max_deviation=bound)
        far = gso.metrics.surface_distance(mesh, result.mesh)
        assert max(far.there_max, far.back_max) <= bound * (1 + 1e-6)
        assert result.metrics["loss_gc_worst"] < 0.5 * result.metrics["loss_gc_worst_before"]

    def test_hard_constraints_are_refused_with_it(self, curved):
        with pytest.raises(gso.OptionError, match="FixedBoundary"):
            gso.tno.optimize(
                curved,
                formulation="isometry",
                max_deviation=0.1,
                constraints=[gso.FixedBoundary()],
            )

"""The search for seams, and designs in pieces that become developable."""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest
from click.testing import CliRunner

import gso
from gso import OptionError, faults, metrics
from gso.cli import main
from gso.mesh import Mesh, Paths, between
from gso.seams import Path
from gso.seams.potential import Potential
from gso.seams.tree import Ground, cut_tree
from gso.verdict import Code
from tests.conftest import codes, rotation, saddle, shuffled, sphere_cap
from tests.test_seams import ball, cube


def dome(n: int = 21, height: float = 0.35) -> Mesh:
    """A dome of quads over the square."""
    u, v = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    return gso.as_mesh(np.stack([u, v, height * (1 - u * u) * (1 - v * v)], axis=-1))


def triangulated(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices, mesh.triangles)


@cache
def ball_in_pieces(max_strain: float, darts: bool) -> gso.seams.Segmentation:
    """A ball that keeps its shape, searched once; no test may change it."""
    return gso.pieces(ball(16), max_strain=max_strain, darts=darts)


def torus(around: int = 36, across: int = 16) -> Mesh:
    """A torus of quads, radii 1 and 0.4."""
    a, b = np.meshgrid(
        2 * np.pi * np.arange(around) / around,
        2 * np.pi * np.arange(across) / across,
        indexing="ij",
    )
    ring = 1 + 0.4 * np.cos(b)
    points = np.stack([ring * np.cos(a), ring * np.sin(a), 0.4 * np.sin(b)], axis=-1)
    k = np.arange(around * across).reshape(around, across)
    on, up = np.roll(k, -1, axis=0), np.roll(k, -1, axis=1)
    both = np.roll(on, -1, axis=1)
    return Mesh(points.reshape(-1, 3), np.stack([k, on, both, up], axis=-1).reshape(-1, 4))


def plate_with_handles() -> Mesh:
    """The surface of a thick square plate with three square holes: genus 3."""
    solid = np.ones((7, 3, 1), bool)
    solid[[1, 3, 5], 1, 0] = False
    full = np.pad(solid, 1)
    corners, faces = {}, []
    for axis in range(3):
        for sign in (1, -1):
            for i, j, k in np.argwhere(full & ~np.roll(full, -sign, axis=axis)):
                one, two = np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]]
                base = np.array([i, j, k]) + (sign > 0) * np.eye(3, dtype=int)[axis]
                loop = [base, base + one, base + one + two, base + two][::sign]
                faces.append([corners.setdefault(tuple(p), len(corners)) for p in loop])
    return Mesh(np.array(list(corners), float), np.array(faces))


def sound(found) -> None:
    """Every piece is a disk, nothing overlaps, and the strain is what the metrics say."""
    assert all(piece.is_disk for piece in found)
    for piece, sheet in zip(found, found.sheets, strict=True):
        np.testing.assert_array_equal(piece.mesh.faces, sheet.mesh.faces)
        assert not faults.overlaps(sheet.mesh, sheet.flat).size
        assert not metrics.flipped_faces(sheet.mesh, sheet.flat).size
        # A second measure of the strain: lengths of edges.
        a, b = piece.mesh.edges.T
        before = np.linalg.norm(piece.mesh.vertices[a] - piece.mesh.vertices[b], axis=1)
        after = np.linalg.norm(sheet.flat[a] - sheet.flat[b], axis=1)
        assert np.abs(after / before - 1).max() <= 1.1 * sheet.strain + 1e-9
    worst = max(sheet.strain for sheet in found.sheets)
    assert found.metrics["strain_max"] == pytest.approx(worst)


def test_the_potential_of_a_cap_is_known():
    """On a spherical cap the conformal factor is that of the stereographic projection."""
    angle, radius = 0.5, 2.0
    t, a = np.meshgrid(np.linspace(0, angle, 30)[1:], 2 * np.pi * np.arange(60) / 60)
    ring = np.stack([np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), np.cos(t)], axis=-1)
    points = radius * np.concatenate([[[0, 0, 1.0]], ring.reshape(-1, 3)])
    from scipy.spatial import Delaunay

    mesh = Mesh(points, Delaunay(points[:, :2]).simplices)
    field = Potential(mesh)
    scale = field.solve(mesh.half_edges.boundary_vertex)
    exact = -2.0 * np.log(1.0 / np.cos(angle / 2))
    assert scale[0] == pytest.approx(exact, rel=0.01)
    assert field.area.sum() == pytest.approx(2 * np.pi * radius**2 * (1 - np.cos(angle)), rel=0.01)


def test_a_flat_sheet_needs_no_cut():
    found = gso.pieces(np.dstack([*np.mgrid[:6.0, :9.0], np.zeros((6, 9))]))
    assert (len(found), found.seam_length, found.usable) == (1, 0.0, True)
    assert found.sheets[0].size == pytest.approx((8.0, 5.0))


def test_a_sphere_becomes_one_piece_with_darts():
    mesh = ball(24)
    found = gso.pieces(mesh, max_strain=0.03, darts=True)
    sound(found)
    assert len(found) == 1
    assert found.usable
    assert found.metrics["strain_max"] <= 0.03
    # Strips of the same strain and no waste would be sqrt(pi / 0.03) / 2 long.
    assert found.seam_length < 1.6 * 0.5 * np.sqrt(np.pi / 0.03)
    # The area of the pattern is the surface's, up to the strain.
    flat = found.patterns[0].mesh
    assert metrics.area(flat) == pytest.approx(metrics.area(mesh), rel=0.06)


def test_less_strain_takes_longer_seams():
    lengths = [gso.pieces(dome(), max_strain=s, darts=True).seam_length for s in (0.04, 0.01)]
    assert lengths[0] < lengths[1]


def test_without_darts_no_seam_ends_inside():
    found = ball_in_pieces(0.03, darts=False)
    sound(found)
    assert found.usable
    assert len(found) > 1
    assert (found.sides[:, 0] != found.sides[:, 1]).all()


@pytest.mark.parametrize(
    "mesh", [torus(), plate_with_handles(), cube()], ids=["torus", "plate", "cube"]
)
def test_closed_surfaces_with_handles_become_disks(mesh):
    found = gso.pieces(mesh, max_strain=0.1, darts=True, as_it_is=False)
    assert all(piece.is_disk for piece in found)
    assert all(sheet is not None and sheet.sound for sheet in found.sheets)
    assert found.usable


def test_opening_cuts_to_disks():
    for mesh in (torus(), plate_with_handles(), cube(), ball()):
        (piece,) = gso.cut(mesh, gso.seams.opening(mesh))
        assert piece.is_disk
    # The shortest cut of a torus: once around the tube, once around the hole.
    short = gso.cut(torus(), gso.seams.opening(torus())).lengths.sum()
    assert short == pytest.approx(2 * np.pi * (0.4 + 0.6), rel=0.1)


def test_holes_are_opened():
    mesh = triangulated(dome(25))
    middle = mesh.vertices[mesh.faces].mean(axis=1)[:, :2]
    spots = np.array([[0.5, 0.5], [-0.5, 0.5], [0.5, -0.5], [-0.5, -0.5], [0.0, 0.0]])
    away = np.linalg.norm(middle[:, None] - spots, axis=2).min(axis=1)
    mesh = Mesh(mesh.vertices, mesh.faces[away > 0.15])
    assert len(mesh.boundary_loops) == 6
    found = gso.pieces(mesh, max_strain=0.02, darts=True)
    sound(found)
    assert found.usable


def test_saddles_are_divided_so_that_nothing_overlaps():
    found = gso.pieces(gso.as_mesh(saddle(25, strength=0.5)), max_strain=0.02, darts=True)
    sound(found)
    assert found.usable
    assert len(found) > 1


def test_seams_do_not_depend_on_pose_unit_and_order():
    mesh = triangulated(dome(15))
    first = gso.pieces(mesh, max_strain=0.02, darts=True)
    again = gso.pieces(mesh, max_strain=0.02, darts=True)
    np.testing.assert_array_equal(first.edges, again.edges)
    moved = shuffled(mesh.replaced(1000.0 * mesh.vertices @ rotation(4).T))
    other = gso.pieces(moved, max_strain=0.02, darts=True)
    assert len(other) == len(first)
    assert other.seam_length == pytest.approx(first.seam_length, rel=0.2)


def test_quads_are_cut_along_rows():
    mesh = dome(21)
    found = gso.pieces(mesh, max_strain=0.02, darts=True)
    assert all((piece.mesh.faces >= 0).all() for piece in found)
    # Few turns: most vertices on seams have both seam edges in one line.
    edges = found.edges
    way = mesh.vertices[edges[:, 1]] - mesh.vertices[edges[:, 0]]
    along = np.abs(way[:, :2]).max(axis=1) / np.linalg.norm(way[:, :2], axis=1)
    np.testing.assert_allclose(along, 1.0, atol=1e-9)
    ids, times = np.unique(edges, return_counts=True)
    direction = np.abs(way[:, 0]) > np.abs(way[:, 1])
    first = np.zeros(len(mesh.vertices))
    np.add.at(first, edges.ravel(), np.repeat(direction, 2))
    straight = np.isin(first[ids[times == 2]], (0, 2)).mean()
    assert straight > 0.6


def test_symmetric_seams():
    mesh = triangulated(dome(17))
    mesh = Mesh(mesh.vertices, np.concatenate([mesh.faces]))
    quads = dome(17)
    found = gso.pieces(quads, max_strain=0.02, symmetric=True, darts=True)
    points = quads.vertices
    for axis in (0, 1):
        flip = points.copy()
        flip[:, axis] *= -1
        partner = np.array([int(np.linalg.norm(points - p, axis=1).argmin()) for p in flip])
        mirrored = {tuple(sorted(e)) for e in partner[found.edges].tolist()}
        if mirrored == {tuple(sorted(e)) for e in found.edges.tolist()}:
            break
    else:
        raise AssertionError("the seams are not symmetric")
    with pytest.raises(gso.OptionError, match="symmetric"):
        gso.pieces(Mesh(*_skew()), symmetric=True, darts=True)


def _skew():
    points = sphere_cap(7).reshape(-1, 3)
    points[3] += 0.05
    return points, Mesh.from_grid(sphere_cap(7)).faces


def test_seams_that_are_kept_and_followed_and_avoided():
    mesh = dome(21)
    across = np.arange(21) * 21 + 5
    found = gso.pieces(mesh, max_strain=0.05, keep=Path(across[[0, -1]]), darts=True)
    kept = {tuple(sorted(e)) for e in np.stack([across[:-1], across[1:]], axis=1).tolist()}
    assert kept <= {tuple(sorted(e)) for e in found.edges.tolist()}
    again = gso.pieces(mesh, max_strain=0.05, keep=found, darts=True)
    assert len(again.edges) >= len(found.edges)
    region = np.abs(mesh.vertices[mesh.faces].mean(axis=1)[:, 1]) < 0.3
    plain, spared = (
        gso.pieces(mesh, max_strain=0.02, avoid=faces, darts=True) for faces in (None, region)
    )

    def inside(found):
        middle = np.abs(mesh.vertices[found.edges].mean(axis=1)[:, 1]) < 0.25
        return found.lengths[middle].sum()

    assert inside(spared) < 0.5 * inside(plain)


def test_pieces_fit_on_the_sheet():
    flat = np.dstack([*np.mgrid[:5.0, :17.0], np.zeros((5, 17))])
    found = gso.pieces(flat, sheet=(9.0, 4.5), darts=True)
    assert found.usable
    assert len(found) == 2
    assert all(sheet.size[0] <= 9.0 for sheet in found.sheets)
    assert found.alike() == [[0, 1]]


def test_faces_larger_than_the_sheet_are_named():
    for mesh in (Mesh(np.eye(3), [[0, 1, 2]]), ball(8)):
        found = gso.pieces(mesh, max_strain=0.1, sheet=(0.01, 0.01), darts=True)
        assert not found.usable
        why = [r for r in found.reasons if r.code in (Code.TOO_LONG, Code.TOO_WIDE)]
        assert len(why) == 2 and all(r.value > r.bound == 0.01 for r in why)
        assert set(why[0].places.ids) == {found.name(k) for k in range(len(found))}


def test_budgets_that_are_missed_are_named():
    found = gso.pieces(ball(16), max_strain=0.05, seam=0.5, darts=True)
    assert not found.usable
    (why,) = found.reasons
    assert (why.code, why.value, why.bound) == (Code.SEAM_LENGTH, found.seam_length, 0.5)
    narrow = gso.pieces(ball(16), max_strain=0.01, min_neck=1.5, darts=True)
    strain, neck = narrow.reasons
    assert (strain.code, strain.value) == (Code.STRAIN, narrow.metrics["strain_max"])
    assert (neck.code, neck.value, neck.bound) == (Code.NECK, narrow.metrics["neck"], 1.5)
    many = gso.pieces(ball(12), max_strain=0.1, darts=False, max_pieces=1)
    assert (many.reasons[0].code, many.reasons[0].value) == (Code.PIECES, len(many))


def test_a_changed_shape_is_developable_and_closed():
    mesh = ball(32)
    found = gso.pieces(mesh, max_strain=1e-3, max_deviation=0.12, darts=True)
    sound(found)
    assert found.usable, found.reasons
    assert found.metrics["strain_max"] <= 1e-3
    # Distances by another route: vertices and midpoints of faces, both ways.
    from gso.mesh import Nearest

    middles = found.design.vertices[found.design.faces].mean(axis=1)
    assert Nearest(mesh).distances(middles).max() <= 0.13
    assert found.metrics["dihedral_mean"] <= 1.1 * found.metrics["dihedral_mean_before"]
    result = found.result
    one, two = (result.mesh.vertices[result.pieces.opened.seams[:, k]] for k in (0, 1))
    np.testing.assert_allclose(one, two, atol=1e-9)


def test_optimize_takes_pieces(tmp_path):
    pieces = gso.cut(dome(17), Path([8 * 17, 8 * 17 + 16]))
    result = gso.tno.optimize(pieces, constraints=[gso.Fixed([0, 16])])
    whole = result.pieces.design
    assert whole.faces.tolist() == pieces.design.faces.tolist()
    np.testing.assert_allclose(whole.vertices[[0, 16]], pieces.design.vertices[[0, 16]], atol=1e-9)
    np.testing.assert_allclose(
        result.pieces.sewn([p.mesh.vertices for p in result.pieces]).vertices,
        whole.vertices,
        atol=1e-9,
    )
    uncut = gso.tno.optimize(dome(17))
    assert result.metrics["strain_p99"] < uncut.metrics["strain_p99"]
    result.save(tmp_path / "result.npz")
    again = gso.Result.load(tmp_path / "result.npz").pieces
    np.testing.assert_array_equal(again.edges, result.pieces.edges)
    np.testing.assert_array_equal(again.design.vertices, whole.vertices)
    flat = gso.tno.optimize(pieces, task="flatten")
    assert flat.usable
    with pytest.raises(gso.OptionError, match=r"pieces\.design"):
        gso.tno.optimize(pieces, task="denoise")


def test_noise_is_named():
    rng = np.random.default_rng(1)
    mesh = ball(24)
    noisy = mesh.replaced(  # a scan
        mesh.vertices * (1 + 0.02 * rng.standard_normal((len(mesh.vertices), 1)))
    )
    found = gso.pieces(noisy, max_strain=0.5, darts=True)
    assert any("denoise" in note for note in found.notes)


def test_what_is_not_manifold_or_one_sided_is_divided():
    turn = np.linspace(0, 2 * np.pi, 13)[:-1]
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    side = 0.3 * np.stack(
        [np.cos(turn / 2) * ring[:, 0], np.cos(turn / 2) * ring[:, 1], np.sin(turn / 2)], axis=1
    )
    k = np.arange(12)
    strip = np.stack([k, (k + 1) % 12, (k + 1) % 12 + 12, k + 12], axis=1)
    strip[-1] = [11, 12, 0, 23]
    found = gso.pieces((np.concatenate([ring - side, ring + side]), strip), darts=True)
    assert all(piece.is_disk for piece in found) and "one-sided" in found.notes[0]
    fins = [[0, 1, 2], [1, 0, 3], [0, 1, 4]]
    found = gso.pieces((np.random.default_rng(0).random((5, 3)), fins))
    assert "0-1" in found.notes[0] and len(found) in (2, 3)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"max_strain": 0}, "max_strain"),
        ({"max_deviation": -1}, "max_deviation"),
        ({"max_pieces": 0}, "max_pieces"),
        ({"sheet": (1.0,)}, "sheet"),
        ({"sheet": 3.0}, "sheet"),
        ({"min_neck": "wide"}, "min_neck"),
        ({"along": [[0, 99]]}, "0-99"),
        ({"avoid": [999]}, "face 999"),
    ],
)
def test_bad_settings_are_named(given, said):
    with pytest.raises(gso.OptionError, match=said):
        gso.pieces(dome(7), **given)


def test_minimum_cuts_are_shortest():
    mesh = Mesh.from_grid(np.dstack([*np.mgrid[:4.0, :9.0], np.zeros((4, 9))]))
    middle = mesh.vertices[mesh.faces].mean(axis=1)[:, 1]
    edges = between(mesh, middle < 2, middle > 6)
    assert len(edges) == 3


def test_a_tree_of_cuts_bounds_the_potential():
    mesh = ball(20)
    ground = Ground(mesh, Potential(mesh), Paths(mesh))
    edges = cut_tree(ground, 0.03)
    reached = np.zeros(len(mesh.vertices), bool)
    reached[edges] = True
    assert np.abs(ground.potential.solve(reached)).max() <= 0.06


def test_command(tmp_path):
    source = tmp_path / "dome.obj"
    gso.save(dome(15), source)
    out = tmp_path / "cut"
    done = CliRunner().invoke(main, ["pieces", str(source), "-o", str(out), "--max-strain", "3%"])
    assert done.exit_code == 0, done.output
    said = json.loads((out / "pieces.json").read_text())
    assert said["usable"]
    assert said["metrics"]["strain_max"] <= 0.03
    again = gso.load(out / "pieces.obj")
    assert set(again.attributes.labels["g"].names) == {row["name"] for row in said["pieces"]}
    for row in said["pieces"]:
        assert (out / f"pattern_{row['name']}.svg").exists()
    tight = CliRunner().invoke(main, ["pieces", str(source), "-o", str(out), "--seam", "0.001"])
    assert tight.exit_code == 1
    (why,) = json.loads((out / "pieces.json").read_text())["reasons"]
    assert (why["code"], why["bound"]) == ("seam_length", 0.001)
    assert f"not usable: {why['text']}" in tight.output.splitlines()
    bad = CliRunner().invoke(main, ["pieces", str(source), "-o", str(out), "--max-strain", "x"])
    assert bad.exit_code != 0
    kept = CliRunner().invoke(
        main, ["pieces", str(out / "pieces.obj"), "-o", str(tmp_path / "b"), "--keep-groups"]
    )
    assert kept.exit_code == 0, kept.output


def test_curves_stay_smooth():
    mesh = dome(17)
    line = np.arange(17) * 17 + 8
    jagged = line + np.where(np.arange(17) % 2 == 1, 1, 0)
    smooth = gso.SmoothCurves([jagged], weight=1e-2)
    turned = [
        np.abs(
            np.diff(gso.tno.optimize(mesh, constraints=c).mesh.vertices[jagged], 2, axis=0)
        ).max()
        for c in ([gso.SmoothCurves([jagged], weight=1e-9)], [smooth])
    ]
    assert turned[1] < 0.7 * turned[0]
    with pytest.raises(gso.OptionError, match="two or more"):
        gso.tno.optimize(mesh, constraints=[gso.SmoothCurves([[3]])])


def tetrahedron():
    return Mesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
    )


def sheets_are_sound(found):
    return all(piece.is_disk for piece in found) and all(s is not None for s in found.sheets)


@pytest.mark.parametrize("darts", [True, False])
def test_a_closed_mesh_that_needs_no_cut_is_opened(darts):
    for mesh in (tetrahedron(), ball(8)):
        assert sheets_are_sound(gso.pieces(mesh, max_strain=1e9, darts=darts))
        assert sheets_are_sound(gso.pieces(mesh, max_strain=0.3, darts=darts, min_neck=100.0))


def test_a_sphere_is_opened_along_two_edges():

    mesh = ball(8)
    cut = gso.cut(mesh, gso.seams.opening(mesh))
    assert len(cut.edges) == 2
    assert cut[0].is_disk


@pytest.mark.parametrize("seed", [545, 886, *range(20)])
def test_straight_seams_of_any_labels_can_be_cut(seed):
    from scipy.spatial import Delaunay

    from gso.seams import Edges
    from gso.seams.compact_patches import patches
    from gso.seams.straightening import straight_seams

    rng = np.random.default_rng(seed)
    n = int(rng.integers(30, 300))
    p = rng.random((n, 2))
    p[:4] = [[0, 0], [1, 0], [0, 1], [1, 1]]
    height = 0.3 * np.sin(3 * p[:, 0]) * np.sin(3 * p[:, 1])
    mesh = Mesh(np.c_[p, height], Delaunay(p).simplices)
    label, he = patches(mesh, int(rng.integers(2, 12)), np.empty((0, 2), int)), mesh.half_edges
    k = np.flatnonzero(he.twin > np.arange(he.twin.size))
    k = k[label[he.face[k]] != label[he.face[he.twin[k]]]]
    pieces = gso.cut(mesh, Edges(np.stack([he.origin[k], he.dest[k]], axis=1)))
    finer, edges = straight_seams(pieces, np.empty((0, 2), int))
    assert len(gso.cut(finer, Edges(edges)).edges) == len(edges)


def test_kept_pieces_have_to_be_of_the_same_mesh():
    mesh = ball(16)
    found = gso.pieces(mesh, max_strain=0.05, darts=True)
    again = gso.pieces(mesh, max_strain=0.02, keep=found, darts=True)
    assert np.allclose(again.design.vertices[: len(found.design.vertices)], found.design.vertices)
    smooth = gso.pieces(mesh, max_strain=0.05, keep=found, denoise=True, darts=True)
    assert not np.array_equal(smooth.design.vertices[:50], mesh.vertices[:50])
    with pytest.raises(OptionError, match="another mesh"):
        gso.pieces(ball(8), keep=found, darts=True)


def test_a_mesh_without_inner_vertices_takes_a_max_deviation():
    found = gso.pieces(tetrahedron(), max_deviation=0.1, darts=True)
    assert found.usable and found.result is None
    quad = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1.0, 0]], [[0, 1, 2, 3]])
    assert gso.pieces(quad, max_deviation=0.1, darts=True).usable


@pytest.mark.parametrize("darts", [True, False])
def test_seams_follow_and_avoid_edges_also_without_darts(darts):
    mesh = ball(16)
    middle = mesh.vertices[mesh.triangles].mean(axis=1)
    avoid = np.flatnonzero(middle[:, 2] > 0.7)

    def inside(found):
        z = found.design.vertices[found.edges].mean(axis=1)[:, 2]
        return float(found.lengths[z > 0.72].sum())

    free = ball_in_pieces(0.1, darts=darts)
    away = gso.pieces(mesh, max_strain=0.1, darts=darts, avoid=avoid)
    assert inside(away) < 0.8 * inside(free)
    same = gso.pieces(mesh, max_strain=0.1, along=[], avoid=[], darts=darts)
    assert len(same) == len(free)
    with pytest.raises(OptionError, match="vertices are 0 to"):
        gso.pieces(mesh, along=[[0, 10**6]], darts=True)


def test_a_coarse_smooth_torus_is_not_noisy():
    a, b = np.meshgrid(np.arange(16) * np.pi / 8, np.arange(10) * np.pi / 5, indexing="ij")
    r = 1 + 0.4 * np.cos(b)
    points = np.stack([r * np.cos(a), r * np.sin(a), 0.4 * np.sin(b)], axis=-1).reshape(-1, 3)
    i = np.arange(160).reshape(16, 10)
    j = np.roll(i, -1, axis=0)
    faces = np.stack([i, j, np.roll(j, -1, 1), np.roll(i, -1, 1)], axis=-1).reshape(-1, 4)
    found = gso.pieces(Mesh(points, faces), max_strain=0.1, darts=True)
    assert not any("noisy" in note for note in found.notes)


def test_pieces_shorter_than_min_size_are_joined_or_named():
    mesh = ball(16)
    found = gso.pieces(mesh, max_strain=0.05, darts=False)
    least = 1.2 * min(sheet.size[0] for sheet in found.sheets)
    longer = gso.pieces(mesh, max_strain=0.05, darts=False, min_size=least)
    assert longer.usable and len(longer) < len(found)
    assert min(sheet.size[0] for sheet in longer.sheets) >= least
    (why,) = gso.pieces(mesh, max_strain=0.03, min_size=20.0, darts=True).reasons
    assert why.code is Code.TOO_SHORT and why.value < why.bound == 20.0
    with pytest.raises(OptionError, match="min_size"):
        gso.pieces(mesh, min_size=2.0, sheet=(1.0, 1.0), darts=True)


def test_patterns_of_an_earlier_search_are_deleted(tmp_path):
    many, one = (ball_in_pieces(0.03, darts=darts) for darts in (False, True))
    (tmp_path / "pattern_mine.svg").write_text("mine")
    many.save(tmp_path)
    assert len(list(tmp_path.glob("pattern_*.svg"))) == len(many) + 1
    one.save(tmp_path)
    assert len(list(tmp_path.glob("pattern_*.svg"))) == len(one) + 1


def test_bounds_on_the_joint_solve_hold():
    cut = gso.pieces(ball(10), max_strain=0.03, darts=False)
    free = gso.tno.optimize(cut)
    far = free.deviation
    near = gso.tno.optimize(cut, max_deviation=0.5 * far)
    assert near.deviation <= 0.5 * far
    assert near.metrics["strain_p99"] > free.metrics["strain_p99"]
    stiff = gso.tno.optimize(cut, max_strain=0.01)
    assert stiff.details["verdict"]["strain_max"] <= 0.01
    with pytest.raises(OptionError, match="curvature"):
        gso.tno.optimize(cut, formulation="isometry", max_deviation=0.1)


def test_pieces_become_exactly_ruled(tmp_path):
    cut = gso.cut(dome(13), Path([6 * 13, 6 * 13 + 12]))
    options = gso.RuledOptions(strips=2, starts=("design",), rulings=17)
    result = gso.tno.optimize(cut, formulation="ruled", options=options)
    assert result.ruled.strips == 2 * len(cut)
    assert result.details["strips"] == [2] * len(cut)
    assert result.metrics["strain_max"] < 1e-6
    # The seams of the joint result are closed, those of the strips up to a distance.
    assert 0 < result.details["seam_gap"] < 0.02
    assert len(result.pieces) == len(cut)
    moved = result.on_design().vertices
    assert gso.metrics.point_to_surface(moved, result.pieces.design).max() < 0.05
    path = tmp_path / "ruled.npz"
    result.save(path)
    again = gso.Result.load(path)
    assert result.usable and again.usable
    assert len(again.pieces) == len(cut)
    assert np.allclose(again.pieces.design.vertices, result.pieces.design.vertices)
    result.save(tmp_path / "ruled.svg")
    result.save(tmp_path / "ruled.step")
    options = gso.RuledOptions(rulings=17)
    near = gso.tno.optimize(cut, formulation="ruled", options=options, max_deviation=0.04)
    far, gap = near.ruled.deviation.there_max, near.details["seam_gap"]
    assert (Code.DEVIATION in codes(near.reasons)) == (far > 0.04)
    assert (Code.SEAM_GAP in codes(near.reasons)) == (gap > 0.04)
    assert max(far, gap) <= 1.1 * 0.04

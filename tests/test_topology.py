"""Connectivity: grids, stars, polylines, boundary loops, on shapes whose answers are known."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from gso import MeshError, geometry
from gso.mesh import topology


def half_edges(faces, count=None):
    faces = np.asarray(faces)
    return topology.half_edges(faces, int(faces.max()) + 1 if count is None else count)


def wrapped(height, width, *, rows=False):
    """Quads of a grid closed into a cylinder along its rows, or into a torus."""
    v = np.arange(height * width).reshape(height, width)
    v = np.c_[v, v[:, :1]]
    v = np.r_[v, v[:1]] if rows else v
    return np.stack([v[:-1, :-1], v[1:, :-1], v[1:, 1:], v[:-1, 1:]], axis=-1).reshape(-1, 4)


def fan(valence):
    """Triangles round vertex 0."""
    ring = np.arange(1, valence + 1)
    return np.stack([np.zeros_like(ring), ring, np.roll(ring, -1)], axis=1)


def three_quads():
    """Quads round an interior vertex of valence three, each cut into four."""
    faces, ids = [], {}

    def number(*key):
        return ids.setdefault(tuple(sorted(key)), len(ids))

    for a, b, c, d in ([0, 1, 2, 3], [0, 3, 4, 5], [0, 5, 6, 1]):
        corners = [a, b, c, d]
        for k, corner in enumerate(corners):
            after, before = corners[(k + 1) % 4], corners[k - 1]
            faces.append(
                [number(corner), number(corner, after), number(a, b, c, d), number(before, corner)]
            )
    return np.array(faces)


CUBE = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)


def relabelled(faces, seed):
    """The same surface with other vertex numbers, face order and first corners."""
    rng = np.random.default_rng(seed)
    names = rng.permutation(int(faces.max()) + 1)
    turned = [np.roll(f, rng.integers(faces.shape[1])) for f in names[faces]]
    return np.array(turned)[rng.permutation(len(faces))], names


def directed(faces):
    rows = [[v for v in f if v >= 0] for f in np.asarray(faces).tolist()]
    return Counter((a, b) for f in rows for a, b in zip(f, f[1:] + f[:1]))


def triangulated(faces):
    return topology.triangulate(faces, topology.quad_splits(faces, half_edges(faces)))


def stars_of(faces):
    he = half_edges(faces)
    return topology.vertex_stars(faces, he, topology.quad_splits(faces, he))


def cycle(face):
    """A face that starts at its smallest corner."""
    k = face.index(min(face))
    return tuple(face[k:] + face[:k])


@pytest.mark.parametrize("valence", [3, 4, 5, 6, 7, 9, 11, 13, 17, 25, 33, 64, 65, 129, 300])
def test_star_rings_are_cyclic_and_padded_by_their_last_vertex(valence):
    faces, names = relabelled(fan(valence), seed=valence)
    ((centre, ring),) = stars_of(faces)[0]
    assert centre.tolist() == [names[0]]
    ring = ring[0].tolist()
    assert len(ring) in topology.RING_SIZES and len(ring) >= valence
    assert set(ring[valence:]) <= {ring[valence - 1]}
    expected = {cycle(f) for f in faces.tolist()}
    turns = zip(ring[:valence], ring[1:valence] + ring[:1])
    assert {cycle([names[0], a, b]) for a, b in turns} == expected


@pytest.mark.parametrize("valence", [3, 6, 9, 300])
def test_padded_star_of_a_plane_fan_has_no_curvature(valence):
    angle = 2 * np.pi * np.arange(valence) / valence
    points = np.c_[np.r_[0, np.cos(angle)], np.r_[0, np.sin(angle)], np.zeros(valence + 1)]
    ((centre, ring),) = stars_of(fan(valence))[0]
    star = [tuple(points[v]) for v in ring[0]]
    assert abs(geometry.gaussian_curvature(tuple(points[centre[0]]), star)) < 1e-12


def test_stars_leave_out_the_boundary_and_group_by_length():
    quads = topology.grid_faces(6, 7)
    groups, _ = stars_of(np.r_[quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    assert [ring.shape for _, ring in groups] == [(20, 6)]
    inner = np.arange(42).reshape(6, 7)[1:-1, 1:-1]
    assert sorted(groups[0][0].tolist()) == inner.ravel().tolist()


def test_both_stars_of_grids_are_those_of_their_two_triangulations():
    faces, _ = relabelled(topology.grid_faces(6, 7), seed=3)
    ids = topology.recognise_grid(half_edges(faces), faces)
    given = [topology.grid_stars(ids, ring) for ring in geometry.GRID_RINGS]
    assert ring_sets(stars_of(faces)) == ring_sets(given)
    for (centre, own), (_, other) in zip(*given, strict=True):
        assert own.shape == other.shape == (20, 6)
        both = [set(a) | set(b) for a, b in zip(own.tolist(), other.tolist(), strict=True)]
        assert {len(b) for b in both} == {8} and len(set(centre.tolist())) == 20


def ring_sets(splits, names=None):
    """Vertex to the rings that it has, as sets of vertices; `names` turns numbers back."""
    found = {}
    for stars in splits:
        for centre, ring in stars:
            for c, r in zip(centre.tolist(), ring.tolist(), strict=True):
                found.setdefault(c, Counter())[frozenset(r)] += 1
    if names is None:
        return found
    back = {int(new): old for old, new in enumerate(names)}
    return {
        back[c]: Counter({frozenset(back[v] for v in r): n for r, n in rings.items()})
        for c, rings in found.items()
    }


def test_stars_do_not_depend_on_the_numbering():
    expected = ring_sets(stars_of(three_quads()))
    for seed in range(8):
        faces, names = relabelled(three_quads(), seed)
        assert ring_sets(stars_of(faces), names) == expected
    # Quads around a vertex of odd valence are all split through it.
    assert Counter(len(r) for rings in expected.values() for r in rings.elements()) == {6: 14}


def test_a_star_too_large_for_any_ring_is_refused():
    with pytest.raises(MeshError, match="vertex 0 has 5000 triangles"):
        stars_of(fan(5000))


@pytest.mark.parametrize(
    ("faces", "euler", "loops"),
    [
        (topology.grid_faces(5, 4), 1, [14]),
        (fan(7), 1, [7]),
        (wrapped(4, 5), 0, [5, 5]),
        (CUBE, 2, []),
        (wrapped(4, 5, rows=True), 0, []),
        (np.delete(topology.grid_faces(6, 8), [8, 10, 24], axis=0), -2, [24, 4, 4, 4]),
    ],
    ids=["disk", "fan", "annulus", "sphere", "torus", "three holes"],
)
def test_euler_characteristic_and_boundary_loops(faces, euler, loops):
    for seed in range(5):
        he = half_edges(relabelled(faces, seed)[0])
        assert np.count_nonzero(he.face_count) - len(topology.edges(he)) + len(faces) == euler
        found = topology.boundary_loops(he)
        assert [len(p) for p in found] == loops
        steps = [s for p in found for s in zip(p.tolist(), np.roll(p, -1).tolist())]
        rim = he.twin < 0
        assert sorted(steps) == sorted(zip(he.origin[rim].tolist(), he.dest[rim].tolist()))


def test_boundary_loops_run_anticlockwise_outside_and_clockwise_round_holes():
    y, x = np.mgrid[:6, :8]
    z = (x + 1j * y).ravel()
    faces = np.delete(topology.grid_faces(6, 8)[:, ::-1], 10, axis=0)
    areas = [
        0.5 * np.imag(np.sum(np.conj(z[p]) * z[np.roll(p, -1)]))
        for p in topology.boundary_loops(half_edges(faces))
    ]
    assert areas == [35.0, -1.0]


def test_a_vertex_in_which_two_fans_touch_counts_as_two_on_the_boundary():
    # Cells (1, 1) and (2, 2) are missing: two holes become one round the vertex (2, 2).
    holes = np.delete(topology.grid_faces(5, 5), [5, 10], axis=0)
    loops = topology.boundary_loops(half_edges(holes))
    assert [len(p) for p in loops] == [16, 8]
    assert np.bincount(loops[1])[12] == 2
    pair = np.array([[0, 1, 2, 3], [2, 4, 5, 6]])
    assert [len(p) for p in topology.boundary_loops(half_edges(pair))] == [4, 4]
    for faces, vertex in ((holes, 12), (pair, 2)):
        with pytest.raises(MeshError, match=f"vertex {vertex} joins 2 parts"):
            topology.check_vertices(half_edges(faces))


@pytest.mark.parametrize("shape", [(2, 2), (2, 5), (7, 2)])
def test_strips_are_no_grids(shape):
    plain = topology.grid_faces(*shape)
    assert topology.recognise_grid(half_edges(plain), plain) is None


@pytest.mark.parametrize("shape", [(3, 3), (3, 5), (4, 7), (9, 6)])
def test_a_grid_is_found_in_any_numbering(shape):
    plain = topology.grid_faces(*shape)
    found = topology.recognise_grid(half_edges(plain), plain)
    assert np.array_equal(found, np.arange(shape[0] * shape[1]).reshape(shape))
    for seed in range(20):
        faces, _ = relabelled(plain[:, ::-1] if seed % 2 else plain, seed)
        ids = topology.recognise_grid(half_edges(faces), faces)
        assert ids is not None and sorted(ids.shape) == sorted(shape)
        assert ids[0, 0] == min(ids[0, 0], ids[0, -1], ids[-1, 0], ids[-1, -1])
        again = ids.ravel()[topology.grid_faces(*ids.shape)]
        assert {cycle(f) for f in again.tolist()} == {cycle(f) for f in faces.tolist()}


@pytest.mark.parametrize(
    "faces",
    [
        wrapped(4, 5),
        wrapped(4, 5, rows=True),
        CUBE,
        three_quads(),
        np.delete(topology.grid_faces(4, 5), 0, axis=0),
        np.delete(topology.grid_faces(5, 5), 5, axis=0),
        np.r_[topology.grid_faces(3, 3), topology.grid_faces(3, 3) + 9],
        np.r_[topology.grid_faces(3, 3)[1:], [[0, 3, 4, -1], [0, 4, 1, -1]]],
        fan(6),
    ],
    ids=["cylinder", "torus", "cube", "valence 3", "L", "hole", "two", "mixed", "triangles"],
)
def test_what_is_no_grid_is_not_taken_for_one(faces):
    assert topology.recognise_grid(half_edges(faces), faces) is None


def test_an_unused_vertex_makes_a_grid_no_grid():
    faces = topology.grid_faces(3, 4)
    assert topology.recognise_grid(half_edges(faces, 13), faces) is None


@pytest.mark.parametrize("shape", [(3, 3), (4, 6), (2, 5)])
def test_polyline_triples_of_a_grid(shape):
    h, w = shape
    v = np.arange(h * w).reshape(h, w)
    rows = np.stack([v[:, :-2], v[:, 1:-1], v[:, 2:]], axis=-1).reshape(-1, 3)
    columns = np.stack([v[:-2], v[1:-1], v[2:]], axis=-1).reshape(-1, 3)
    faces, names = relabelled(topology.grid_faces(h, w), seed=h)
    expected = {(min(a, c), b, max(a, c)) for a, b, c in names[np.r_[rows, columns]].tolist()}
    found = topology.polyline_triples(half_edges(faces), faces)
    assert len(found) == h * (w - 2) + w * (h - 2)
    assert set(map(tuple, found.tolist())) == expected


def test_polylines_close_on_a_torus_and_end_at_irregular_vertices():
    torus = wrapped(4, 5, rows=True)
    assert len(topology.polyline_triples(half_edges(torus), torus)) == 2 * 20
    faces = three_quads()
    triples = topology.polyline_triples(half_edges(faces), faces)
    assert 0 not in triples[:, 1]
    assert len(topology.polyline_triples(half_edges(CUBE), CUBE)) == 0
    assert topology.polyline_triples(half_edges(fan(5)), fan(5)).shape == (0, 3)


@pytest.mark.parametrize(
    "quads",
    [topology.grid_faces(6, 7), wrapped(5, 6), wrapped(4, 5), wrapped(5, 7, rows=True)],
    ids=["grid", "cylinder", "cylinder, five", "torus"],
)
def test_triangulation_of_regular_quads_has_valence_six(quads):
    for seed in range(5):
        faces, _ = relabelled(quads, seed)
        he = half_edges(triangulated(faces))
        inner = ~he.boundary_vertex
        assert (he.face_count[inner] == 6).all() and inner.any()


def test_triangulation_covers_each_face_once_and_keeps_orientation():
    faces = np.r_[topology.grid_faces(3, 4)[1:], [[0, 4, 5, -1], [0, 5, 1, -1]]]
    triangles = triangulated(faces)
    assert len(triangles) == 2 * 5 + 2
    assert max(directed(triangles).values()) == 1
    assert set(directed(faces)) <= set(directed(triangles))
    assert np.array_equal(triangulated(fan(4)), fan(4))


@pytest.mark.parametrize(
    "faces",
    [
        [[0, 1, 2, 3], [0, 3, 4, 1]],
        [[1, 2, 3, 0], [3, 4, 1, 0]],
        [[0, 1, 2, 3], [0, 2, 1, -1]],
        [[1, 2, 3, 0], [0, 2, 1, -1]],
    ],
)
def test_triangulation_of_faces_that_share_two_edges_is_a_surface(faces):
    triangles = triangulated(np.array(faces))
    edges = Counter(tuple(sorted(e)) for e in directed(triangles).elements())
    assert max(directed(triangles).values()) == 1 and max(edges.values()) == 2


def test_hinges_name_both_triangles_of_every_inner_edge():
    quads = topology.grid_faces(4, 5)
    triangles = np.r_[quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]
    he = half_edges(triangles)
    hinges = topology.hinges(he)
    assert len(hinges) == len(topology.edges(he)) - np.count_nonzero(he.twin < 0)
    known = {cycle(t) for t in triangles.tolist()}
    for a, b, left, right in hinges.tolist():
        assert cycle([a, b, left]) in known and cycle([b, a, right]) in known


def test_edges_are_listed_once():
    faces = topology.grid_faces(4, 5)
    found = [tuple(sorted(e)) for e in topology.edges(half_edges(faces)).tolist()]
    assert len(found) == len(set(found)) == 4 * 4 + 3 * 5
    assert set(found) == {tuple(sorted(e)) for e in directed(faces)}


def test_corner_triangles_have_the_faces_orientation():
    y, x = np.mgrid[:3, :4]
    points = np.c_[x.ravel(), y.ravel()].astype(float)
    faces = np.r_[topology.grid_faces(3, 4)[1:, ::-1], [[0, 1, 5, -1]]]
    corners = topology.corner_triangles(faces)
    assert len(corners) == 4 * 5 + 1
    p, q, r = points[corners].transpose(1, 2, 0)
    assert np.allclose(geometry.corner_area2(tuple(p), tuple(q), tuple(r)), 1.0)


def test_reversing_keeps_the_first_corner_and_the_padding():
    faces = np.array([[0, 1, 2, 3], [4, 5, 6, -1]])
    assert topology.reverse(faces).tolist() == [[0, 3, 2, 1], [4, 6, 5, -1]]
    assert topology.reverse(faces[1:, :3]).tolist() == [[4, 6, 5]]


@pytest.mark.parametrize("quads", [topology.grid_faces(5, 6), wrapped(4, 5, rows=True), CUBE])
def test_orientation_is_repaired_by_reversing_the_minority(quads):
    for seed in range(10):
        rng = np.random.default_rng(seed)
        faces, _ = relabelled(quads, seed)
        turned = rng.random(len(faces)) < 0.3
        mixed = faces.copy()
        mixed[turned] = topology.reverse(mixed[turned])
        out, flipped, components = topology.orient(mixed, int(faces.max()) + 1)
        assert components == 1 and max(directed(out).values()) == 1
        assert flipped == min(turned.sum(), len(faces) - turned.sum())


def test_one_sided_surfaces_are_named():
    strip = topology.grid_faces(2, 6)
    strip[-1] = [4, 10, 0, 6]
    with pytest.raises(MeshError, match="one-sided"):
        topology.orient(strip, 12)


def test_quads_are_told_from_triangles():
    mixed = np.array([[0, 1, 2, 3], [3, 2, 4, -1], [5, 6, 7, 8]])
    assert topology.are_quads(mixed).tolist() == [True, False, True]
    assert not topology.are_quads(mixed[:, :3]).any()
    assert [f.shape for f in topology.by_size(mixed)] == [(2, 4), (1, 3)]

"""Every mesh format: round trips, damaged files, failed writes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

import gso
from gso.io import SUFFIXES
from tests.conftest import saddle

GRID = gso.Mesh.from_grid(1000.0 * saddle(5, 6) + [1e3, 2e3, 0.0])
TRIANGLES = gso.Mesh(GRID.vertices, GRID.triangles)


def mesh_for(suffix: str) -> gso.Mesh:
    """Return a mesh that the format can hold: quads, or triangles where it has no quads."""
    return TRIANGLES if suffix in (".stl", ".glb") else GRID


def middles(mesh: gso.Mesh) -> cKDTree:
    """Return the centroids of the triangles."""
    return cKDTree(mesh.vertices[mesh.triangles].mean(axis=1))


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_mesh_is_the_same_after_a_round_trip(suffix, tmp_path):
    mesh, path = mesh_for(suffix), tmp_path / f"panel{suffix}"
    gso.save(mesh, path)
    again = gso.load(path)
    for one, two in ((again, mesh), (mesh, again)):
        assert middles(one).query(middles(two).data)[0].max() < 2e-3
    assert len(again.faces) == len(mesh.faces)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_equal_meshes_give_equal_files(suffix, tmp_path):
    one, two = tmp_path / f"one{suffix}", tmp_path / f"two{suffix}"
    for path in (one, two):
        gso.save(mesh_for(suffix), path)
    assert one.read_bytes() == two.read_bytes()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_what_is_loaded_can_be_saved_and_loaded_again(suffix, tmp_path):
    path, other = tmp_path / f"one{suffix}", tmp_path / f"two{suffix}"
    gso.save(mesh_for(suffix), path)
    gso.save(gso.load(path), other)
    np.testing.assert_array_equal(gso.load(other).vertices, gso.load(path).vertices)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("damage", ["empty", "half", "noise", "missing"])
def test_damaged_files_are_named(suffix, damage, tmp_path):
    path = tmp_path / f"panel{suffix}"
    gso.save(mesh_for(suffix), path)
    data = path.read_bytes()
    if damage == "missing":
        path.unlink()
    else:
        noise = np.random.default_rng(0).bytes(len(data))
        path.write_bytes({"empty": b"", "half": data[: len(data) // 2], "noise": noise}[damage])
    try:
        mesh = gso.load(path)
    except gso.MeshError as error:
        assert path.name in str(error)
    else:
        # Half a text file can be a smaller mesh.
        assert damage == "half"
        assert np.isfinite(mesh.vertices).all()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_failed_write_keeps_the_file_that_was_there(suffix, tmp_path):
    path = tmp_path / f"panel{suffix}"
    path.write_bytes(b"precious")
    if suffix == ".npy":
        with pytest.raises(gso.GSOError, match="npy"):
            gso.save(TRIANGLES, path)
        assert path.read_bytes() == b"precious"
    with pytest.raises(gso.GSOError, match="nowhere"):
        gso.save(mesh_for(suffix), tmp_path / "nowhere" / f"panel{suffix}")
    assert path.read_bytes() == b"precious"

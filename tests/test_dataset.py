"""Sets of surfaces: what is in them, and that building them survives everything."""

from __future__ import annotations

import errno
import hashlib
import json
import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import fields, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import gso
from gso import DatasetError, OptionError, dataset, metrics
from gso.cli import main
from gso.dataset import INTERVALS, LABELS, LEVELS, Recipe, generate, labels, screen, shapes
from gso.unknowns import tensor_matrix

ROOT = Path(__file__).resolve().parents[1]
TINY = Recipe(n=30, size=16, extras=False)
#: As many files, and done in seconds.
QUICK = replace(TINY, labels=("strain",))


def in_unit_ball(grid):
    """A grid (H, W, 3) moved to its centroid and scaled to radius one."""
    moved = grid - grid.mean(axis=(0, 1))
    return moved / np.linalg.norm(moved, axis=2).max()


#: Surfaces in a file, so that the small sets have files like large ones: two of a split.
LENGTH = 16


def build(folder, recipe, **how):
    """Build a set whose files are short."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gso.dataset.shard.LENGTH", LENGTH)
        return dataset.build(folder, recipe, **how)


def digests(folder):
    """Checksum of every file of a set."""
    return {
        str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest()
        for p in sorted(Path(folder).rglob("*"))
        if p.is_file()
    }


@pytest.fixture(scope="session", autouse=True)
def screened_once():
    """Screening in this process is done once for each set: many tests build the same."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "gso.dataset.builder.select",
            lambda count, hard, *, seed, strata, tick=None: select(count, hard, seed, strata),
        )
        yield


@cache
def select(count, hard, seed, strata="curvature"):
    """Screening that several tests need."""
    return screen.select(count, hard, seed=seed, strata=strata)


@pytest.fixture(scope="session")
def tiny(tmp_path_factory):
    """A set of 30 surfaces with all labels."""
    return build(tmp_path_factory.mktemp("tiny"), TINY, workers=0)


@pytest.fixture(scope="session")
def quick(tmp_path_factory):
    """An uninterrupted set in one process."""
    return build(tmp_path_factory.mktemp("quick"), QUICK, workers=0)


@pytest.fixture(scope="session")
def batched(tmp_path_factory):
    """The set of 30 surfaces with labels from batches."""
    pytest.importorskip("torch")
    return build(tmp_path_factory.mktemp("batched"), TINY, device="cpu", workers=0)


class TestScreen:
    def test_surfaces_are_the_same_in_any_company(self):
        some = generate(40, seed=3)
        together = dataset.draw_many([(40, 3)], 64)
        for k in (0, 17, 39):
            np.testing.assert_array_equal(dataset.draw_many([(k + 1, 3)], 64)[k], together[k])
            np.testing.assert_allclose(some[k].sample(64), together[k], atol=1e-6)

    def test_intervals_get_their_shares_and_the_mean_is_the_published_one(self):
        chosen = select(400, 12, seed=5)
        assert len(np.unique(np.r_[chosen.main, chosen.hard])) == 412
        found = self.features(5, chosen.main)
        assert found["K_A"].mean() == pytest.approx(0.307, abs=0.01)
        expected = np.reshape(screen.quotas(400), (-1, len(screen.SHAPE_SHARES)))
        there = np.histogram2d(found["K_A"], found["sigma2"], [screen.CURVATURE, screen.SHAPE])[0]
        np.testing.assert_array_equal(there, expected)
        for name, edges in INTERVALS.items():
            values = np.abs(found[name])
            counts = np.histogram(values, edges)[0]
            beyond = sum(edge >= values.max() for edge in edges)
            assert min(counts[: len(counts) - beyond + 1]) > 0, name

    def test_all_features_of_the_paper_get_their_shares(self):
        count = 200
        chosen = select(count, 0, seed=5, strata="features")
        found = self.features(5, chosen.main)
        values = np.column_stack([found["K_A"], found["sigma2"], found["K_P"] / found["K_A"]])
        edges = [screen.CURVATURE, screen.SHAPE, screen.BALANCE]
        there = np.histogramdd(values, edges)[0]
        np.testing.assert_array_equal(there.ravel(), screen.quotas(count, "features"))
        # Flat to strongly curved surfaces of either sign, and mixed ones, in every split.
        for part in np.split(values, [100]):
            counts = np.histogram(part[:, 2], screen.BALANCE)[0] / len(part)
            np.testing.assert_allclose(counts, screen.BALANCE_SHARES, atol=0.05)
            assert part[:, 0].mean() == pytest.approx(0.307, abs=0.03)
        np.testing.assert_allclose(found["K_A"], found["K_P"] - found["K_N"], rtol=1e-9)

    def test_the_older_strata_leave_the_manifest_as_it_was(self):
        assert "strata" not in Recipe().as_dict()
        assert Recipe(strata="features").as_dict()["strata"] == "features"

    def test_every_split_has_its_share_of_each_interval(self):
        chosen = select(400, 12, seed=5)
        for part in np.split(self.features(5, chosen.main)["K_A"], [320, 360]):
            assert part.mean() == pytest.approx(0.307, abs=0.02)
            counts = np.histogram(part, screen.CURVATURE)[0] / len(part)
            np.testing.assert_allclose(counts, screen.CURVATURE_SHARES, atol=1.5 / len(part))

    def test_processes_draw_what_one_does(self, monkeypatch):
        pieces, told = [(3, 1), (2, 2), (1, 3)], []
        alone = dataset.draw_many(pieces, 16, told.append)
        assert told == [3, 5, 6]
        monkeypatch.setattr("gso.dataset.drawing._MANY", 1)
        np.testing.assert_array_equal(dataset.draw_many(pieces, 16), alone)
        expected = [surface.sample(16) for surface in generate(2, seed=2)]
        np.testing.assert_allclose(alone[3:5], expected, atol=1e-6)

    def test_hard_draws_lie_beyond_the_intervals(self):
        found = self.features(5, select(400, 12, seed=5).hard)
        curved, uneven = found["K_A"] > screen.CURVATURE[-1], found["sigma2"] > screen.SHAPE[-1]
        assert (curved | uneven).all()
        assert np.sum(found["K_A"] > screen.CURVED) == np.sum(~curved) == 4

    def test_quotas_sum_to_what_is_asked_for(self):
        for count in (10, 63, 64, 1000, Recipe().n):
            assert screen.quotas(count).sum() == count
            assert screen.quotas(count, "features").sum() == count
        assert screen.quotas(Recipe().n).min() > 20
        shares = screen.CURVATURE_SHARES, screen.SHAPE_SHARES, screen.BALANCE_SHARES
        assert [sum(s) for s in shares] == pytest.approx([1.0, 1.0, 1.0])

    def test_another_seed_gives_other_surfaces(self):
        one, other = (select(10, 1, seed=s) for s in (0, 1))
        assert set(one.main) != set(other.main)
        assert (screen.surface(0, 0).net.shape, screen.surface(0, 0).net.sum()) != (
            screen.surface(1, 0).net.shape,
            screen.surface(1, 0).net.sum(),
        )

    @staticmethod
    def features(seed, numbers):
        points = np.stack([screen.surface(seed, int(k)).sample(64) for k in numbers])
        return dict(zip(screen.FEATURES, screen.features(points).T, strict=True))


class TestRecipe:
    def test_splits_have_the_stated_sizes(self):
        assert Recipe().splits == {
            "train": 8320,
            "validation": 1040,
            "test": 1041,
            "hard": 1040,
            **dict.fromkeys(shapes.NAMES, 8),
        }
        assert sum(list(Recipe(n=77, extras=False).splits.values())[:3]) == 77

    @pytest.mark.parametrize(
        "wrong",
        [{"n": 9}, {"n": 20.5}, {"seed": -1}, {"size": 8}, {"labels": ("flat",)}],
    )
    def test_what_makes_no_sense_is_refused(self, wrong):
        with pytest.raises(OptionError, match=next(iter(wrong))):
            Recipe(**wrong)


class TestShapes:
    @pytest.mark.parametrize("name", shapes.NAMES)
    def test_each_is_a_few_sound_surfaces_of_the_unit_ball(self, name):
        grids = shapes.sample(name, seed=0, size=24)
        assert grids.shape == (shapes.COUNT, 24, 24, 3)
        for grid in grids:
            assert gso.Mesh.from_grid(grid).grid_shape == (24, 24)
            assert metrics.unit(grid) == pytest.approx(1.0)
        assert len({grid.tobytes() for grid in grids}) == shapes.COUNT

    @pytest.mark.parametrize("name", ["enneper", "catenoid", "helicoid", "monkey_saddle"])
    def test_saddles_have_no_positive_curvature(self, name):
        positive, negative, _, _ = screen.features(shapes.sample(name, seed=0)).T
        assert (positive < 1e-3 * -negative).all()

    def test_spheres_have_the_curvature_of_their_radius(self):
        for grid in shapes.sample("sphere", seed=0):
            p = grid.reshape(-1, 3)
            solution = np.linalg.lstsq(np.c_[2 * p, np.ones(len(p))], (p**2).sum(1), rcond=None)[0]
            radius = np.sqrt(solution[3] + solution[:3] @ solution[:3])
            # The discrete curvature refers to three times the area of a vertex.
            k = 3.0 * metrics.curvature_grid(grid)
            np.testing.assert_allclose(k * radius**2, 1.0, rtol=0.01)

    def test_windows_depend_on_the_seed_and_not_on_the_size(self):
        fine, coarse = (shapes.sample("torus", seed=4, size=s) for s in (31, 16))
        np.testing.assert_allclose(fine[0, ::2, ::2], coarse[0], atol=0.02)
        assert np.abs(shapes.sample("torus", seed=5, size=16) - coarse).max() > 0.1

    def test_teapot_and_terrain_are_those_of_the_examples(self, monkeypatch):
        monkeypatch.syspath_prepend(str(ROOT / "examples"))
        import teapot

        for k, grid in zip((0, 4, 8, 12, 14, 16, 18, 24), shapes.sample("teapot", seed=0)):
            np.testing.assert_allclose(grid, in_unit_ball(teapot.patch(k, 64)), atol=1e-12)
        pytest.importorskip("matplotlib")
        import terrain

        data = shapes._data("terrain")
        for (i, j), grid in zip(data["corner"], shapes.sample("terrain", seed=0)):
            window = terrain.terrain((i, i + 64, j, j + 64))
            np.testing.assert_allclose(grid, in_unit_ball(window), atol=1e-12)


class TestLabels:
    def test_spline_is_the_least_squares_fit(self):
        field = np.random.default_rng(0).normal(size=(30, 20))
        coefficients, misfit = labels.fit_spline(field)
        basis = tensor_matrix((30, 20), (16, 16)).toarray()
        expected = np.linalg.lstsq(basis, field.ravel(), rcond=None)[0]
        np.testing.assert_allclose(coefficients.ravel(), expected, atol=1e-8)
        rest = basis @ expected - field.ravel()
        assert misfit == pytest.approx(np.sqrt((rest**2).mean()))

    def test_what_the_solver_refuses_is_said(self):
        label = labels.solve("developable", np.zeros((16, 16, 3)))
        assert label.status == labels.FAILED
        assert np.isnan(label.arrays["developable"]).all()
        assert {k: v.shape for k, v in label.arrays.items()} == labels.shapes("developable", 16)

    def test_offsets_are_displacements_along_the_normals_of_the_design(self, tiny):
        from gso.mesh import vertex_normals

        item = tiny["validation"][2]
        normals = vertex_normals(gso.Mesh.from_grid(item["surface"])).reshape(16, 16, 3)
        moved = ((item["developable"] - item["surface"]) * normals).sum(axis=-1)
        np.testing.assert_allclose(item["offsets"], moved, atol=1e-6)
        coefficients, misfit = labels.fit_spline(moved)
        np.testing.assert_allclose(item["spline"], coefficients, atol=1e-5)
        assert item["spline_residual"] == pytest.approx(misfit, abs=1e-6)

    def test_storage_changes_no_metric_by_a_thousandth(self):
        for number in select(10, 1, seed=0).main[:2]:
            grid = screen.surface(0, number).sample(64)
            for kind in LABELS:
                label = labels.solve(kind, grid)
                stored = label.arrays[kind].astype(np.float32).astype(float)
                for name, value in self.measured(kind, grid, stored).items():
                    assert value == pytest.approx(label.metrics[name], rel=1e-3), (kind, name)

    def test_metrics_are_those_of_the_arrays(self, tiny):
        split = tiny["test"]
        for kind in LABELS:
            for k in range(3):
                found = self.measured(kind, split["surface"][k], split[kind][k].astype(float))
                for name, value in found.items():
                    stored = split.metrics[kind][name][k]
                    assert value == pytest.approx(stored, rel=5e-3, abs=1e-6), (kind, name)

    @staticmethod
    def measured(kind, surface, label):
        """Metrics of a stored label."""
        task = gso.tasks.get(labels.KINDS[kind].arguments["task"])
        design = gso.Mesh.from_grid(surface)
        flat = label.reshape(-1, label.shape[-1])
        if kind == "developable":
            found = task.metrics(design, design.replaced(flat), None, 1.0)
        else:
            found = task.metrics(design, None, flat, 1.0)
        return {name: found[name] for name in labels.KINDS[kind].metrics}


class TestSet:
    def test_every_surface_is_there_once_with_all_labels(self, tiny):
        assert [len(s) for s in tiny.values()] == [24, 3, 3, 3]
        ids = np.concatenate([s["id"][:] for s in tiny.values()])
        assert len(np.unique(ids)) == 33
        for split in tiny.values():
            assert np.isfinite(split["surface"][:]).all()
            for kind in LABELS:
                for name, shape in labels.shapes(kind, 16).items():
                    assert split[name].shape == (len(split), *shape)
                    assert np.isfinite(split[name][:]).all()
                assert labels.FAILED not in split[f"status/{kind}"][:].astype(str)

    def test_surfaces_come_back_from_the_seed(self, tiny):
        split = tiny["train"]
        for k in (0, 20):
            made = screen.surface(0, int(split["id"][k])).sample(16)
            np.testing.assert_allclose(split["surface"][k], made, atol=1e-12)
        np.testing.assert_allclose(
            split.features["K_A"][:3], TestScreen.features(0, split["id"][:3])["K_A"], rtol=1e-12
        )

    def test_labels_do_not_depend_on_the_company(self, tiny):
        split = tiny["train"]
        alone = labels.solve("lengths", split["surface"][7]).arrays["lengths"]
        np.testing.assert_array_equal(split["lengths"][7], alone.astype(np.float32))

    def test_noise_has_the_four_levels(self, tiny, quick):
        split = tiny["test"]
        for level in LEVELS:
            moved = split[f"noisy_{level:.3f}"][:] - split["surface"][:]
            assert moved.std() == pytest.approx(level, rel=0.03)
            np.testing.assert_allclose(moved, level * split["noise"][:], atol=1e-6)
        np.testing.assert_array_equal(split["noise"][2], quick["test"]["noise"][2])
        assert "noise" not in tiny["train"].arrays

    def test_labels_are_good(self, tiny):
        for split in tiny.values():
            assert not split.metrics["strain"]["flipped_cells"].any()
            assert not split.metrics["lengths"]["flipped_cells"].any()
        found = tiny["train"].metrics["developable"]
        assert found["K_A_r"].mean() > 0.8
        assert found["d_H"].mean() < 1.0

    def test_manifest_tells_what_made_it(self, tiny):
        record = json.loads((tiny.path / "manifest.json").read_text())
        assert record["recipe"]["options"]["developable"]["w_curvature"] > 0
        assert record["versions"]["numpy"] == np.__version__
        assert {f["name"]: f["sha256"] for f in record["files"]} | {"manifest.json": None} == {
            name: None if name == "manifest.json" else digest
            for name, digest in digests(tiny.path).items()
        }
        assert record["summary"]["train"]["count"] == 24
        assert sum(record["summary"]["train"]["intervals"]["K_A"]) == 24
        assert not tiny.damaged()

    def test_named_splits_are_built_too(self, tmp_path):
        data = build(tmp_path, Recipe(n=10, size=16, labels=()), workers=0)
        assert list(data)[4:] == list(shapes.NAMES)
        np.testing.assert_array_equal(
            data["helicoid"]["surface"][:], shapes.sample("helicoid", seed=0, size=16)
        )


class TestReading:
    @pytest.mark.parametrize(
        "key",
        [
            *(0, -1, slice(None), slice(5, 22, 3), [21, 3, 3, -2], np.arange(24) % 5 == 0),
            *((slice(2, 4), 0, slice(3)), (7, ..., 1), [], slice(9, 3)),
        ],
        ids=str,
    )
    def test_arrays_are_indexed_as_those_of_numpy_are(self, tiny, key):
        array = tiny["train"]["surface"]
        np.testing.assert_array_equal(array[key], np.asarray(array)[key])

    def test_an_index_out_of_range_is_refused(self, tiny):
        with pytest.raises(IndexError):
            tiny["train"]["surface"][24]

    def test_arrays_can_be_sent_to_other_processes(self, tiny):
        array = tiny["train"]["surface"]
        here, there = multiprocessing.Pipe()
        here.send(array)
        np.testing.assert_array_equal(there.recv()[[3, 22]], array[[3, 22]])

    def test_only_what_is_asked_for_is_read(self, tiny, tmp_path, monkeypatch):
        dataset.export(tiny, tmp_path, only=("train",))
        array = dataset.open(tmp_path)["train"]["surface"]
        asked, load = [], np.load

        def read(path, *more, **given):
            asked.append(Path(path).stem)
            return load(path, *more, **given)

        monkeypatch.setattr(np, "load", read)
        array[[12, 14]]
        assert asked == ["00012", "00014"]

    def test_reading_does_not_load_the_solver(self, tiny):
        code = (
            f"import sys, gso\nd = gso.dataset.open({str(tiny.path)!r})\nd['test']['surface'][:]\n"
            "print({m for m in sys.modules if m.startswith(('gso.tno', 'torch', 'casadi'))})"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
        assert done.stdout.strip() == b"set()"

    def test_names_that_do_not_exist_are_refused(self, tiny):
        with pytest.raises(DatasetError, match=r"'tests'.*train"):
            tiny["tests"]
        with pytest.raises(DatasetError, match=r"'flat'.*surface"):
            tiny["test"]["flat"]

    def test_torch_gets_tensors(self, tiny):
        torch = pytest.importorskip("torch")
        for in_memory in (False, True):
            data = tiny["train"].torch("surface", "strain", "spline", in_memory=in_memory)
            batch = next(iter(torch.utils.data.DataLoader(data, batch_size=4)))
            assert [tuple(t.shape) for t in batch] == [(4, 3, 16, 16), (4, 2, 16, 16), (4, 16, 16)]
            expected = tiny["train"]["surface"][2].transpose(2, 0, 1)
            np.testing.assert_allclose(batch[0][2], expected, atol=1e-7)
            assert len(list(data)) == 24

    def test_no_set_is_no_set(self, tmp_path):
        with pytest.raises(DatasetError, match="holds no dataset"):
            dataset.open(tmp_path)
        with pytest.raises(DatasetError, match="cannot be read"):
            dataset.open(tmp_path / "nowhere")
        (tmp_path / "manifest.json").write_text('{"format": 1')
        with pytest.raises(DatasetError, match="damaged"):
            dataset.open(tmp_path)
        (tmp_path / "manifest.json").write_text('{"format": 99}')
        with pytest.raises(DatasetError, match="format 99"):
            dataset.open(tmp_path)

    def test_damage_is_found_and_mended(self, quick, tmp_path):
        shutil.copytree(quick.path, tmp_path / "set")
        victim = tmp_path / "set" / "train" / "00001.h5"
        victim.write_bytes(victim.read_bytes()[:-1000])
        (tmp_path / "set" / "test" / "00000.h5").unlink()
        data = dataset.open(tmp_path / "set")
        assert data.damaged() == ["train/00001.h5", "test/00000.h5"]
        with pytest.raises(DatasetError, match=r"00001.h5 is missing or damaged.*build"):
            data["train"]["surface"][-1]
        build(tmp_path / "set", QUICK, workers=0)
        assert digests(tmp_path / "set") == digests(quick.path)


class TestFolders:
    def test_a_set_goes_to_files_and_comes_back(self, tiny, tmp_path):
        assert dataset.export(tiny, tmp_path, only=("train", "test")) == 27
        again = dataset.open(tmp_path)
        assert {name: len(split) for name, split in again.items()} == {"test": 3, "train": 24}
        file = np.load(tmp_path / "train" / "00007.npy")
        assert (file.shape, file.dtype) == ((16, 16, 3), np.float64)
        np.testing.assert_array_equal(again["train"]["surface"][:], tiny["train"]["surface"][:])
        found = dataset.summarise(again)["test"]
        assert found["count"] == 3
        assert found["labels"] == {}

    def test_results_have_the_names_of_the_surfaces(self, tiny, tmp_path):
        dataset.export(tiny, tmp_path / "flat", array="strain", only=("test",))
        dataset.export(tiny, tmp_path / "noisy", array="noisy_0.010")
        assert sorted(p.name for p in (tmp_path / "flat" / "test").iterdir()) == sorted(
            p.name for p in (tmp_path / "noisy" / "test").iterdir()
        )
        flat = dataset.open(tmp_path / "flat")
        assert flat["test"]["surface"].shape == (3, 16, 16, 2)
        with pytest.raises(DatasetError, match="flat images"):
            dataset.summarise(flat)

    def test_what_cannot_be_exported_is_said(self, tiny, tmp_path):
        with pytest.raises(DatasetError, match="'curl'"):
            dataset.export(tiny, tmp_path, array="curl")
        with pytest.raises(DatasetError, match="no grid"):
            dataset.export(tiny, tmp_path, array="offsets")
        (tmp_path / "file").write_text("")
        with pytest.raises(DatasetError):
            dataset.export(tiny, tmp_path / "file")

    @pytest.mark.parametrize(
        ("content", "message"),
        [
            (b"", "no intact array"),
            (b"\x93NUMPY\x01\x00v\x00{'descr': '<f8', 'shape': (9999, 9999, 3)}", "no intact"),
            (np.zeros((4, 4)), "no grid"),
            (np.full((4, 4, 3), np.nan), r"vertex \(0, 0\)"),
            (np.ones((4, 4, 3)), "are one"),
            (np.array([{}]), "no intact"),
            (np.arange(60.0).reshape(5, 4, 3), "first one has"),
        ],
        ids=["empty", "cut", "flat", "nan", "point", "pickle", "shape"],
    )
    def test_bad_files_are_named(self, tmp_path, content, message):
        (tmp_path / "train").mkdir()
        np.save(tmp_path / "train" / "a.npy", np.arange(48.0).reshape(4, 4, 3))
        bad = tmp_path / "train" / "b.npy"
        if isinstance(content, bytes):
            bad.write_bytes(content)
        else:
            np.save(bad, content, allow_pickle=True)
        with pytest.raises(DatasetError, match=f"b.npy.*{message}"):
            dataset.open(tmp_path)["train"]["surface"][:]


class TestSurvival:
    def test_more_processes_change_no_byte(self, quick, tmp_path):
        build(tmp_path, QUICK, workers=2)
        assert digests(tmp_path) == digests(quick.path)

    @pytest.mark.slow
    def test_a_killed_build_goes_on_where_it_was(self, quick, tmp_path):
        psutil = pytest.importorskip("psutil")
        place = tmp_path / "set"
        options = ["--n", "30", "--size", "16", "--no-extras", "--label", "strain"]
        code = f"import gso.dataset.shard as s; s.LENGTH = {LENGTH}; import gso.cli as c; c.main()"
        command = [sys.executable, "-c", code, "dataset", "build", "-o", str(place)]
        for files in (0, 1):
            run = subprocess.Popen([*command, *options, "--workers", "2"], stderr=subprocess.PIPE)
            while run.poll() is None and len(list(place.rglob("*.h5"))) < files + 1:
                if files == 0 and (place / "manifest.json").exists():
                    break
                time.sleep(0.005)
            children = psutil.Process(run.pid).children(recursive=True)
            run.send_signal(signal.SIGKILL)
            run.wait()
            # Nobody is left behind to work for nobody.
            assert not psutil.wait_procs(children, timeout=30)[1]
            with pytest.raises(DatasetError, match="not finished"):
                dataset.open(place)
        (place / "train" / ".gso-0123456789abcdef.tmp").write_bytes(b"half")
        before = {p: p.stat().st_mtime_ns for p in place.rglob("*.h5")}
        assert len(before) >= 2
        data = build(place, QUICK, workers=0)
        assert digests(place) == digests(quick.path)
        assert {p: p.stat().st_mtime_ns for p in before} == before
        assert len(data["train"]) == 24

    def test_a_killed_worker_is_replaced(self, quick, tmp_path):
        killed = []

        def kill(what, done, total):
            if what == "surfaces labelled" and done > 0 and not killed:
                killed.append(multiprocessing.active_children()[0].pid)
                os.kill(killed[0], signal.SIGKILL)

        build(tmp_path, QUICK, workers=2, tick=kill)
        assert killed
        assert digests(tmp_path) == digests(quick.path)

    @pytest.mark.slow
    def test_a_cluster_makes_the_same_bytes_though_a_worker_is_killed(self, quick, tmp_path):
        distributed = pytest.importorskip("distributed")
        killed = []
        with distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster:

            def kill(what, done, total):
                if what == "surfaces labelled" and done > 0 and not killed:
                    killed.append(cluster.workers[0].pid)
                    os.kill(killed[0], signal.SIGKILL)

            address = cluster.scheduler_address
            data = build(tmp_path, QUICK, scheduler=address, tick=kill)
        assert killed
        assert len(data["train"]) == 24
        assert digests(tmp_path) == digests(quick.path)

    def test_a_scheduler_that_is_not_there_is_reported(self, tmp_path, monkeypatch):
        pytest.importorskip("distributed")
        monkeypatch.setattr("gso.executors.dask.PATIENCE", 0.5)
        with pytest.raises(DatasetError, match="no Dask scheduler answers at tcp:"):
            build(tmp_path, QUICK, scheduler="tcp://127.0.0.1:9")

    def test_a_full_disk_is_reported_and_loses_nothing(self, quick, tmp_path, monkeypatch):
        sync, calls = os.fsync, []

        def full(descriptor):
            calls.append(descriptor)
            if len(calls) > 3:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            sync(descriptor)

        monkeypatch.setattr(os, "fsync", full)
        with pytest.raises(DatasetError, match=r"No space left.*24 of 33.*nothing of it is lost"):
            build(tmp_path, QUICK, workers=0)
        monkeypatch.undo()
        kept = [p for p in digests(tmp_path) if p.endswith(".h5")]
        assert kept == ["train/00000.h5", "train/00001.h5"]
        build(tmp_path, QUICK, workers=0)
        assert digests(tmp_path) == digests(quick.path)

    def test_two_builds_do_not_mix(self, quick, tmp_path):
        from filelock import FileLock

        shutil.copytree(quick.path, tmp_path / "set")
        with pytest.raises(DatasetError, match="seed 0, not 1"):
            build(tmp_path / "set", replace(QUICK, seed=1))
        with FileLock(tmp_path / "set" / ".lock"), pytest.raises(DatasetError, match="another"):
            build(tmp_path / "set", QUICK)
        with pytest.raises(DatasetError, match="holds set and no dataset"):
            build(tmp_path, QUICK)
        (tmp_path / "file").write_text("")
        with pytest.raises(DatasetError, match="cannot be made a folder"):
            build(tmp_path / "file", QUICK)

    def test_other_versions_do_not_mix(self, quick, tmp_path, monkeypatch):
        shutil.copytree(quick.path, tmp_path / "set")
        versions = gso.dataset.recipe.versions()
        monkeypatch.setattr(
            "gso.dataset.builder.versions", lambda device: versions | {"numpy": "0.1"}
        )
        # What is complete stays as it is, whatever is installed now.
        build(tmp_path / "set", QUICK)
        (tmp_path / "set" / "test" / "00000.h5").unlink()
        with pytest.raises(DatasetError, match=r"numpy .* not '0.1'"):
            build(tmp_path / "set", QUICK)
        monkeypatch.undo()
        task = gso.dataset.shard.Task("train", 0, (1,))
        with pytest.raises(DatasetError, match=r"train/00000.h5.*numpy .* instead of 0.1"):
            gso.dataset.shard.make(QUICK, versions | {"numpy": "0.1"}, task)


class TestDevice:
    """Labels from batches."""

    def test_labels_are_nearly_the_same(self, tiny, batched):
        assert batched.manifest["device"] == "cpu"
        assert "torch" in batched.manifest["versions"]
        assert "device" not in tiny.manifest
        for split, there in tiny.items():
            here = batched[split]
            assert here.arrays.keys() == there.arrays.keys()
            for name, array in there.arrays.items():
                assert (here[name].shape, here[name].dtype) == (array.shape, array.dtype)
        for name in tiny["train"].arrays:
            here, there = (
                np.concatenate([s[name][:] for s in d.values()]) for d in (batched, tiny)
            )
            if name.startswith(("status", "surface", "features", "id")):
                assert (here == there).mean() > 0.95
            else:
                # The residual of the spline is zero up to rounding errors.
                size = max(np.abs(there).max(), 1e-6)
                off = (np.abs(here - there) / size).reshape(len(there), -1)
                # On a few surfaces the iterations amplify rounding errors.
                equal = off.max(axis=1) < 1e-6
                assert equal.mean() > 0.8, name
                parts = np.split(equal, np.cumsum([len(s) for s in tiny.values()])[:-1])
                assert all(part.any() for part in parts), name

    def test_a_build_goes_on_where_it_was(self, batched, tmp_path):
        place = tmp_path / "set"
        shutil.copytree(batched.path, place)
        before = digests(place)
        (place / "test" / "00000.h5").unlink()
        build(place, TINY, device="cpu", workers=0)
        assert digests(place) == before

    def test_a_set_goes_on_with_its_device(self, batched, quick, tmp_path):
        place = tmp_path / "batched"
        shutil.copytree(batched.path, place)
        lost = place / "test" / "00000.h5"
        content = lost.read_bytes()
        lost.unlink()
        build(place, TINY, workers=0)
        assert lost.read_bytes() == content
        place = tmp_path / "quick"
        shutil.copytree(quick.path, place)
        with pytest.raises(DatasetError, match="begun without --device, not with --device cpu"):
            build(place, QUICK, device="cpu", workers=0)

    def test_labels_from_a_graphics_processor(self, quick, tmp_path, monkeypatch):
        pytest.importorskip("torch")
        from gso.tno.batched import device

        real, sizes = device.solve, []

        def solve(parts, device):
            sizes.append(len(parts))
            return real(parts, "cpu")

        monkeypatch.setattr(device, "check_device", lambda name: None)
        monkeypatch.setattr(device, "solve", solve)
        made = build(tmp_path / "set", QUICK, device="cuda", workers=1)
        assert sizes
        assert made.manifest["device"] == "cuda"
        for split, there in quick.items():
            np.testing.assert_array_equal(made[split]["surface"][:], there["surface"][:])
            for name in ("developable", "strain", "lengths"):
                if name in there.arrays:
                    off = np.abs(made[split][name][:] - there[name][:]).max(axis=(1, 2, 3))
                    assert np.median(off) < 1e-5

    def test_a_device_that_is_gone(self, batched, tmp_path, monkeypatch):
        from gso.tno.batched import device

        def refused(name):
            raise OptionError(f"device {name!r} cannot be used")

        place = tmp_path / "batched"
        shutil.copytree(batched.path, place)
        (place / "test" / "00000.h5").unlink()
        monkeypatch.setattr(device, "check_device", refused)
        with pytest.raises(OptionError, match="cannot be used"):
            build(place, TINY, workers=0)
        with pytest.raises(OptionError, match="cannot be used"):
            labels.solve_many("strain", np.zeros((1, 9, 9, 3)), "cuda")

    def test_a_surface_that_fails_leaves_the_others(self):
        pytest.importorskip("torch")
        points = shapes.sample("torus", seed=0, size=16)[:3].copy()
        points[1] = 0.0
        found = labels.solve_many("strain", points, "cpu")
        assert [label.status == labels.FAILED for label in found] == [False, True, False]
        alone = labels.solve("strain", points[2])
        np.testing.assert_allclose(found[2].arrays["strain"], alone.arrays["strain"], atol=1e-6)

    def test_a_device_that_is_not_there_is_refused(self, tmp_path):
        torch = pytest.importorskip("torch")
        if torch.cuda.is_available():
            pytest.skip("CUDA is there")
        with pytest.raises(OptionError, match="device 'cuda' cannot be used"):
            build(tmp_path / "set", QUICK, device="cuda")
        given = ["dataset", "build", "-o", str(tmp_path / "set"), "--device", "cuda"]
        result = CliRunner().invoke(main, given)
        assert result.exit_code != 0
        assert "device 'cuda'" in result.output + str(result.exception)
        assert not (tmp_path / "set").exists()


class TestReference:
    def test_it_is_added_to_a_set_that_is_there(self, tmp_path):
        place = tmp_path / "set"
        recipe = replace(QUICK, labels=())
        build(place, recipe, workers=0)
        before = digests(place)
        data = build(place, recipe, reference=["jiang2020"], workers=0)
        assert data["test"]["jiang2020"].shape == (3, 16, 16, 3)
        assert data["test"]["jiang2020_flat"].shape == (3, 16, 16, 2)
        found = data["test"].metrics["jiang2020"]
        assert set(found) == set(labels.KINDS["jiang2020"].metrics)
        assert all(np.isfinite(values).all() for values in found.values())
        assert data.manifest["reference_options"]["jiang2020"]["w_isometry"] > 0
        assert "jiang2020" not in data["train"].arrays
        after = digests(place)
        assert {k for k in after if k not in before} == {"test/00000.jiang2020.h5"}
        assert all(after[k] == v for k, v in before.items() if k != "manifest.json")
        # Asked for or not, what is there stays a part of the set.
        assert "jiang2020" in build(place, recipe, workers=0)["test"].arrays
        build(tmp_path / "once", recipe, reference=["jiang2020"], workers=0)
        assert digests(tmp_path / "once") == after

    def test_unknown_ones_are_refused(self, tmp_path):
        with pytest.raises(OptionError, match="no reference 'wang'"):
            build(tmp_path, QUICK, reference=["wang"])
        with pytest.raises(OptionError, match="no split 'torus'"):
            build(tmp_path, QUICK, reference=["jiang2020"], reference_splits=["torus"])
        assert not list(tmp_path.iterdir())


class TestCommands:
    def run(self, *words):
        done = CliRunner().invoke(main, ["dataset", *map(str, words)], prog_name="gso")
        assert done.exit_code == 0, done.output
        return done.output

    def test_build_says_how_fast_it_was(self, tmp_path):
        out = self.run(
            *("build", "--n", 10, "--size", 16, "--no-extras", "--label", "strain"),
            *("--workers", 0, "-o", tmp_path / "set"),
        )
        assert "11 surfaces labelled in" in out
        assert "per second" in out
        assert self.run("info", tmp_path / "set").startswith(f"{tmp_path / 'set'}: 10 surfaces")

    def test_a_set_without_labels(self, tmp_path):
        place = tmp_path / "set"
        words = ("build", "-o", place, "--n", 12, "--size", 16, "--no-extras", "--workers", 0)
        self.run(*words, "--label", "none")
        assert sorted(dataset.open(place)["train"].arrays) == ["features", "id", "surface"]
        assert "0.1 to 0.2" in self.run("info", place)

    def test_none_is_no_label_among_others(self, tmp_path):
        words = ["build", "-o", str(tmp_path), "--label", "none", "--label", "strain"]
        done = CliRunner().invoke(main, ["dataset", *words], prog_name="gso")
        assert done.exit_code == 1
        assert "--label none goes with no other" in done.stderr

    def test_info_shows_intervals_and_labels_beside_the_published_figures(self, tiny, tmp_path):
        pytest.importorskip("matplotlib")
        table, picture = tmp_path / "set.json", tmp_path / "set.png"
        out = self.run("info", tiny.path, "--verify", "--json", table, "--plot", picture)
        rows = [line.split() for line in out.splitlines()]
        assert ["0.1", "to", "0.2"] in [r[:3] for r in rows]
        assert next(r for r in rows if r[:1] == ["K_A_r"])[3] == "0.8888"
        assert next(r for r in rows if r[:1] == ["loss_iso_cell"])[3] == "0.00033"
        assert "all files are as they were written" in out
        assert picture.read_bytes().startswith(b"\x89PNG")
        record = json.loads(table.read_text())
        assert "files" not in record
        assert record["summary"] == json.loads(json.dumps(dataset.summarise(tiny)))

    def test_info_reads_folders_of_files(self, tiny, tmp_path):
        self.run("export", tiny.path, "-o", tmp_path, "--split", "test")
        out = self.run("info", tmp_path)
        assert "a folder of .npy files" in out
        assert ["test", "3"] in [line.split()[:2] for line in out.splitlines()]

    def test_errors_are_one_line(self, tmp_path):
        done = CliRunner().invoke(main, ["dataset", "info", str(tmp_path)], prog_name="gso")
        assert done.exit_code == 1
        assert done.output.startswith("gso: error:") or done.stderr.startswith("gso: error:")


class TestSummary:
    def test_the_committed_manifest_is_that_of_the_published_size(self):
        path = ROOT / "bench" / "data" / "dataset_manifest.json"
        if not path.exists():
            pytest.skip("the manifest of the large set is not there")
        record = json.loads(path.read_text())
        named = [f.name for f in fields(Recipe) if f.name in record["recipe"]]
        recipe = Recipe(**{name: record["recipe"][name] for name in named})
        assert record["splits"] == recipe.splits == Recipe().splits
        main_splits = [record["summary"][name] for name in ("train", "validation", "test")]
        total = sum(s["count"] * s["features"]["K_A"]["mean"] for s in main_splits)
        assert total / recipe.n == pytest.approx(0.307, abs=0.01)
        filled = {"K_A": len(screen.CURVATURE) - 1, "sigma2": len(screen.SHAPE) - 1}
        for split in main_splits:
            for name, count in filled.items():
                assert min(split["intervals"][name][:count]) > 0
            for ends in split["status"].values():
                assert labels.FAILED not in ends

"""Nets as ONNX files: what they compute, their cards, and predictions without PyTorch."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import cache

import numpy as np
import pytest

from gso import BackendError, OptionError, WeightsError
from tests.conftest import EXHAUSTIVE, saddle

torch = pytest.importorskip("torch")
onnxruntime = pytest.importorskip("onnxruntime")
pytest.importorskip("onnxscript")

from gso.net import (  # noqa: E402
    CHAINS,
    CoarseNet,
    GSONet,
    available,
    export,
    load,
    predict,
    read_card,
    save,
)
from tests.test_net import shaken  # noqa: E402

# An export takes some seconds, also of a small net.
pytestmark = pytest.mark.slow

SMALL = {"widths": (8, 8, 8), "depths": (1, 1, 1)}
#: Equal to this, in radii of the unit ball.
CLOSE = 1e-4


def nets():
    return {
        "coarse": shaken(CoarseNet(**SMALL, passes=2, confidence=True), size=0.02),
        "noise": shaken(
            GSONet("denoise", channels=4, blocks=1, sigma=True, aligned=True, stencils=True),
            size=0.01,
        ),
    }


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A function that returns a net of `nets` and its exported file, made at the first call.

    All passes are exported from weights beside the file, and fewer ones from the net itself.
    """
    folder, known = tmp_path_factory.mktemp("exported"), nets()

    @cache
    def exported(name, passes=None):
        net = known[name]
        if passes is not None:
            return net, export(net, folder / f"{name}-{passes}.onnx", passes=passes)[0]
        weights = folder / f"{name}.safetensors"
        save(net, weights, dtype=torch.float32)
        return net, export(weights, folder / f"{name}.onnx")[0]

    return exported


@pytest.fixture(scope="module")
def packaged(tmp_path_factory):
    """A function that returns exported files of a net of the package, made at the first call."""
    folder = tmp_path_factory.mktemp("packaged")

    @cache
    def exported(name, passes=None):
        return export(name, folder / f"{name}-{passes or 'all'}.onnx", passes=passes)

    return exported


@pytest.mark.parametrize("name", ["coarse", "noise"])
@pytest.mark.parametrize("shape", [(64, 64), (40, 90), (3, 64, 64)])
def test_predictions_are_those_of_pytorch(files, name, shape):
    net, path = files(name)
    rng = np.random.default_rng(0)
    points = saddle(91)[: shape[-2], : shape[-1]]
    points = 7.0 * points + 1e-3 * rng.normal(size=(*shape, 3)) * (name == "noise") + 100.0
    # Random weights add curvature, so that a guarded prediction would be the input.
    for more in ({}, {"sigma": 0.01} if name == "noise" else {"device": "cpu"}):
        more["guarded"] = False
        ours, theirs = (predict(points, task=net.task, model=m, **more) for m in (net, path))
        assert ours.shape == theirs.shape
        assert np.abs(ours - theirs).max() < 7.0 * CLOSE
    assert np.abs(ours - points).max() > 100 * np.abs(ours - theirs).max()


def test_the_file_is_described(files):
    net, path = files("noise")
    card = read_card(path)
    assert path.with_name("noise.onnx.json").exists()
    assert card["task"] == "denoise" and card["model"]["kind"] == "gsonet"
    assert card["onnx"] == {
        "opset": 18,
        "inputs": ["surface", "sigma"],
        "outputs": ["displacements"],
        "size": 64,
        "passes": 1,
    }
    session = onnxruntime.InferenceSession(path)
    assert [i.name for i in session.get_inputs()] == card["onnx"]["inputs"]
    assert session.get_inputs()[0].shape == ["batch", 64, 64, 3]
    # Outside of the package: positions in, displacements out.
    unit = torch.as_tensor(saddle(64)[None], dtype=torch.float32)
    level = torch.tensor([0.01])
    (moved,) = session.run(["displacements"], {"surface": unit.numpy(), "sigma": level.numpy()})
    with torch.inference_mode():
        expected = net(unit, level)
    np.testing.assert_allclose(unit + moved, expected, atol=1e-5)


def test_fewer_passes(files, tmp_path):
    net, path = files("coarse")
    _, once = files("coarse", 1)
    more = {"passes": 1, "guarded": False}
    ours, theirs = (predict(saddle(64), model=m, **more) for m in (net, once))
    assert np.abs(ours - theirs).max() < CLOSE < np.abs(ours - saddle(64)).max()
    with pytest.raises(OptionError, match=r"exported with 2 passes, not 1"):
        predict(saddle(64), model=path, passes=1)
    with pytest.raises(OptionError, match="from 1 to 2"):
        export(net, tmp_path / "often.onnx", passes=3)


def test_several_nets_one_after_the_other(files):
    net, path = files("coarse")
    # Random weights add curvature, so that a guarded prediction would be the input.
    more = {"guarded": False}
    twice = predict(predict(saddle(64), model=net, **more), model=net, **more)
    for models in ([net, path], (path, path)):
        assert np.abs(predict(saddle(64), model=models, **more) - twice).max() < 2 * CLOSE
    with pytest.raises(OptionError, match="empty"):
        predict(saddle(64), model=[])


class TestFiles:
    @pytest.fixture
    def path(self, files, tmp_path):
        _, path = files("coarse")
        for source in (path, path.with_name("coarse.onnx.json")):
            (tmp_path / source.name).write_bytes(source.read_bytes())
        return tmp_path / "coarse.onnx"

    def test_the_card_of_the_weights_beside_it_stays(self, files, tmp_path):
        net, path = files("noise")
        save(net, tmp_path / "noise.safetensors", dtype=torch.float32)
        card = path.with_name("noise.json")
        assert card.read_bytes() == (tmp_path / "noise.json").read_bytes()
        assert load(path.with_name("noise.safetensors")).task == "denoise"

    def test_damage(self, path):
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 1
        path.write_bytes(data)
        with pytest.raises(WeightsError, match="is damaged"):
            predict(saddle(8), model=path)

    def test_no_card(self, path):
        path.with_name("coarse.onnx.json").unlink()
        with pytest.raises(WeightsError, match=r"coarse\.onnx\.json cannot be read"):
            predict(saddle(8), model=str(path))

    def test_no_file(self, path):
        path.unlink()
        with pytest.raises(WeightsError, match="cannot be read"):
            predict(saddle(8), model=path)

    @pytest.mark.parametrize(
        "change",
        [
            {"onnx": {}},
            {"onnx": {"inputs": ["x"], "outputs": ["y"], "passes": 1}},
            {"task": "no task"},
        ],
    )
    def test_another_card(self, path, change):
        card = path.with_name("coarse.onnx.json")
        card.write_text(json.dumps(json.loads(card.read_text()) | change))
        with pytest.raises(WeightsError, match=r"coarse\.onnx"):
            predict(saddle(8), model=path)

    def test_other_uses(self, path, tmp_path, monkeypatch):
        with pytest.raises(OptionError, match="for task 'developable', not 'flatten'"):
            predict(saddle(8), task="flatten", model=path)
        with pytest.raises(OptionError, match="no device 'tape'"):
            predict(saddle(8), model=path, device="tape")
        with pytest.raises(WeightsError, match="without weights to load"):
            load(path)
        with pytest.raises(WeightsError, match="no net 'nothing'"):
            export("nothing", tmp_path / "a.onnx")
        monkeypatch.setattr("gso.net.onnx_file.find_spec", lambda name: None)
        with pytest.raises(BackendError, match=r'pip install "\.\[onnx\]"'):
            export(nets()["noise"], tmp_path / "a.onnx")


WITHOUT = """
import sys, importlib.util
real = importlib.util.find_spec
hidden = set(sys.argv[1].split(","))
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in hidden:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Hidden())
def find_spec(name, package=None):
    return None if name in hidden else real(name, package)
importlib.util.find_spec = find_spec
import numpy as np, gso
points = np.load("points.npy")
"""


def run_without(hidden, code, folder):
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT + code, hidden],
        capture_output=True,
        text=True,
        cwd=folder,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_predictions_and_starts_without_pytorch(files, tmp_path):
    net, path = files("coarse")
    _, once = files("coarse", 1)
    points = saddle(40)
    np.save(tmp_path / "points.npy", points)
    code = f"""
np.save("found.npy", gso.net.predict(points, model={str(path)!r}))
try:
    gso.net.predict(points)
except gso.BackendError as error:
    print(error)
print(gso.hybrid.solve(points, net={str(once)!r}, polish=False, verdict=False).warm_start)
print("torch" in sys.modules)
"""
    said = run_without("torch,safetensors", code, tmp_path).splitlines()
    assert "nets need torch" in said[0] and "gso.net.export" in said[0]
    assert said[1:] == ["net", "False"]
    moved = np.load(tmp_path / "found.npy")
    assert np.abs(moved - predict(points, model=net)).max() < CLOSE


def test_hybrid_solves_without_pytorch(packaged, tmp_path):
    # A net of the package: starts from random weights would be dropped. A new one moves nothing.
    (once,) = packaged("developable", 1)
    (twice,) = export(CoarseNet(**SMALL, passes=2), tmp_path / "new.onnx")
    assert [read_card(path)["onnx"]["passes"] for path in (once, twice)] == [1, 2]
    points = saddle(64)
    np.save(tmp_path / "points.npy", points)
    code = f"""
import warnings
from gso.cli import main
warnings.simplefilter("ignore")
once, twice = {str(once)!r}, {str(twice)!r}
def show(result):
    print(result.warm_start, result.iterations, result.details.get("net"), sep=",")
for net in (once, [once, twice]):
    show(gso.hybrid.solve(points, net=net, verdict=False))
for polish in (2, False):
    result = gso.hybrid.solve(points, net=once, polish=polish, verdict=False)
    show(result)
np.save("alone.npy", result.mesh.vertices)
for workers in (0, 1):
    for item in gso.hybrid.solve_many([points], net=once, workers=workers, verdict=False):
        show(item.result)
# Loading ONNX Runtime pays where PyTorch would not be worth it, or is missing. The times are fixed.
from gso.hybrid import time_model
known = time_model.measured()
known["load"] = {{"torch": 2.1, "onnxruntime": 0.5}}
for preset, (cold, warm) in {{"balanced": (0.4, 0.3), "accurate": (1.4, 0.6)}}.items():
    for k, row in enumerate(known["presets"][preset]):
        row |= {{"cold": cold * 4**k, "net": warm * 4**k, "energy": 1.0, "strain": 1.0}}
for preset in ("balanced", "accurate"):
    show(gso.hybrid.solve(points, net=once, sparing=True, options=preset, verdict=False))
# A result that is near its design is solved once.
np.save("low.npy", points * [1.0, 1.0, 0.3])
main(["optimize", "low.npy", "-o", "out.npz", "--method", "hybrid", "--net", once, "--quiet"],
     standalone_mode=False)
print(gso.Result.load("out.npz").details["net"])
print("torch" in sys.modules)
"""
    *said, file, loaded = run_without("torch,safetensors", code, tmp_path).splitlines()
    starts, iterations, nets = zip(*(line.split(",", 2) for line in said), strict=True)
    assert starts == ("net",) * 6 + ("cold", "net")
    assert iterations[2:4] == ("2", "0") and iterations[4:6] == iterations[:1] * 2
    assert nets[:2] == (str(once), f"{once}, {twice}")
    assert (file, loaded) == (str(once), "False")
    moved = np.load(tmp_path / "alone.npy").reshape(points.shape)
    assert np.abs(moved - predict(points, model="developable", passes=1)).max() < CLOSE


def test_without_the_runtime(files, tmp_path):
    np.save(tmp_path / "points.npy", saddle(8))
    code = f"""
try:
    gso.net.predict(points, model={str(files("coarse")[1])!r})
except gso.BackendError as error:
    print(error)
"""
    assert 'pip install ".[onnx]"' in run_without("onnxruntime", code, tmp_path)


#: Nets of the package that are exported whole. Their kinds and tasks, with those of the small nets
#: above, are those of all nets. The how-to guide exports "developable".
PACKAGED = ["net-cf", "flatten-strain", "flatten-w"]


def parts_of(name):
    return CHAINS.get(name, (name,))


def test_each_kind_and_task_is_among_the_exported_nets():
    def kinds(names):
        packaged = [load(net) for name in names for net in parts_of(name)]
        return {(type(net), net.task) for net in [*packaged, *nets().values()]}

    assert kinds(PACKAGED) == kinds(available())


@pytest.mark.parametrize("name", available() if EXHAUSTIVE else PACKAGED)
def test_nets_of_the_package(name, packaged):
    parts, exported = parts_of(name), packaged(name)
    for net, file in {name: exported, **dict(zip(parts, exported, strict=True))}.items():
        for points in (saddle(64), saddle(64)[:40]):
            task = load(parts[0]).task
            ours, theirs = (predict(points, task=task, model=m) for m in (net, file))
            assert np.abs(ours - theirs).max() < CLOSE

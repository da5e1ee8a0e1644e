"""Nets: their sizes, invariances, files, and what predict makes of a surface."""

from __future__ import annotations

import copy
import json
import subprocess
import sys
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gso
from gso import MeshError, OptionError, WeightsError, parametrization
from tests.conftest import cylinder, rotation, saddle

torch = pytest.importorskip("torch")
pytest.importorskip("safetensors")

from gso.net import (  # noqa: E402
    CHAINS,
    CoarseNet,
    GSONet,
    available,
    load,
    located,
    read_card,
    save,
    tasks,
)
from gso.net.models import Convolution, axes  # noqa: E402
from gso.net.models.blocks import IMDB, Stencils  # noqa: E402

#: Random nets do harm: the results of most tests are those without a guard.
predict = partial(gso.net.predict, guarded=False)


def shaken(net, seed=0, size=0.05):
    """The same net with random numbers where it begins with zeros."""
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for p in net.parameters():
            p.add_(size * torch.randn(p.shape, generator=generator))
    return net.eval()


def close(result, expected, moved):
    """Equal but for the rounding of second differences in single precision."""
    assert np.abs(result - expected).max() < 0.02 * np.abs(moved).max()


@pytest.fixture(scope="module")
def coarse():
    return shaken(CoarseNet(widths=(16, 16, 16), depths=(1, 1, 1)))


@pytest.fixture(scope="module")
def flatten():
    return shaken(CoarseNet("flatten", widths=(16, 16, 16), depths=(1, 1, 1)))


@pytest.fixture(scope="module")
def aligned():
    return shaken(GSONet(channels=8, blocks=1, aligned=True), size=0.01)


@pytest.fixture(scope="module")
def aligned_flatten():
    return shaken(GSONet("flatten", channels=8, blocks=1, aligned=True), size=0.01)


@pytest.fixture(scope="module")
def published():
    return shaken(GSONet(channels=8, blocks=1), size=0.01)


def test_stencils_show_place_slope_and_bending():
    layer = Stencils(1, 9).requires_grad_(False)
    layer.weight.copy_(torch.eye(9).view(9, 1, 3, 3))
    u, v = torch.meshgrid(*(torch.linspace(-0.5, 0.5, 64) for _ in range(2)), indexing="ij")
    step = 1 / 63
    plane = layer((0.3 + 0.2 * u - 0.1 * v)[None, None])[0]
    # To the last vertex of the border.
    torch.testing.assert_close(plane[0], 2.0 * (0.3 + 0.2 * u - 0.1 * v), atol=1e-5, rtol=0)
    for k, value in enumerate([-6.4 * step, 0.0, 12.8 * step, 0.0, 0.0, 0.0, 0.0, 0.0], start=1):
        torch.testing.assert_close(plane[k], torch.full_like(u, value), atol=1e-3, rtol=0)
    bent = layer((u**2 + 0.5 * u * v - 2.0 * v**2)[None, None])[0, :, 1:-1, 1:-1]
    for k, value in {2: -4.0, 4: 0.5, 6: 2.0}.items():
        expected = torch.full_like(bent[k], 2048.0 * value * step**2)
        torch.testing.assert_close(bent[k], expected, atol=2e-3, rtol=0)


def test_stencils_can_be_any_convolution():
    kernels = torch.randn(4, 3, 3, 3)
    layer = Stencils(3, 4).requires_grad_(False)
    layer.weight.copy_(layer.factors(kernels))
    torch.testing.assert_close(layer.kernels(), kernels, atol=1e-4, rtol=1e-4)
    for shape in ((2, 3, 12, 10), (1, 3, 3, 4)):
        x = torch.randn(shape)
        expected = torch.conv2d(x, kernels)
        torch.testing.assert_close(layer(x)[..., 1:-1, 1:-1], expected, atol=1e-4, rtol=1e-4)


def test_stencils_lose_nothing_in_half_precision_around_them():
    layer = Stencils(3, 8).requires_grad_(False).eval()
    x = torch.as_tensor(saddle(64), dtype=torch.float32).movedim(-1, 0)[None]
    expected = layer(x)
    with torch.autocast("cpu", torch.bfloat16):
        assert (layer(x) - expected).abs().max() < 0.02 * expected.abs().max()
    torch.testing.assert_close(layer(x), expected)


def test_single_grids_keep_single_precision_where_others_choose_half():
    net = shaken(GSONet(channels=8, blocks=1), size=0.02)
    points = torch.as_tensor(saddle(32)[None], dtype=torch.float32)
    block, x = IMDB(8).eval(), torch.randn(1, 8, 8, 8)
    with torch.inference_mode():
        expected = net(points)
        net.bf16 = True
        assert (net(points) - expected).abs().max() < 0.02 * (expected - points).abs().max()
        expected = block(x)
        with torch.autocast("cpu", torch.bfloat16):
            torch.testing.assert_close(block(x), expected, atol=0.05, rtol=0)


@pytest.mark.parametrize(
    ("task", "count"), [("developable", 2_820_832), ("denoise", 2_820_832), ("flatten", 2_820_688)]
)
def test_published_size(task, count):
    assert sum(p.numel() for p in GSONet(task).parameters()) == count


def test_stencils_add_no_parameters():
    assert sum(p.numel() for p in GSONet(stencils=True).parameters()) == 2820832


SMALL = {"widths": (8, 8, 8), "depths": (1, 1, 1)}


def test_a_confidence_is_added_to_a_trained_net(tmp_path):
    known = shaken(CoarseNet(**SMALL, passes=1))
    net = CoarseNet(**SMALL, passes=1, confidence=True)
    net.copy_weights_from(known)
    points = saddle(40)
    before, after = (predict(points, model=one) - points for one in (known, net))
    trust = 1 / (1 + np.exp(-3))  # the same everywhere, before it is trained
    np.testing.assert_allclose(after, trust * before, atol=1e-6)
    save(net, tmp_path / "net.safetensors")
    kept = predict(points, model=tmp_path / "net.safetensors") - points
    np.testing.assert_allclose(kept, after, atol=1e-4)  # in half precision
    with pytest.raises(RuntimeError, match="confidence_head"):
        known.copy_weights_from(net)


@pytest.mark.parametrize("shape", [(64, 64), (40, 90)])
def test_vertices_without_confidence_stay(shape):
    net = shaken(CoarseNet(**SMALL, passes=2, confidence=True))
    points = saddle(91)[: shape[0], : shape[1]]
    moved = np.abs(predict(points, model=net) - points).max()
    grid = torch.as_tensor(saddle(64)[None], dtype=torch.float32)
    trust = net.confidence(grid)
    assert trust.shape == (1, 64, 64) and bool(((trust > 0) & (trust < 1)).all())
    with torch.no_grad():
        net.confidence_head.bias.fill_(-40.0)
    assert net.confidence(grid).max() < 1e-9
    assert moved > 1e-3 and np.abs(predict(points, model=net) - points).max() < 1e-9


def test_stencils_take_the_weights_of_a_net_without():
    one = shaken(GSONet(channels=4, blocks=1), size=0.01)
    two, three = GSONet(channels=4, blocks=1, stencils=True), GSONet(channels=4, blocks=1)
    two.copy_weights_from(one)
    x = torch.randn(2, 3, 16, 16)
    torch.testing.assert_close(torch.conv2d(x, two.head.kernels()), one.head(x)[..., 1:-1, 1:-1])
    three.copy_weights_from(two)
    for name, weight in one.state_dict().items():
        torch.testing.assert_close(three.state_dict()[name], weight, atol=1e-5, rtol=1e-4)
    two.copy_weights_from(GSONet(channels=4, blocks=1, stencils=True))
    with pytest.raises(RuntimeError, match="size"):
        two.copy_weights_from(GSONet(channels=8, blocks=1))


@pytest.mark.parametrize("kernel, stride, bias", [(3, 1, True), (2, 2, False), (1, 1, False)])
@pytest.mark.parametrize("count", [1, 3])
def test_convolutions_with_reordered_weights_are_convolutions(kernel, stride, bias, count):
    torch.manual_seed(0)
    layer = Convolution(12, 20, kernel, stride=stride, padding=kernel // 2, bias=bias)
    x = torch.randn(count, 12, 8, 10)
    wide = torch.randn(count, 16, 8, 10)[:, 4:]

    def agrees(layer):
        with torch.inference_mode():
            for seen in (x, x.contiguous(memory_format=torch.channels_last), wide):
                expected = torch.nn.Conv2d.forward(layer, seen)
                assert (layer(seen) - expected).abs().max() < 1e-5 * expected.abs().max()
        return True

    assert agrees(layer)
    assert agrees(copy.deepcopy(layer))
    with torch.no_grad():
        layer.weight.mul_(2.0)
    assert agrees(layer)
    layer.load_state_dict(Convolution(12, 20, kernel, bias=bias).state_dict())
    assert agrees(layer)
    layer.weight = torch.nn.Parameter(torch.randn_like(layer.weight))
    assert agrees(layer)
    layer.to(torch.float64).to(torch.float32)
    assert agrees(layer)
    layer(x).sum().backward()
    assert layer.weight.grad.abs().sum() > 0


def test_published_net_has_no_biases():
    assert all(p.ndim == 4 for p in GSONet(channels=8).parameters())


def test_tanh_bounds_displacements():
    net = shaken(GSONet(channels=8, blocks=1, tanh=True), size=0.2)
    points = torch.randn(1, 16, 16, 3)
    assert float((net(points) - points).detach().abs().max()) <= 1.0 + 1e-6


@pytest.mark.parametrize("kind", ["coarse", "published"])
@pytest.mark.parametrize("shape", [(64, 64), (20, 33), (4, 5)])
def test_unit_position_and_size_of_the_grid_do_not_matter(kind, shape, request):
    net = request.getfixturevalue(kind)
    points = saddle(*shape)
    result = predict(points, model=net)
    assert result.shape == points.shape and np.isfinite(result).all()
    assert np.abs(result - points).max() > 1e-4
    far = predict(1000.0 * points + [5e4, 0, -3e4], model=net)
    np.testing.assert_allclose((far - [5e4, 0, -3e4]) / 1000.0, result, atol=2e-6)


@pytest.mark.parametrize("kind", ["coarse", "aligned"])
def test_results_turn_with_the_surface(kind, request):
    net = request.getfixturevalue(kind)
    points, turn = saddle(64), rotation(1)
    result = predict(points, model=net)
    close(predict(points @ turn, model=net), result @ turn, result - points)


@pytest.mark.parametrize("kind", ["flatten", "aligned_flatten"])
def test_flat_images_stay_where_the_surface_is_turned(kind, request):
    net = request.getfixturevalue(kind)
    points = saddle(64)
    flat = predict(points, task="flatten", model=net)
    turned = predict(points @ rotation(1), task="flatten", model=net)
    close(turned, flat, flat - predict(points, task="flatten", model=CoarseNet("flatten")))


@given(st.integers(0, 2**32 - 1), st.sampled_from([(4, 4), (5, 9), (64, 64)]))
def test_axes_turn_with_grids_of_any_shape(seed, shape):
    points = np.random.default_rng(seed).normal(size=(1, *shape, 3))
    first, turned = (
        axes(torch.from_numpy(x))[0].numpy() for x in (points, points @ rotation(seed))
    )
    np.testing.assert_allclose(first.T @ first, np.eye(3), atol=1e-12)
    assert np.linalg.det(first) > 0
    np.testing.assert_allclose(turned, rotation(seed).T @ first, atol=1e-6)
    # Seen along its own axes, the transposed grid is the same with x and y exchanged.
    swapped = axes(torch.from_numpy(points.swapaxes(1, 2)))[0].numpy()
    np.testing.assert_allclose(swapped, first @ [[0, 1, 0], [1, 0, 0], [0, 0, -1]], atol=1e-6)


def test_grids_without_two_directions_are_not_turned():
    u, v = np.meshgrid(np.linspace(-1, 1, 8), np.linspace(-1, 1, 8), indexing="ij")
    line, closed = u + v, np.abs(u) * np.abs(v)
    grids = [[line, 2 * line, 0 * u], [closed, closed, v], [0 * u, 0 * u, 0 * u]]
    found = axes(torch.from_numpy(np.moveaxis(grids, 1, -1)))
    assert bool((found == torch.eye(3)).all())


def test_coarse_net_is_one_surface_at_every_resolution(coarse):
    fine = predict(saddle(127), model=coarse)
    np.testing.assert_allclose(fine[::2, ::2], predict(saddle(64), model=coarse), atol=2e-3)


def test_batches_are_single_surfaces(coarse):
    batch = np.stack([saddle(64), cylinder(64)])
    together = predict(batch, model=coarse)
    for points, result in zip(batch, together, strict=True):
        close(predict(points, model=coarse), result, result - points)
    assert predict(batch[:0], model=coarse).shape == (0, 64, 64, 3)


def test_new_flatten_net_gives_the_rectangle():
    points = saddle(30, 40)
    start = parametrization.rectangle(points)
    flat = predict(points, task="flatten", model=CoarseNet("flatten"))
    np.testing.assert_allclose(flat, start - start.mean(axis=(0, 1)), atol=1e-6)


def test_repeat_is_the_same_net_again(coarse):
    points = saddle(64)
    twice = predict(predict(points, model=coarse), model=coarse)
    np.testing.assert_allclose(predict(points, model=coarse, repeat=2), twice, atol=1e-6)


@pytest.mark.parametrize("size", [64, 40])
def test_fewer_passes_of_a_net(coarse, size):
    points = saddle(size)
    results = [predict(points, model=coarse, passes=p) for p in (1, coarse.passes)]
    assert np.abs(results[0] - results[1]).max() > 1e-4
    for most in (None, coarse.passes + 1):
        np.testing.assert_array_equal(predict(points, model=coarse, passes=most), results[1])


def test_gradients_of_unrolled_passes():
    """The slope along a change of all weights is that of differences; without it, another one."""
    net = shaken(CoarseNet(**SMALL, passes=3)).double()
    grid = torch.as_tensor(saddle(32)[None])
    random = torch.Generator().manual_seed(1)
    rise = [torch.randn(p.shape, dtype=p.dtype, generator=random) for p in net.parameters()]

    def cost(unrolled=True):
        return 1e3 * net.displacements(grid, unrolled=unrolled).square().sum()

    def slope(unrolled):
        found = torch.autograd.grad(cost(unrolled), list(net.parameters()))
        return float(sum((g * r).sum() for g, r in zip(found, rise, strict=True)))

    def moved(step):
        with torch.no_grad():
            for p, r in zip(net.parameters(), rise, strict=True):
                p.add_(step * r)
            return float(cost())

    whole, last = slope(True), slope(False)
    assert torch.equal(cost(), cost(False))
    high, low = moved(1e-6), moved(-2e-6)
    assert whole == pytest.approx((high - low) / 2e-6, rel=1e-4)
    assert abs(last - whole) > 0.05 * abs(whole)


def test_noise_is_told_in_the_unit_of_the_input():
    net = shaken(GSONet("denoise", channels=8, blocks=1, sigma=True), size=0.02)
    points = saddle(64)
    noisy = points + 0.01 * np.random.default_rng(0).normal(size=points.shape)
    told = predict(noisy, task="denoise", model=net, sigma=0.01)
    larger = predict(10 * noisy, task="denoise", model=net, sigma=0.1)
    np.testing.assert_allclose(larger / 10, told, atol=1e-5)
    estimated = predict(noisy, task="denoise", model=net)
    assert np.abs(estimated - told).max() < 0.1 * np.abs(told - noisy).max()


@pytest.mark.parametrize("shape", [(16, 16), (63, 64), (70, 65), (40, 100), (130, 130)])
def test_noise_goes_from_grids_of_any_size(shape):
    u, v = np.meshgrid(*(np.linspace(-1, 1, n) for n in shape), indexing="ij")
    clean = np.stack([u, v, 0.4 * u * v], axis=-1)
    noisy = clean + 0.005 * np.random.default_rng(0).standard_normal(clean.shape)
    before = gso.metrics.normal_angle(clean, noisy)
    for sigma in (None, 0.005):
        result = predict(noisy, task="denoise", sigma=sigma)
        assert result.shape == clean.shape
        share = 0.4 if min(shape) < 20 else 0.1
        assert gso.metrics.normal_angle(clean, result) < share * before
    with pytest.raises(MeshError, match="16 vertices"):
        predict(noisy[:15], task="denoise")


def test_noise_that_averages_keep_is_told():
    u, v = np.meshgrid(*(np.linspace(-1, 1, 64),) * 2, indexing="ij")
    clean = np.stack([u, v, 0.4 * u * v], axis=-1)
    noisy = clean + 0.01 * np.random.default_rng(0).standard_normal(clean.shape)
    clean, noisy = (gso.hierarchy.resample(x, 150, 150) for x in (clean, noisy))
    result = predict(noisy, task="denoise")
    assert gso.metrics.normal_angle(clean, result) < 2.0


@pytest.mark.parametrize("sigma", ["a", -1.0, np.nan, [0.1]])
def test_sigma_is_a_number(sigma, coarse):
    with pytest.raises(OptionError, match="sigma is"):
        predict(saddle(16), model=coarse, sigma=sigma)


def test_a_bad_surface_of_many_is_named(coarse):
    many = np.stack([saddle(4)] * 70)
    many[66] = 1.0
    with pytest.raises(MeshError, match="surface 66"):
        predict(many, model=coarse)


@pytest.mark.parametrize(
    ("points", "says"),
    [
        (np.zeros((8, 8)), "expected a grid"),
        (np.zeros((8, 8, 2)), "expected a grid"),
        (np.zeros((3, 8, 3)), "too small"),
        (np.zeros((8, 8, 3)), "one point"),
        (np.full((8, 8, 3), np.nan), r"vertex \(0, 0\) is not finite"),
        ("surface", "cannot read a file without a suffix"),
    ],
)
def test_bad_surfaces(points, says, coarse):
    with pytest.raises(MeshError, match=says):
        predict(points, model=coarse)


def test_bad_options(coarse):
    points = saddle(16)
    for keywords, says in [
        ({"task": "bend"}, "no task"),
        ({"task": "flatten", "model": coarse}, "is for task"),
        ({"model": coarse, "repeat": 0}, "repeat"),
        ({"model": coarse, "passes": 0}, "passes"),
        ({"model": coarse, "passes": 1.5}, "passes"),
        ({"model": coarse, "device": "abacus"}, "no device"),
    ]:
        with pytest.raises(OptionError, match=says):
            predict(points, **keywords)
    for make in (
        lambda: GSONet(channels=6),
        lambda: CoarseNet(widths=(1, 2)),
        lambda: GSONet("bend"),
    ):
        with pytest.raises(OptionError):
            make()
    with pytest.raises(WeightsError, match="comes with the package; did you mean"):
        predict(points, model="net-x")
    with pytest.raises(WeightsError, match="take net-c or net-f"):
        load("net-cf")


def test_surfaces_without_area_are_survived(coarse, flatten):
    line = np.zeros((16, 16, 3))
    line[..., 0] = np.arange(16)[:, None]
    for net in (coarse, flatten):
        assert np.isfinite(predict(line, task=net.task, model=net)).all()


class TestFiles:
    @pytest.fixture
    def path(self, tmp_path, coarse):
        save(coarse, tmp_path / "net.safetensors", {"name": "small"}, dtype=torch.float32)
        return tmp_path / "net.safetensors"

    def test_round_trip(self, path, coarse):
        again = load(path)
        assert again.settings == coarse.settings
        points = saddle(64)
        np.testing.assert_array_equal(predict(points, model=path), predict(points, model=coarse))
        card = json.loads(path.with_suffix(".json").read_text())
        assert card["name"] == "small" and card["parameters"] > 0

    def test_half_precision_changes_little(self, tmp_path, coarse):
        save(coarse, tmp_path / "half.safetensors")
        points = saddle(64)
        moved = predict(points, model=coarse) - points
        half = predict(points, model=tmp_path / "half.safetensors") - points
        assert np.abs(half - moved).max() < 0.02 * np.abs(moved).max()

    def test_a_new_file_is_seen(self, path, coarse):
        before = predict(saddle(64), model=path)
        save(shaken(CoarseNet(widths=(8, 8, 8), depths=(1, 1, 1)), seed=5), path)
        assert np.abs(predict(saddle(64), model=path) - before).max() > 1e-6

    @pytest.mark.parametrize("cut", [0, 7, 100, -1])
    def test_truncated(self, path, cut):
        path.write_bytes(path.read_bytes()[:cut])
        with pytest.raises(WeightsError, match="damaged"):
            load(path)

    def test_flipped_bit(self, path):
        data = bytearray(path.read_bytes())
        data[-5] ^= 1
        path.write_bytes(data)
        with pytest.raises(WeightsError, match="damaged"):
            load(path)

    def test_missing_card(self, path):
        path.with_suffix(".json").unlink()
        with pytest.raises(WeightsError, match="cannot be read"):
            load(path)

    @pytest.mark.parametrize("text", ["", "[]", "{}", "[" * 100_000, '{"format": 1}', "\xff"])
    def test_foreign_card(self, path, text):
        path.with_suffix(".json").write_text(text, encoding="latin-1")
        with pytest.raises(WeightsError, match=r"card|which net"):
            load(path)

    @pytest.mark.parametrize(
        "model",
        [
            {"kind": "os.system", "task": "developable"},
            {"kind": "coarse", "task": "developable", "widths": [4096, 4096, 4096]},
            {"kind": "coarse", "task": "developable", "widths": "abc"},
            {"kind": "coarse", "task": "flatten", "widths": [16, 16, 16], "depths": [1, 1, 1]},
            {"kind": "gsonet", "task": "developable"},
            {"kind": "gsonet", "task": "developable", "channels": 10**9},
            {"kind": ["coarse"]},
            {"task": 3},
        ],
    )
    def test_card_of_another_net(self, path, model):
        self.pretend(path, path.read_bytes(), model)
        with pytest.raises(WeightsError, match="holds"):
            load(path)

    @pytest.mark.parametrize(
        "data",
        [b"", b"\x80\x04N.", b"\xff" * 64, b"PK\x03\x04" * 20, (2**40).to_bytes(8, "little")],
    )
    def test_no_tensors(self, path, data):
        self.pretend(path, data)
        with pytest.raises(WeightsError, match="holds no net"):
            load(path)

    def test_not_finite(self, path, coarse):
        from safetensors.torch import save as packed

        tensors = {k: v.clone() for k, v in coarse.state_dict().items()}
        tensors["stem.bias"][0] = float("nan")
        self.pretend(path, packed(tensors))
        with pytest.raises(WeightsError, match="not finite"):
            load(path)

    def pretend(self, path, data, model=None):
        """Write a file whose card has its checksum."""
        import hashlib

        card = json.loads(path.with_suffix(".json").read_text())
        card["sha256"] = hashlib.sha256(data).hexdigest()
        if model is not None:
            card["model"] = model
        path.write_bytes(data)
        path.with_suffix(".json").write_text(json.dumps(card))


class TestImport:
    """Weights of another implementation, under other names."""

    def theirs(self, task="developable", **settings):
        net = GSONet(task, **settings)
        torch.nn.init.normal_(net.tail.weight, std=0.01)
        tensors = net.state_dict().values()
        return net, {f"model.{k}.weight": v.clone() for k, v in enumerate(tensors)}

    @pytest.mark.parametrize(("task", "count"), [("developable", 2820832), ("flatten", 2820688)])
    @pytest.mark.parametrize("how", ["plain", "checkpoint", "safetensors"])
    def test_the_same_net(self, task, count, how, tmp_path):
        net, state = self.theirs(task)
        source = tmp_path / ("net.safetensors" if how == "safetensors" else "net.pth")
        if how == "safetensors":
            from safetensors.torch import save_file

            save_file(state, source)
        else:
            torch.save({"epoch": 3, "state_dict": state} if how == "checkpoint" else state, source)
        card = gso.net.import_weights(source, tmp_path / "own.safetensors", task=task)
        assert card["parameters"] == count
        assert card["imported"]["file"] == source.name
        loaded = load(tmp_path / "own.safetensors").state_dict()
        assert all(torch.equal(v, loaded[k]) for k, v in net.state_dict().items())

    @pytest.mark.parametrize(
        ("change", "says"),
        [
            (lambda s: s.pop("model.7.weight"), "tensor 8, 'model.8.weight'"),
            (lambda s: s.update({"more": torch.zeros(3)}), "nothing in the net fits 'more'"),
            (lambda s: s.pop([*s][-1]), "nothing for 'tail.weight'"),
            (lambda s: s["model.3.weight"].fill_(float("nan")), "'model.3.weight'"),
            (lambda s: s.update(model=torch.nn.Linear(2, 2)), "tensors only"),
            (lambda s: s.clear(), "0 dictionaries"),
        ],
    )
    def test_what_does_not_fit_is_named(self, change, says, tmp_path):
        _, state = self.theirs(channels=4, blocks=1)
        change(state)
        torch.save(state, tmp_path / "net.pth")
        with pytest.raises(WeightsError, match=says):
            gso.net.import_weights(
                tmp_path / "net.pth", tmp_path / "a.safetensors", channels=4, blocks=1
            )
        assert not (tmp_path / "a.safetensors").exists()

    def test_another_task_and_no_file(self, tmp_path):
        _, state = self.theirs("flatten", channels=4, blocks=1)
        torch.save(state, tmp_path / "net.pth")
        size = {"channels": 4, "blocks": 1}
        with pytest.raises(WeightsError, match=r"'tail\.weight', 3 x 4 x 3 x 3"):
            gso.net.import_weights(tmp_path / "net.pth", tmp_path / "a.safetensors", **size)
        (tmp_path / "text.pth").write_text("no weights")
        for name in ("none.pth", "text.pth"):
            with pytest.raises(WeightsError, match=name):
                gso.net.import_weights(tmp_path / name, tmp_path / "a.safetensors", **size)


@pytest.mark.parametrize("name", [n for n in available() if n not in CHAINS])
def test_cards_say_how_nets_were_trained(name):
    from gso.net.training import from_dict

    card = read_card(located(name))
    made = from_dict(card["config"])
    assert (made.name, made.task) == (name, card["model"]["task"]) == (card["name"], made.task)
    # Settings that were added later, or changed after the run, may differ.
    assert made.model["kind"] == card["model"]["kind"]
    assert (
        1 <= card["data"]["version"] <= gso.dataset.Recipe().as_dict()["version"]
        and card["data"]["n"] > 0
    )
    assert card["test"]["surfaces"] == 1041
    chain = [card]
    while "begun_with" in chain[-1]:
        chain.append(chain[-1]["begun_with"])
    for run in chain:
        assert run["hours"] > 0 and len(run["sha256"]) == 64 and run["hardware"]["device"]
        assert run["name"] in available()
    # Hours of a run contain those of the runs before it under the same name.
    assert all(a["hours"] > b["hours"] for a, b in pairwise(chain) if a["name"] == b["name"])


@pytest.mark.parametrize("name", [n for n in available() if n not in CHAINS])
def test_shipped_weights_load(name):
    net = load(name)
    assert net.task in tasks.names()
    card = read_card(located(name))
    assert card["parameters"] == sum(p.numel() for p in net.parameters())
    result = predict(saddle(16), task=net.task, model=name)
    assert np.isfinite(result).all()


@pytest.mark.parametrize("name", available())
def test_shipped_nets_turn_with_the_surface(name):
    nets = [load(part) for part in CHAINS.get(name, (name,))]
    if not all(net.settings.get("aligned", True) for net in nets):
        pytest.skip("it was trained without")
    points, turn, task = saddle(64), rotation(2), nets[0].task
    done, turned = (predict(x, task=task, model=name) for x in (points, points @ turn))
    if task == "flatten":
        close(turned, done, np.ptp(done))
    else:
        close(turned, done @ turn, done - points)


def test_shipped_weights_are_small():
    folder = located("net-c").parent
    assert 1e6 < sum(p.stat().st_size for p in folder.glob("*")) < 60e6


def test_neither_casadi_nor_the_solver_is_loaded():
    code = (
        "import sys, numpy as np, gso\n"
        "from gso.net import CoarseNet, predict\n"
        "u, v = np.mgrid[:8.0, :8.0]\n"
        "predict(np.dstack([u, v, u * v / 9]), model=CoarseNet(widths=(8, 8, 8)))\n"
        "import gso.net.inference.prediction\n"
        "print([m for m in ('casadi', 'gso.tno') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def triangles(points):
    """A grid of triangles, whose rows are no longer to be seen."""
    order = np.random.default_rng(0).permutation(points.shape[0] * points.shape[1])
    grid = gso.Mesh.from_grid(points)
    place = np.argsort(order)
    return gso.Mesh(grid.vertices[order], place[grid.triangles]), order


class TestMeshes:
    def test_a_grid_in_any_numbering(self, coarse):
        points = saddle(20)
        grid = gso.Mesh.from_grid(points)
        order = np.random.default_rng(0).permutation(400)
        mesh = gso.Mesh(grid.vertices[order], np.argsort(order)[grid.faces])
        done = predict(mesh, model=coarse)
        assert isinstance(done, gso.Mesh)
        np.testing.assert_array_equal(done.faces, mesh.faces)
        close(done.grid, predict(mesh.grid, model=coarse), done.vertices - mesh.vertices)

    def test_what_as_mesh_takes(self, coarse, tmp_path):
        mesh = gso.Mesh.from_grid(saddle(12))
        gso.save(mesh, tmp_path / "saddle.obj")
        expected = predict(mesh, model=coarse).vertices
        for surface in (
            (mesh.vertices, mesh.faces),
            tmp_path / "saddle.obj",
            str(tmp_path / "saddle.obj"),
        ):
            found = predict(surface, model=coarse)
            np.testing.assert_allclose(found.vertices, expected, atol=1e-6)

    def test_triangles_move_as_the_grid_does(self):
        points = saddle(30)
        mesh, order = triangles(points)
        assert mesh.grid is None
        # A trained net: what a random one makes of a surface depends on its grid.
        moved = predict(mesh).vertices - mesh.vertices
        # The map to a rectangle differs from the grid: so does the result, by a part of it.
        expected = (predict(points) - points).reshape(-1, 3)[order]
        assert np.linalg.norm(moved) == pytest.approx(np.linalg.norm(expected), rel=0.5)
        assert np.linalg.norm(moved - expected) < 0.3 * np.linalg.norm(expected)

    def test_a_flat_image_lies_in_the_plane(self):
        mesh, _ = triangles(cylinder(24))
        flat = predict(mesh, task="flatten", model="flatten-strain")
        assert isinstance(flat, gso.Mesh) and not flat.vertices[:, 2].any()
        assert gso.metrics.area(flat) == pytest.approx(gso.metrics.area(mesh), rel=0.02)

    def test_vertices_without_a_face_stay(self, coarse):
        mesh, _ = triangles(saddle(20))
        more = gso.Mesh(np.concatenate([mesh.vertices, [[9.0, 9, 9]]]), mesh.faces)
        done = predict(more, model=coarse)
        np.testing.assert_array_equal(done.vertices[-1], [9.0, 9, 9])
        np.testing.assert_allclose(
            done.vertices[:-1], predict(mesh, model=coarse).vertices, atol=1e-6
        )

    def test_meshes_that_are_no_disks(self, coarse):
        corners = np.eye(4)[:, :3]
        with pytest.raises(MeshError, match=r"cannot be resampled.*gso\.tno\.optimize"):
            predict((corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]), model=coarse)
        with pytest.raises(MeshError, match="take grids"):
            predict(triangles(saddle(20))[0], task="denoise")


def test_public_names():
    assert gso.net.predict is predict.func


# ---------------------------------------------------------------- no harm


@pytest.mark.parametrize("name", available("developable"))
def test_developable_surfaces_and_noise_come_back(name):
    u, v = np.mgrid[-1:1:64j, -1:1:64j]
    round_one = np.stack([np.sin(u), v, np.cos(u)], axis=-1)
    assert (gso.net.predict(round_one, model=name) == round_one).all()
    noisy = round_one + 0.003 * np.random.default_rng(0).standard_normal(round_one.shape)
    after = gso.net.predict(noisy, model=name)
    for more in ({}, {"scale": 1.0}):
        assert gso.metrics.loss_gc_worst(after, **more) <= gso.metrics.loss_gc_worst(noisy, **more)


def test_results_that_help_are_not_changed():
    panel = saddle(64)
    kept = gso.net.predict(panel)
    assert (kept == predict(panel)).all()
    assert gso.metrics.loss_gc_worst(kept) < gso.metrics.loss_gc_worst(panel)


def outlined(corners):
    """A saddle inside a closed polygon with corners at multiples of 0.1, as triangles."""
    x, y = np.meshgrid(np.arange(-20, 21), np.arange(-20, 21), indexing="ij")
    flat = np.stack([x, y], axis=-1) * 0.05
    flat[1:-1, 1:-1] += 0.01 * np.random.default_rng(1).uniform(-1, 1, (39, 39, 2))
    whole = gso.Mesh.from_grid(np.dstack([flat, 0.3 * (flat[..., :1] ** 2 - flat[..., 1:] ** 2)]))
    middle = whole.vertices[whole.triangles].mean(axis=1)[:, :2]
    inside = np.zeros(len(middle), bool)
    for (ax, ay), (bx, by) in zip(corners, [*corners[1:], corners[0]], strict=True):
        between = (ay > middle[:, 1]) != (by > middle[:, 1])
        share = (middle[:, 1] - ay) / (by - ay or 1.0)
        inside ^= between & (middle[:, 0] < ax + share * (bx - ax))
    used, faces = np.unique(whole.triangles[inside], return_inverse=True)
    return gso.Mesh(whole.vertices[used], faces.reshape(-1, 3))


OUTLINES = {
    "U": [(-1, -1), (1, -1), (1, 1), (0.5, 1), (0.5, -0.3), (-0.5, -0.3), (-0.5, 1), (-1, 1)],
    "T": [(-0.2, -1), (0.2, -1), (0.2, 0.5), (1, 0.5), (1, 1), (-1, 1), (-1, 0.5), (-0.2, 0.5)],
    "round": [(np.cos(t), 0.5 * np.sin(t)) for t in np.linspace(0, 2 * np.pi, 60)[:-1]],
}


@pytest.mark.parametrize("name", OUTLINES)
def test_meshes_with_other_outlines_are_predicted_by_their_flat_image(name):
    mesh = outlined(OUTLINES[name])
    result = gso.net.predict(mesh)
    before, after = (gso.metrics.loss_gc(m, scale=1.0) for m in (mesh, result))
    assert after < 0.5 * before
    far = np.linalg.norm(result.vertices - mesh.vertices, axis=1)
    assert far.max() < 0.05 * mesh.diagonal


@pytest.mark.parametrize("seed", range(4))
def test_no_mesh_gets_more_curvature(seed):
    # Random weights do harm.
    mesh = outlined(OUTLINES["U"])
    result = gso.net.predict(mesh, model=shaken(CoarseNet(**SMALL), seed, size=0.05))
    before, after = (gso.metrics.loss_gc_worst(m, scale=1.0) for m in (mesh, result))
    assert after <= before

"""Training: configurations, batches, and runs that are killed, shared, and taken up."""

from __future__ import annotations

import contextlib
import copy
import json
import math
import os
import signal
import subprocess
import sys
from dataclasses import replace
from itertools import chain, pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

import gso
from gso import DatasetError, OptionError, WeightsError
from gso.cli import main
from gso.dataset import generate
from tests.conftest import saddle, sphere_cap

torch = pytest.importorskip("torch")
pytest.importorskip("safetensors")

from gso.net import (  # noqa: E402
    CHAINS,
    GSONet,
    available,
    load,
    make,
    read_card,
    save,
    train,
)
from gso.net.models import Net, ball, normalise  # noqa: E402
from gso.net.training import (  # noqa: E402
    HOURS,
    Batch,
    Config,
    Objective,
    Phase,
    checkpoint,
    from_dict,
    read,
    training_losses,
)
from gso.net.training.data import Source, fresh, noisy, open_source  # noqa: E402
from gso.net.training.learning_rate import place  # noqa: E402
from gso.net.training.muon import optimisers, orthogonal  # noqa: E402
from gso.net.training.training_run import begin  # noqa: E402

CONFIGS = sorted(Path(gso.net.__file__).with_name("configs").glob("*.toml"))
#: The only process of a run.
ALONE = SimpleNamespace(
    rank=0, world=1, first=True, device=torch.device("cpu"), wait=lambda: None, summed=lambda x: x
)
SMALL = {"kind": "coarse", "widths": [8, 8, 8], "depths": [0, 0, 1]}
PUBLISHED = {"kind": "gsonet", "channels": 4, "blocks": 1}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder of .npy files with a few surfaces."""
    path = tmp_path_factory.mktemp("surfaces")
    for split, count, seed in (("train", 8, 1), ("validation", 2, 2)):
        (path / split).mkdir()
        for k, surface in enumerate(generate(count, seed=seed)):
            np.save(path / split / f"{k:03d}.npy", surface.sample(32))
    return path


def config(task="developable", model=None, **more):
    phase = more.pop("phase", [{"loss": "energy", "batch": 4, "eps": [0.1, 0.05]}])
    given = {"task": task, "model": model or SMALL, "phase": phase, "steps": 6, "validate": 2}
    return from_dict({**given, "bf16": False, "ema": 0.5, **more})


def loss_of(net, batch, phase, progress):
    """The loss of a batch without its terms."""
    return Objective(net)(batch, phase, progress)[0]


def read_curves(folder):
    return [json.loads(line) for line in (folder / "curves.jsonl").read_text().splitlines()]


def applied(net, surfaces):
    with torch.no_grad():
        return net(surfaces, None).double().numpy()


def restless(*given, **settings):
    """A net that does not return its input, as new ones do."""
    net = GSONet(*given, channels=4, blocks=1, **settings)
    torch.nn.init.normal_(net.tail.weight, std=0.1)
    return net


def tensors(path):
    return load(path).state_dict()


@pytest.fixture
def often(monkeypatch):
    """A record of the loss every fourth step, so that short runs have several."""
    monkeypatch.setattr("gso.net.training.loop._REPORT", 4)


@pytest.fixture(scope="module")
def whole(folder, tmp_path_factory):
    """A configuration, and the weights after a run of it that nothing stops."""
    made, place = config(steps=10, augment="symmetries"), tmp_path_factory.mktemp("whole")
    train(made, folder, place)
    return made, tensors(place / "model.safetensors")


@pytest.mark.parametrize("path", CONFIGS, ids=lambda p: p.stem)
def test_shipped_configurations(path):
    made = read(path)
    assert made.name == path.stem
    assert from_dict(made.as_dict()) == made
    with torch.device("meta"):
        net = make({**made.model, "task": made.task})
    assert sum(p.numel() for p in net.parameters()) < 3e6


#: Net, epochs, learning rate, decay of the weight of "in", and weights of the published recipes.
PAPER = {
    "pretrain": (1000, 1e-3, 0.0, {"in": 1.0, "fair": 1.0}),
    "net-s": (4000, 1e-4, 4.0, {"in": 1.0, "fair": 1.0, "loss_gc": 1.0}),
    "net-c": (4000, 1e-4, 3.0, {"in": 1.0, "fair": 1.0, "loss_gc": 1.0}),
    "net-f": (4000, 1e-4, 3.0, {"in": 1.0, "fair": 1.0, "loss_gc": 1.0}),
    "flatten": (1000, 1e-4, 0.0, {"iso": 1e6, "fair": 1.0}),
    "flatten-w": (1000, 1e-4, 0.0, {"iso_w": 1e6, "fair": 1.0}),
    "denoise": (1000, 1e-4, 0.0, {"in": 1.0, "fair": 10.0}),
}


def test_recipes_of_the_paper_are_the_published_ones():
    assert {p.stem for p in CONFIGS if "paper" in p.stem} == {f"paper-{name}" for name in PAPER}
    for name, (epochs, rate, decay, weights) in PAPER.items():
        made = read(f"paper-{name}")
        (phase,) = made.phases
        assert (made.epochs, phase.decay, phase.weights) == (epochs, decay, weights)
        assert (phase.batch, phase.clip, made.optimiser) == (256, 0.01, "adamw")
        assert {place(made.phases, t, made.warm_up).rate for t in (0.0, 0.3, 1.0)} == {rate}
        assert (made.ema, made.augment, made.init) == (0.0, "shear", "")
        with torch.device("meta"):
            net = make({**made.model, "task": made.task})
        assert sum(p.numel() for p in net.parameters()) == 2820832 - 144 * net.kind.flat


def test_a_run_may_be_so_many_passes_long(folder, tmp_path):
    phase = [{"weights": {"loss_gc": 1.0, "in": 1.0}, "batch": 3, "rate": 1e-3, "final_rate": 1e-3}]
    made = config(phase=phase, epochs=2, warm_up=0.0, ema=0.0)
    # Eight surfaces, twice, in batches of three.
    assert train(made, folder, tmp_path / "a", device="cpu")["steps"] == 6 == made.steps_for(8)
    assert train(replace(made, limit=4), folder, tmp_path / "b", device="cpu")["steps"] == 3
    assert read("paper-net-s", steps=5).steps_for(8320) == 5
    with pytest.raises(OptionError, match="take one"):
        read("paper-net-s", steps=5, epochs=3)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"warm_up": 2.0}, "warm_up is 2"),
        (
            {"epochs": 2, "phase": [{"loss": "energy"}, {"loss": "energy", "batch": 3}]},
            "other batches",
        ),
        ({"task": "bend"}, "task is 'bend'"),
        ({"colour": 3}, "Config takes no 'colour'"),
        ({"optimiser": "sgd"}, "optimiser is 'sgd'"),
        ({"phase": []}, "phase"),
        ({"phase": 3}, "phase"),
        ({"phase": [{"loss": "l2"}]}, "loss is 'l2'"),
        ({"phase": [{"weights": {"gcc": 1}}]}, "'gcc'"),
        ({"phase": [{"weights": {"iso": 1}}]}, "do not go with task"),
        ({"phase": [{"loss": "clean"}]}, "does not go with task"),
        ({"phase": [{"loss": "label"}], "augment": "shear"}, "do not follow"),
        ({"phase": [{"loss": "energy", "rate": 0}]}, "positive"),
        ({"phase": [{"loss": "energy", "batch": 1.5}]}, "batch is 1.5"),
        ({"phase": [{"loss": "energy", "stride": 0}]}, "stride is 0"),
        ({"phase": [{"loss": "energy", "stride": 5}]}, "stride is 5"),
        ({"model": {"kind": "mlp"}}, "no kind 'mlp'"),
        ({"model": {"kind": "coarse", "depth": 3}}, "settings of the net"),
        ({"model": 3}, "needs task"),
        ({"name": "a/b"}, "no file name"),
        ({"steps": 0}, "steps is 0"),
        ({"sigma": [1, 0]}, "sigma"),
        ({"sigma": [0.01]}, "sigma is"),
        ({"sigma": 0.01}, "sigma is"),
        ({"phase": [{"loss": "energy", "eps": [0.1]}]}, "eps is"),
        ({"phase": [{"loss": "energy", "eps": ["a", 1]}]}, "eps is"),
        ({"phase": [{"loss": "energy", "weights": 3}]}, "weights is 3"),
        ({"phase": [{"loss": "energy", "share": math.inf}]}, "share is inf"),
        ({"phase": [{"loss": "energy", "unrolled": "yes"}]}, "unrolled is 'yes'"),
        ({"phase": [{"loss": "label"}], "through": "net-c"}, "through"),
        ({"phase": [{"loss": "energy"}], "against": "designs"}, "goes with through"),
        ({"against": "labels"}, "against is 'labels'"),
        ({"phase": [{"loss": "energy"}], "teacher": "net-c"}, "no phase learns labels"),
        (
            {"task": "denoise", "teacher": "denoise", "phase": [{"loss": "clean"}]},
            "teacher does not",
        ),
        ({"task": "denoise", "phase": [{"weights": {"label": 1}}]}, "weights label do not"),
        (
            {"task": "flatten", "phase": [{"weights": {"k_left": 1, "fair": 1}}]},
            "weights k_left do",
        ),
        ({"task": "denoise", "phase": [{"weights": {"d_h": 1, "gc": 1}}]}, "weights d_h do not"),
        ({"task": "flatten", "through": "net-c"}, "'developable' only"),
        ({"model": {"kind": "coarse", "widths": [50, 50, 50]}}, "settings of the net"),
        ({"model": PUBLISHED, "phase": [{"loss": "energy", "stride": 3}]}, "multiple of 8"),
    ],
)
def test_bad_configurations(change, says, folder, tmp_path):
    with pytest.raises(OptionError, match=says):
        train(config(**change), folder, tmp_path)


def test_unreadable_configurations(tmp_path):
    with pytest.raises(OptionError, match=r"developable.*flatten"):
        read(tmp_path / "none.toml")
    for name, text in (("a.toml", "= 3"), ("a.json", "{"), ("b.json", "[]")):
        (tmp_path / name).write_text(text)
        with pytest.raises(OptionError):
            read(tmp_path / name)
    (tmp_path / "c.json").write_text(json.dumps(config().as_dict()))
    assert read(tmp_path / "c.json") == config()


def test_schedule_falls_and_reaches_every_phase():
    phases = [Phase("energy", share=1.0, rate=1.0), Phase("energy", share=3.0, rate=0.5)]
    places = [place(phases, t) for t in np.linspace(0, 1, 101)]
    assert {p.number for p in places[:25]} == {0} and {p.number for p in places[26:]} == {1}
    rates = [p.rate for p in places]
    assert rates[0] < 0.02 and rates[1] > 0.9 and rates[-1] == pytest.approx(1e-5)
    for stretch in (rates[1:25], rates[26:]):
        assert all(a >= b for a, b in pairwise(stretch))


def test_batches_are_functions_of_the_step():
    made = config(augment="none")
    source = Source(torch.arange(7.0)[:, None, None, None].expand(7, 4, 4, 3))
    rows = [source.batch(made, made.phases[0], s).surface[:, 0, 0, 0].tolist() for s in range(7)]
    again = source.batch(made, made.phases[0], 3).surface[:, 0, 0, 0].tolist()
    assert again == rows[3]
    # Every surface is seen once in each epoch.
    seen = list(chain.from_iterable(rows))
    assert all(sorted(seen[k : k + 7]) == list(range(7)) for k in (0, 7, 14, 21))
    halves = [
        source.batch(made, made.phases[0], 3, rank=r, world=2).surface[:, 0, 0, 0].tolist()
        for r in range(2)
    ]
    assert sorted(chain.from_iterable(halves)) == sorted(rows[3])


def test_every_term_of_a_configuration_is_a_loss():
    with pytest.raises(OptionError, match="needs weights: ") as said:
        Phase("published")
    terms = str(said.value).partition("needs weights: ")[2].split(", ")
    assert len(terms) > 5
    designs = normalise(torch.rand(2, 16, 8, 3))
    for name in terms:
        net = restless("flatten" if name.startswith(("iso", "strain")) else "developable")
        one, two = (
            loss_of(net, Batch(designs, designs), Phase(weights={name: w}), 0.0) for w in (1, 2)
        )
        assert 0 < 2 * float(one) == pytest.approx(float(two), rel=1e-5)


def test_strides_leave_out_vertices_of_surfaces_and_labels():
    made = config(augment="none", phase=[{"loss": "label", "batch": 2, "stride": 2}])
    surfaces = torch.rand(2, 6, 8, 3)
    batch = Source(surfaces, 2 * surfaces).batch(made, made.phases[0], 0)
    assert batch.surface.shape == (2, 3, 4, 3)
    assert torch.equal(batch.target, 2 * batch.surface)
    assert {float(x) for x in batch.surface[:, 1, 1, 0]} == {float(x) for x in surfaces[:, 2, 2, 0]}


def test_augmentation_keeps_what_it_should():
    generator = torch.Generator().manual_seed(0)
    surfaces = normalise(torch.randn(40, 8, 8, 3, generator=generator))

    def batch(augment):
        made = config(augment=augment, phase=[{"loss": "energy", "batch": 40}])
        found = Source(surfaces, designs=2 * surfaces).batch(made, made.phases[0], 0)
        return found.surface, found.design

    plain, (first, second) = batch("none")[0], batch("symmetries")
    assert torch.equal(2 * first, second)
    same = (first == plain).all(dim=(1, 2, 3)).float().mean()
    assert 0 < same < 0.4
    assert torch.allclose(training_losses.fair(first), training_losses.fair(plain), rtol=1e-5)
    sheared, with_them = batch("shear")
    assert torch.allclose(sheared.square().sum(-1).amax((1, 2)), torch.ones(40), atol=1e-5)
    assert not torch.allclose(sheared, plain, atol=0.1)
    assert torch.allclose(torch.diff(with_them, dim=1), 2 * torch.diff(sheared, dim=1), atol=1e-5)


def test_noise_has_its_size():
    clean = normalise(torch.randn(3, 64, 64, 3, generator=torch.Generator().manual_seed(0)))
    surface, target, sigma = noisy(clean, (0.01, 0.01), torch.Generator().manual_seed(1))
    assert torch.allclose((surface - target).std((1, 2, 3)), sigma, rtol=0.02)
    assert torch.allclose(surface.square().sum(-1).amax((1, 2)), torch.ones(3), atol=1e-5)


def test_alignment_finds_turned_images():
    net, surface = restless("flatten"), normalise(torch.rand(2, 8, 16, 3))
    image, other = torch.from_numpy(applied(net, surface)).float(), torch.rand(2, 8, 16, 2)
    turn = torch.tensor([[0.6, 0.8], [0.8, -0.6]])

    def miss(target):
        return float(loss_of(net, Batch(surface, target), Phase("label"), 0.5))

    assert miss(image @ turn + 3.0) == pytest.approx(miss(image), abs=1e-3)
    assert miss(image) < 0.5 < miss(other)


def test_fresh_surfaces_are_kept(tmp_path):
    cache = tmp_path / "fresh.npy"
    first = fresh(3, 0, 16, cache)
    assert first.shape == (3, 16, 16, 3) and torch.equal(fresh(3, 0, 16, cache), first)
    cache.write_bytes(b"broken")
    assert torch.equal(fresh(3, 0, 16, cache), first)
    assert not torch.equal(fresh(3, 1, 16, tmp_path / "other.npy"), first)


RUNS = {
    "developable": config(),
    "flatten": config("flatten"),
    "published": config(
        model=PUBLISHED,
        augment="shear",
        phase=[
            {"batch": 4, "weights": {"in": 1, "fair": 1, "gc": 1}, "decay": 3.0},
            {"batch": 4, "weights": {"k_left": 1, "d_h": 0.4}},
        ],
    ),
    "flatten published": config(
        "flatten",
        PUBLISHED,
        phase=[
            {"batch": 4, "weights": {"iso_w": 1e6, "iso": 1, "fair": 1}},
            {"batch": 4, "weights": {"iso_cell": 1e4, "iso_cell_w": 1.0}},
        ],
    ),
    "denoise": config(
        "denoise", {**PUBLISHED, "sigma": True}, phase=[{"loss": "clean", "batch": 4}]
    ),
    "bfloat16": replace(config(), bf16=True),
    "unrolled": config(phase=[{"batch": 4, "weights": {"gc": 1}, "unrolled": True}]),
}


@pytest.mark.parametrize("made", RUNS.values(), ids=list(RUNS))
def test_runs(made, folder, tmp_path):
    card = train(made, folder, tmp_path)
    assert card["steps"] == 6 and all(np.isfinite(v) for v in card["validation"].values())
    assert load(tmp_path / "model.safetensors").task == made.task
    rows = read_curves(tmp_path)
    assert rows[-1]["step"] == 6


@pytest.mark.parametrize("name", ["net-c", "developable", "flatten"])
def test_bfloat16_spares_the_curvature(name):
    # Where positions go in and displacements come out, its rounding would cover the optimum.
    net = load(name)
    grids = [surface.sample(64) for surface in generate(2, seed=5)]
    surfaces = normalise(torch.from_numpy(np.stack(grids))).float()
    found = []
    for net.bf16 in (False, True):
        results = zip(surfaces.double().numpy(), applied(net, surfaces), strict=True)
        found.append(np.mean([net.kind.figures(*both)[net.kind.score] for both in results]))
    exact, rounded = found
    assert abs(rounded - exact) < 0.05 * exact


@pytest.mark.parametrize(
    ("made", "expected"),
    [
        (config(steps=4), {"curvature", "fairness", "proximity", "elongation"}),
        (config("flatten", steps=4), {"strain", "edges"}),
        (replace(RUNS["denoise"], steps=4), {"distance", "angle"}),
        (
            config(steps=4, phase=[{"batch": 4, "weights": {"in": 1, "gc": 2.0}}]),
            {"in", "gc"},
        ),
    ],
)
@pytest.mark.usefixtures("often")
def test_curves_show_every_term_of_the_loss(made, expected, folder, tmp_path):
    train(made, folder, tmp_path)
    (row,) = [r for r in read_curves(tmp_path) if "loss" in r]
    terms = {name.removeprefix("loss/"): v for name, v in row.items() if name.startswith("loss/")}
    assert terms.keys() == expected
    assert sum(terms.values()) == pytest.approx(row["loss"], rel=1e-4)
    assert row["skipped"] == 0


@pytest.mark.usefixtures("often")
def test_steps_whose_gradient_is_not_finite_are_skipped_and_counted(folder, tmp_path, monkeypatch):
    real = Objective.forward

    def spoilt(self, batch, phase, progress):
        loss, terms = real(self, batch, phase, progress)
        return (loss * math.nan if batch.step % 2 == 1 else loss), terms

    monkeypatch.setattr(Objective, "forward", spoilt)
    card = train(config(steps=4), folder, tmp_path)
    (row,) = [r for r in read_curves(tmp_path) if "loss" in r]
    assert row["skipped"] == card["skipped"] == 2
    assert np.isfinite(row["loss"])
    assert all(v.isfinite().all() for v in tensors(tmp_path / "model.safetensors").values())


def test_the_best_net_by_validation_is_kept_beside_the_last(folder, tmp_path, monkeypatch):
    scores = iter([3.0, 1.0, 2.0, math.nan, 4.0])
    monkeypatch.setattr(
        "gso.net.training.training_run.mean_figures", lambda *_: {"score": next(scores)}
    )
    train(config(steps=4, validate_every=0.0, checkpoint_every=0.0), folder, tmp_path)
    best, last = (json.loads((tmp_path / f"{n}.json").read_text()) for n in ("best", "model"))
    assert (best["checkpoint"], last["checkpoint"]) == ("best", "last")
    assert best["steps"] == 2 and last["steps"] == 4
    assert best["validation"] == {"score": 1.0}
    assert best["best"] == last["best"] == {"steps": 2, "score": 1.0}
    assert load(tmp_path / "best.safetensors").task == "developable"
    # A run that goes on remembers its best net.
    scores = iter([1.5])
    train(config(steps=4, validate_every=0.0), folder, tmp_path)
    assert json.loads((tmp_path / "best.json").read_text()) == best


@pytest.mark.usefixtures("often")
def test_loss_falls(folder, tmp_path):
    made = config(steps=24, phase=[{"loss": "energy", "batch": 8, "rate": 5e-3}], augment="none")
    card = train(made, folder, tmp_path)
    rows = [r["loss"] for r in read_curves(tmp_path) if "loss" in r]
    assert rows[-1] < 0.9 * rows[0]
    assert card["validation"]["K_A_r"] > 0.02


@pytest.mark.usefixtures("often")
def test_labels_are_learnt(tmp_path, folder):
    recipe = gso.dataset.Recipe(n=10, size=16, labels=("developable", "strain"), extras=False)
    gso.dataset.build(tmp_path / "set", recipe, workers=0)
    for task, label in (("developable", "developable"), ("flatten", "strain")):
        phase = [{"loss": "label", "batch": 8, "rate": 5e-3}]
        made = config(task, label=label, phase=phase, steps=24, augment="none", fresh=2)
        assert len(open_source(made, tmp_path / "set", tmp_path).surfaces) == 10
        train(made, tmp_path / "set", tmp_path / task)
        rows = [r["loss"] for r in read_curves(tmp_path / task) if "loss" in r]
        assert rows[-1] < 0.9 * rows[0]
    with pytest.raises(DatasetError, match="no array"):
        train(config(label="lengths", phase=phase), tmp_path / "set", tmp_path / "run")


class _Killed(Exception):
    pass


@pytest.mark.usefixtures("often")
def test_a_killed_run_ends_with_the_same_weights(folder, tmp_path, whole):
    made, wanted = replace(whole[0], checkpoint_every=0.0), whole[1]

    def kill(report):
        raise _Killed

    with pytest.raises(_Killed):
        train(made, folder, tmp_path / "killed", show=kill)
    assert 0 < len(read_curves(tmp_path / "killed")) < 4
    # Written after the last checkpoint, and cut off: these rows do not stay.
    with (tmp_path / "killed" / "curves.jsonl").open("a") as file:
        file.write('{"step": 8, "seconds": 9.0, "loss": 1.0}\n{"step": 8, "sec')
    card = train(made, folder, tmp_path / "killed")
    again = tensors(tmp_path / "killed" / "model.safetensors")
    assert all(torch.equal(wanted[k], again[k]) for k in wanted)
    rows = read_curves(tmp_path / "killed")
    assert [r["step"] for r in rows] == [4, 8, 10] and rows[1]["seconds"] != 9.0
    assert train(made, folder, tmp_path / "killed")["sha256"] == card["sha256"]


@pytest.fixture
def listening():
    """Ctrl-C as Python has it: a shell has it ignored by what it starts in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("listening", "often")
def test_ctrl_c_ends_a_run_between_steps(folder, tmp_path, whole):
    made, wanted = whole

    def interrupt(report):
        if report.step == 4:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        train(made, folder, tmp_path / "interrupted", show=interrupt)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    kept = checkpoint.numbers(tmp_path / "interrupted" / "checkpoint.safetensors")
    assert kept["step"] in (4, 5)
    train(made, folder, tmp_path / "interrupted")
    again = tensors(tmp_path / "interrupted" / "model.safetensors")
    assert all(torch.equal(wanted[k], again[k]) for k in wanted)


def test_sets_in_another_unit_train_the_same_net(tmp_path):
    surfaces = np.stack([saddle(16), 0.5 * sphere_cap(16)] * 4)
    for name, unit in (("one", 1.0), ("thousand", 1000.0)):
        for split in ("train", "validation"):
            place = tmp_path / name / split
            place.mkdir(parents=True)
            for k, points in enumerate(surfaces):
                np.save(place / f"{k}.npy", unit * points)
        train(config(augment="symmetries"), tmp_path / name, tmp_path / f"run {name}")
    one, other = (tensors(tmp_path / f"run {n}" / "model.safetensors") for n in ("one", "thousand"))
    assert all(torch.allclose(one[k].float(), other[k].float(), atol=1e-2) for k in one)


def test_a_folder_of_the_nets_name_is_no_configuration(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "net-c").mkdir()
    assert read("net-c").name == "net-c"


def test_what_a_folder_holds_is_respected(folder, tmp_path):
    train(config(), folder, tmp_path)
    with pytest.raises(OptionError, match="number of minutes"):
        train(config(), folder, tmp_path, minutes=1.0)
    with pytest.raises(OptionError, match="another configuration"):
        train(config(model={"kind": "coarse", "widths": [16, 16, 32]}), folder, tmp_path)
    with pytest.raises(OptionError, match="another configuration"):
        train(config(seed=5), folder, tmp_path)
    train(config(validate_every=1.0), folder, tmp_path)
    path = tmp_path / "checkpoint.safetensors"
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(WeightsError, match="remove it"):
        train(config(), folder, tmp_path)


def test_checkpoint_of_another_net(tmp_path):
    small, large = (GSONet(channels=c, blocks=1) for c in (4, 8))
    mine, others = (optimisers(net, "muon", 0.0) for net in (small, large))
    checkpoint.save(tmp_path / "c", small, copy.deepcopy(small), mine, {})
    with pytest.raises(WeightsError):
        checkpoint.load(tmp_path / "c", large, large, others)


def test_steps_of_muon_are_alike_in_all_directions():
    weight = torch.nn.Parameter(torch.zeros(24, 10, 3, 3))
    (muon,) = optimisers(torch.nn.ParameterList([weight]), "muon", 0.0)
    generator = torch.Generator().manual_seed(0)
    # A gradient that is ten thousand times larger along some directions than along others.
    scale = torch.logspace(-4, 0, 24)[:, None, None, None]
    weight.grad = scale * torch.randn(weight.shape, generator=generator)
    muon.step()
    sizes = torch.linalg.svdvals(weight.detach().flatten(1)) / muon.defaults["lr"]
    rms = 0.2 * 90**0.5
    assert sizes.median() / rms == pytest.approx(1.0, abs=0.3)
    assert sizes.max() < 1.3 * rms
    # Of AdamW's size: both kinds of weights go by one rate.
    step = weight.detach().square().mean().sqrt() / muon.defaults["lr"]
    assert 0.1 < step < 0.3


def test_matrices_are_made_orthogonal_together_as_alone():
    many = torch.randn(3, 12, 30, generator=torch.Generator().manual_seed(0))
    for some in (many, many.mT):
        alone = torch.cat([orthogonal(one[None]) for one in some])
        torch.testing.assert_close(orthogonal(some), alone, atol=1e-5, rtol=0)


@pytest.mark.parametrize(
    "name", ["developable", "net-c", "net-f", "flatten-strain", "flatten", "denoise"]
)
def test_a_step_stays_on_the_device_of_its_batch(name, monkeypatch):
    # The device without storage refuses tensors of others, as a GPU does.
    meta = torch.device("meta")
    monkeypatch.setattr(Net, "autocast", lambda *_: contextlib.nullcontext())
    made = read(name)
    # Of its blocks, which are all alike, one is enough.
    few = {"blocks": 1} if made.model["kind"] == "gsonet" else {"depths": [1, 1, 1]}
    objective = Objective(make({**made.model, **few, "task": made.task}).to(meta))
    for phase in made.phases:
        surface = torch.empty(2, 64, 64, 3, device=meta)
        target = torch.empty(2, 64, 64, 2 if made.task == "flatten" else 3, device=meta)
        sigma = torch.empty(2, device=meta) if made.task == "denoise" else None
        loss, _ = objective(Batch(surface, target, sigma, step=3), phase, 0.5)
        loss.backward()
        assert loss.device == meta


def test_muon_takes_matrices_and_adamw_the_rest():
    net = GSONet(channels=8, blocks=1)
    muon, adamw = optimisers(net, "muon", 0.1)
    both = [[p for group in o.param_groups for p in group["params"]] for o in (muon, adamw)]
    assert all(p.ndim > 1 and min(p.shape[:2]) >= 8 for p in both[0])
    assert not any(p is layer.weight for p in both[0] for layer in (net.head, net.tail))
    assert {id(p) for p in both[0] + both[1]} == {id(p) for p in net.parameters()}
    assert sum(p.numel() for p in both[0]) > 0.9 * sum(p.numel() for p in net.parameters())
    (alone,) = optimisers(net, "adamw", 0.1)
    assert isinstance(alone, torch.optim.AdamW) and isinstance(adamw, torch.optim.AdamW)


def test_minutes_end_a_run(folder, tmp_path):
    card = train(config(steps=10**9), folder, tmp_path, minutes=0.02)
    assert 0 < card["steps"] < 10**4
    with pytest.raises(OptionError, match="minutes"):
        train(config(), folder, tmp_path, minutes=0.0)


def test_begin_with_a_net_and_learn_from_its_results(folder, tmp_path):
    save(GSONet(channels=4, blocks=1), tmp_path / "net.safetensors")
    net = str(tmp_path / "net.safetensors")
    phase = [{"batch": 4, "rate": 1e-6, "final_rate": 1e-6, "weights": {"in": 1, "fair": 1}}]
    made = config(model=PUBLISHED, phase=phase, init=net, through=net, augment="none", steps=1)
    train(made, folder, tmp_path / "run")
    first, last = tensors(net), tensors(tmp_path / "run" / "model.safetensors")
    assert all(torch.allclose(first[k], last[k], atol=1e-4) for k in first)
    again = str(tmp_path / "run" / "model.safetensors")
    card = train(replace(made, init=again, through=""), folder, tmp_path / "again")
    assert card["begun_with"]["name"] == made.name and len(card["curve"]) == 2
    assert card["curve"][1][0] >= card["curve"][0][0]
    assert card["hours"] == pytest.approx(card["curve"][1][0], abs=0.002)
    with pytest.raises(OptionError, match="does not fit"):
        train(config(model={**PUBLISHED, "channels": 8}, init=net), folder, tmp_path / "other")
    with pytest.raises(OptionError, match="another kind"):
        train(config(init=net), folder, tmp_path / "other")


def test_results_stay_close_to_what_surfaces_were(folder, tmp_path):
    save(restless(), tmp_path / "net.safetensors")
    net = str(tmp_path / "net.safetensors")
    phase = [{"batch": 4, "weights": {"d_h": 1}}]
    made = config(model=PUBLISHED, phase=phase, through=net, against="designs", augment="none")
    run = begin(made, folder, tmp_path / "run", None, ALONE, None)
    (phase,) = made.phases
    batch = run.source.batch(made, phase, 0)
    assert batch.compared is batch.design and not torch.equal(batch.design, batch.surface)
    changed = run.source.batch(replace(made, augment="symmetries"), phase, 0)
    assert not torch.equal(changed.surface, batch.surface)
    moved = [(b.surface - b.design).norm(dim=-1).flatten(1) for b in (changed, batch)]
    assert torch.equal(*(x.sort(dim=1).values for x in moved))
    for loss in (phase, Phase("energy")):
        alone = replace(batch, design=None)
        assert loss_of(run.net, alone, loss, 0.5) != loss_of(run.net, batch, loss, 0.5)
    for name, seen, designs in (
        ("train", run.source.surfaces, run.source.designs),
        ("validation", *run.check[:2]),
    ):
        surfaces = [np.load(path) for path in sorted((folder / name).glob("*.npy"))]
        before = normalise(torch.from_numpy(np.stack(surfaces))).float()
        result = torch.from_numpy(applied(load(net), before)).float()
        # Both were moved and scaled alike, so that the result is in the unit ball.
        centre, radius = ball(result)
        torch.testing.assert_close(seen * radius + centre, result, atol=1e-5, rtol=0)
        torch.testing.assert_close(designs * radius + centre, before, atol=1e-5, rtol=0)


def test_labels_are_what_a_teacher_makes_of_what_the_net_sees(folder, tmp_path):
    save(restless(), tmp_path / "net.safetensors")
    net = str(tmp_path / "net.safetensors")
    phases = [
        {"loss": "label", "batch": 4, "rate": 1e-6, "weights": {}},
        {"batch": 4, "weights": {"k_left": 1.0, "label": 0.5}},
    ]
    made = config(model=PUBLISHED, phase=phases, through=net, against="designs", teacher=net)
    run = begin(made, folder, tmp_path / "run", None, ALONE, None)
    by_teacher = torch.from_numpy(applied(load(net), run.source.surfaces)).float()
    torch.testing.assert_close(run.source.labels, by_teacher, atol=1e-5, rtol=0)
    for phase in made.phases:
        batch = run.source.batch(made, phase, 0)
        assert batch.target is not None and batch.design is not None
        assert loss_of(load(net), batch, phase, 0.5).isfinite()
    # The teacher has learnt what it teaches; symmetries would tell its grids apart.
    batch = run.source.batch(replace(made, augment="none"), made.phases[0], 0)
    assert loss_of(load(net), batch, made.phases[0], 0.5) < 1e-3
    assert loss_of(run.net, batch, made.phases[0], 0.5) > 0.5
    save(GSONet("flatten", channels=4, blocks=1), tmp_path / "flat.safetensors")
    flat = str(tmp_path / "flat.safetensors")
    for wrong in ({"teacher": flat}, {"through": flat}):
        with pytest.raises(OptionError, match="a net for task 'flatten'"):
            begin(replace(made, **wrong), folder, tmp_path / "other", None, ALONE, None)


def test_a_teacher_labels_fresh_surfaces_for_every_stride(folder, tmp_path):
    save(restless("flatten", stencils=True), tmp_path / "net.safetensors")
    phases = [{"loss": "label", "batch": 4, "stride": 2}, {"batch": 4, "weights": {"label": 1.0}}]
    changes = {"teacher": str(tmp_path / "net.safetensors"), "fresh": 3, "augment": "none"}
    made = config(task="flatten", model=PUBLISHED, phase=phases, **changes)
    run = begin(made, folder, tmp_path / "run", None, ALONE, None)
    assert len(run.source.labels) == len(run.source.surfaces)
    for phase in made.phases:
        batch = run.source.batch(made, phase, 0)
        assert batch.target.shape == (*batch.surface.shape[:3], 2)
        assert loss_of(run.net, batch, phase, 0.5).isfinite()


def launch(folder, out, path, processes):
    """Run the command in several processes, by torchrun."""
    command = [sys.executable, "-m", "torch.distributed.run", "--standalone"]
    command += ["--nproc-per-node", str(processes), "-m", "gso", "train", str(path)]
    command += ["--data", str(folder), "--out", str(out), "--device", "cpu"]
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=200)


def test_two_processes_learn_what_one_learns(folder, tmp_path):
    path = tmp_path / "config.json"
    path.write_text(json.dumps(config().as_dict()))
    train(config(), folder, tmp_path / "one", device="cpu")
    done = launch(folder, tmp_path / "two", path, 2)
    assert done.returncode == 0, done.stderr
    one, two = (tensors(tmp_path / n / "model.safetensors") for n in ("one", "two"))
    assert all(torch.allclose(one[k], two[k], atol=2e-3) for k in one)


def test_command(folder, tmp_path):
    path = tmp_path / "config.json"
    path.write_text(json.dumps(config().as_dict()))
    run = [str(path), "--data", str(folder), "--out", str(tmp_path / "run")]
    done = CliRunner().invoke(main, ["train", *run, "--steps", "2"])
    assert done.exit_code == 0 and "2 steps" in done.output
    assert CliRunner().invoke(main, ["train", *run, "--steps", "3", "-q"]).exit_code == 1
    failed = CliRunner().invoke(main, ["train", "none.toml", *run[1:]])
    assert failed.exit_code == 1 and "gso: error" in failed.output


def test_configuration_is_a_value():
    assert config() == config() and isinstance(config(), Config)


@pytest.mark.slow
def test_all_nets_are_trained_by_one_command(tmp_path):
    """Every net of the package, from those trained before it; the same command resumes."""
    recipe = gso.dataset.Recipe(n=12, size=16, extras=False)
    gso.dataset.build(tmp_path / "set", recipe, workers=0)
    words = ["train", "all", "--data", str(tmp_path / "set"), "--out", str(tmp_path / "runs")]
    words += ["--device", "cpu", "--steps", "1", "--fresh", "0"]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 0, done.output
    assert set(HOURS) == {n for n in available() if n not in CHAINS}
    cards = {n: read_card(tmp_path / "runs" / n / "model.safetensors") for n in HOURS}
    assert all(card["steps"] == 1 and card["data"]["n"] == 12 for card in cards.values())
    assert cards["net-f"]["begun_with"]["sha256"] == cards["net-c"]["sha256"]
    for word, net in (("init", "net-c"), ("through", "net-c"), ("teacher", "developable-fast")):
        assert cards["net-f"]["config"][word] == str(tmp_path / "runs" / net / "model.safetensors")
    (tmp_path / "runs" / "flatten-w" / "checkpoint.safetensors").unlink()
    (tmp_path / "runs" / "flatten-w" / "model.safetensors").unlink()
    assert CliRunner().invoke(main, words).exit_code == 0
    for name, card in cards.items():
        again = read_card(tmp_path / "runs" / name / "model.safetensors")
        assert (again["sha256"], again["steps"]) == (card["sha256"], 1)
    for wrong, says in (
        (["--hours", "1"], "take one"),
        (["--init", "net-c"], "--init does not go with all"),
    ):
        failed = CliRunner().invoke(main, [*words, *wrong])
        assert failed.exit_code and says in failed.output
    failed = CliRunner().invoke(main, [*words[:-4], "--hours", "net-d=1"])
    assert failed.exit_code and "no net 'net-d'" in failed.output

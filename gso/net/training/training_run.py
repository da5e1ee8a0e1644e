"""The state of a training run: how it is started or resumed, and the files that it writes."""

from __future__ import annotations

import copy
import math
import os
import platform
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

import torch
from torch import Tensor

from gso.dataset import store
from gso.dataset.drawing import draw_broad
from gso.errors import OptionError
from gso.net import tasks, weights
from gso.net.catalogue import located, read_card
from gso.net.models.base import Net
from gso.net.models.grid_geometry import normalise, normalise_with
from gso.net.training import checkpoint, muon
from gso.net.training.config import Config
from gso.net.training.data import Source, Tick, noisy, open_source
from gso.net.training.processes import Processes
from gso.net.training.training_curves import Curves, read
from gso.net.training.validate import applied, mean_figures
from gso.typing import Json

#: Files of a run.
CHECKPOINT, MODEL, BEST = "checkpoint.safetensors", "model.safetensors", "best.safetensors"
#: Seed of the noise that validation adds.
_NOISE = 7
#: Surfaces of the recipe for each one of the broad set in validation.
_FEWER = 4
#: Number of surfaces per block when the processes apply another net to the surfaces.
_BLOCK = 64


@dataclass
class Run:
    """The complete state of a training run."""

    config: Config
    folder: Path
    here: Processes
    limit: float | None
    source: Source
    check: tuple[Tensor, Tensor, Tensor | None]
    elsewhere: Tensor | None
    net: Net
    average: Net
    optimisers: list[torch.optim.Optimizer]
    origin: Json
    begun_with: Json
    step: int = 0
    spent: float = 0.0
    skipped: int = 0
    figures: dict[str, float] = field(default_factory=dict)
    best: dict[str, float] = field(default_factory=dict)
    card: Json = field(default_factory=dict)
    curves: Curves | None = None

    @property
    def progress(self) -> float:
        """Completed fraction of the run; it is the same in all processes."""
        if self.limit is None:
            return self.step / self.steps
        return self.here.agreed(self.spent / self.limit)

    @property
    def steps(self) -> int:
        """Steps of the run, unless a limit in minutes replaces them."""
        return self.config.steps_for(self.source.count(self.config.phases[0]))

    def follow(self) -> None:
        """Update the moving average of the weights."""
        decay = min(self.config.ema, (1 + self.step) / (10 + self.step))
        with torch.no_grad():
            means: list[Tensor] = list(self.average.parameters())
            values: list[Tensor] = list(self.net.parameters())
            torch._foreach_lerp_(means, values, 1.0 - decay)

    def keep(self) -> None:
        """Write a checkpoint, in the first process only."""
        if self.here.first:
            state = {
                "step": self.step,
                "spent": self.spent,
                "skipped": self.skipped,
                "figures": self.figures,
                "best": self.best,
                **self.same(),
            }
            path = self.folder / CHECKPOINT
            checkpoint.save(path, self.net, self.average, self.optimisers, state)

    def same(self) -> Json:
        """Return the values that must be unchanged when the run is resumed."""
        return {"config": _kept(self.config), "data": self.origin["data"], "limit": self.limit}

    def validate(self) -> None:
        """Compute validation metrics of the averaged net, and write it with its card.

        If its score is the best so far, it is also written as the best net.
        """
        if self.here.first:
            surfaces, truths, sigma = self.check
            results = applied(self.average.eval(), surfaces, sigma)
            self.figures = mean_figures(self.config.task, truths.double().numpy(), results)
            if self.elsewhere is not None:
                results = applied(self.average, self.elsewhere)
                found = mean_figures(self.config.task, self.elsewhere.double().numpy(), results)
                self.figures |= {f"broad_{name}": value for name, value in found.items()}
            if self.curves is not None:
                self.curves.add(self.step, self.spent, **self.figures)
            score = self.figures[tasks.get(self.config.task).score]
            if score < self.best.get("score", math.inf):
                self.best = {"steps": self.step, "score": score}
                card = self._card() | {"checkpoint": "best"}
                weights.save(self.average, self.folder / BEST, card)
            self.card = weights.save(self.average, self.folder / MODEL, self._card())
        self.here.wait()

    def _card(self) -> Json:
        card = {
            "name": self.config.name,
            "config": self.config.as_dict(),
            "checkpoint": "last",
            "best": self.best,
            "steps": self.step,
            "skipped": self.skipped,
            "hours": round(self._hours_before + self.spent / 3600, 3),
            "validation": self.figures,
            **self.origin,
        }
        if self.begun_with:
            kept = ("name", "hours", "sha256", "hardware", "begun_with")
            card["begun_with"] = {k: self.begun_with[k] for k in kept if k in self.begun_with}
        return card | {"curve": self._curve()}

    @property
    def _goes_on(self) -> bool:
        """Whether the run starts from the weights of an earlier run of the same net."""
        return self.begun_with.get("name") == self.config.name

    @property
    def _hours_before(self) -> float:
        return float(self.begun_with.get("hours", 0.0)) if self._goes_on else 0.0

    def _curve(self) -> list[list[float]]:
        """Return rows of hours and validation score, including earlier runs of this net."""
        name = tasks.get(self.config.task).score
        curve = list(self.begun_with.get("curve", [])) if self._goes_on else []
        for row in read(self.folder):
            if name in row:
                hours = self._hours_before + row["seconds"] / 3600
                curve.append([round(hours, 3), round(row[name], 5)])
        return curve

    def close(self) -> None:
        """Close the training curves."""
        if self.curves is not None:
            self.curves.close()


def _kept(config: Config) -> Json:
    """Return the settings that must be unchanged on resuming: all but those of monitoring."""
    rest = config.as_dict()
    for name in ("validate_every", "checkpoint_every", "validate"):
        del rest[name]
    return rest


def begin(
    config: Config,
    data: Path,
    folder: Path,
    minutes: float | None,
    here: Processes,
    tick: Tick | None,
) -> Run:
    """Start a new run, or resume the one in `folder` from its checkpoint."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OptionError(f"{folder} cannot be made: {error.strerror}") from None
    torch.manual_seed(config.seed)
    net = weights.make(dict(config.model) | {"task": config.task})
    if config.init:
        _take(net, weights.load(config.init, device="cpu"), config.init)
    through, teacher = (_other(config, word, here) for word in ("through", "teacher"))
    net = weights.placed(net, here.device)
    net.bf16 = _fast(here.device) if config.bf16 is None else config.bf16
    average = copy.deepcopy(net).requires_grad_(False)
    average.bf16 = False
    if here.first:
        # The first process draws surfaces; the others read them from its files.
        source = open_source(config, data, folder, tick)
    here.wait()
    if not here.first:
        source = open_source(config, data, folder)
    _sizes_fit(config, net, source)
    run = Run(
        config,
        folder,
        here,
        None if minutes is None else 60.0 * minutes,
        source,
        _validation(config, data),
        _elsewhere(config, source),
        net,
        average,
        muon.optimisers(net, config.optimiser, config.weight_decay),
        _origin(data, here),
        read_card(located(config.init)) if config.init else {},
    )
    told = tick if here.first else None
    if through is not None:
        _pass_through(run, through, told)
    if teacher is not None:
        what = f"labels by {config.teacher}"
        run.source.labels = _results(teacher, run.source.surfaces, here, told, what)
    path = folder / CHECKPOINT
    if path.exists():
        there, words = checkpoint.numbers(path), {"config": "configuration", "data": "set"}
        for key, value in run.same().items():
            if there.get(key) != value:
                other = words.get(key, "number of minutes")
                raise OptionError(f"{folder} holds a run with another {other}; take another folder")
        state = checkpoint.load(path, net, average, run.optimisers)
        run.step, run.spent, run.figures = state["step"], state["spent"], state["figures"]
        run.skipped, run.best = state.get("skipped", 0), state.get("best", {})
    run.source = run.source.placed(here.device)
    if here.first:
        run.curves = Curves(folder, run.step)
    return run


def _take(net: Net, other: Net, name: str) -> None:
    """Initialise a net with the weights of another net of the same kind."""
    if other.settings.keys() != net.settings.keys() or type(other) is not type(net):
        raise OptionError(f"init: {name} is a net of another kind")
    try:
        net.copy_weights_from(other)
    except RuntimeError as error:
        raise OptionError(f"init: {name} does not fit: {error}") from None


def _other(config: Config, word: str, here: Processes) -> Net | None:
    """Load the net that the configuration names under `word`; it must have the same task."""
    name = getattr(config, word)
    if not name:
        return None
    net = weights.load(name, device=here.device)
    if net.task != config.task:
        raise OptionError(f"{word}: {name} is a net for task {net.task!r}")
    return net


def _sizes_fit(config: Config, net: Net, source: Source) -> None:
    """Reject strides for which the number of vertices does not suit the net."""
    size = source.surfaces.shape[1]
    for phase in config.phases:
        left = -(-size // phase.stride)
        if left % net.multiple:
            raise OptionError(
                f"stride {phase.stride} leaves {left} of {size} vertices along a side, and this "
                f"net needs a multiple of {net.multiple}"
            )


def _pass_through(run: Run, net: Net, tick: Tick | None) -> None:
    """Replace the surfaces by another net's results, normalised to the unit ball.

    The designs undergo the same similarity transform as the results.
    """

    def done(surfaces: Tensor) -> tuple[Tensor, Tensor]:
        what = f"surfaces through {run.config.through}"
        seen, designs = normalise_with(_results(net, surfaces, run.here, tick, what), surfaces)
        return seen, designs

    seen, designs = done(run.source.surfaces)
    run.source = Source(seen, designs=designs if run.config.against == "designs" else None)
    run.check = *done(run.check[0]), None


def _results(net: Net, surfaces: Tensor, here: Processes, tick: Tick | None, what: str) -> Tensor:
    """Compute the results (n, H, W, d) of a net; the processes share the work."""
    out = torch.zeros(*surfaces.shape[:3], net.kind.components)
    for start in range(here.rank * _BLOCK, len(surfaces), here.world * _BLOCK):
        block = slice(start, start + _BLOCK)
        out[block] = torch.from_numpy(applied(net, surfaces[block]))
        if tick is not None:
            tick(what, min(start + here.world * _BLOCK, len(surfaces)), len(surfaces))
    return here.summed(out)


def _validation(config: Config, data: Path) -> tuple[Tensor, Tensor, Tensor | None]:
    """Return input surfaces for validation, the surfaces to compare with, and the noise."""
    split = store.open(data)["validation"]
    clean = normalise(torch.from_numpy(split["surface"][: config.validate])).float()
    if not tasks.get(config.task).noisy:
        return clean, clean, None
    return noisy(clean, config.sigma, torch.Generator().manual_seed(_NOISE))


def _elsewhere(config: Config, source: Source) -> Tensor | None:
    """Return surfaces of the broad set's families for validation, if the run learns from others."""
    if not config.broad or tasks.get(config.task).noisy or config.through:
        return None
    size, count = source.surfaces.shape[1], max(config.validate // _FEWER, 1)
    drawn = torch.from_numpy(draw_broad("validation", count, seed=_NOISE, size=size))
    return normalise(drawn).float()


def _fast(device: torch.device) -> bool:
    """Tell whether convolutions in bfloat16 pay off on a device."""
    if device.type == "cuda":
        return bool(torch.cuda.is_bf16_supported())
    known = getattr(torch.cpu, "_is_avx512_bf16_supported", lambda: False)
    return device.type == "cpu" and bool(known())


def _origin(data: Path, here: Processes) -> Json:
    """Describe data, package versions and hardware, for the card."""
    manifest = store.open(data).manifest
    hardware = platform.processor() or platform.machine()
    if here.device.type == "cuda":
        hardware = torch.cuda.get_device_name(here.device)
    return {
        "data": {k: v for k, v in manifest.get("recipe", {}).items() if k != "options"},
        "versions": {
            "python": platform.python_version(),
            **{name: version(name) for name in ("gso", "torch", "numpy")},
        },
        "hardware": {
            "processes": here.world,
            "device": hardware,
            "cores": os.cpu_count(),
            "threads": torch.get_num_threads(),
        },
    }

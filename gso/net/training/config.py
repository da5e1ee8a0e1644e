"""Configurations of training runs, read from TOML or JSON files and checked."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import TypeVar

from gso.errors import OptionError
from gso.net import tasks
from gso.quantities import as_positive
from gso.spelling import check_keywords, choices
from gso.typing import AnyPath, Json

C = TypeVar("C", "Config", "Phase")

#: Configurations that come with the package.
FOLDER = Path(__file__).parents[1] / "configs"

LOSSES = ("published", "label", "energy", "clean")
OPTIMISERS = ("muon", "adamw")
AUGMENTATIONS = ("none", "symmetries", "shear")
#: Largest stride of a phase; larger ones leave too few vertices.
LARGEST_STRIDE = 4
#: All terms of the loss "published": published losses, metrics of results, and the label.
TERMS = (
    *("in", "fair", "gc", "loss_gc", "k_left", "d_h", "fair_ratio"),
    *("iso", "iso_w", "iso_cell", "iso_cell_w", "strain", "label"),
)


@dataclass(frozen=True)
class Phase:
    r"""A phase of training with one loss.

    Attributes
    ----------
    loss : {"published", "label", "energy", "clean"}
        "published": a weighted sum of the terms of Wang et al. 2024 and of metrics of the
        results. "label": the distance to the result of the optimiser or a teacher.
        "energy": the optimiser's own objective. "clean" (denoise): the distance to the
        surface without noise, and the angle between the normals.
    share : float
        Length of the phase, relative to the other phases.
    rate : float
        Learning rate at the start of the phase, after the run's `warm_up` in the first one.
    final_rate : float
        Learning rate at the end of the phase; between the two it follows a cosine. Equal to
        `rate` it makes the rate constant.
    batch : int
        Surfaces per step, summed over all processes.
    clip : float
        Bound on the norm of the gradient, which is scaled down to it.
    weights : dict
        "published": the factor of each term; "label" is one of the terms. "gc" is mean \|K\|
        over both triangulations of the cells, "loss_gc" over the published one. "energy"
        (developable): `w_curvature`, `w_fairness`, `w_proximity` replace those of the task's
        options. Each surface's energy is divided by its design's energy to the power
        `balance`: with 1 all surfaces have equal weight, with 0 the curved ones dominate.
        "clean": `angle` is the factor of the mean angle between normals in degrees.
    decay : float
        "published": the weight of "in" decays as exp(-decay t), with t from 0 to 1.
    eps : tuple of 2 float
        "energy" (developable): smoothing of \|K\| at the start, and in the second half.
    stride : int
        The net sees every `stride`-th vertex along both sides; a step with 2 costs a quarter.
    unrolled : bool
        Whether a step trains all passes of the net at once for the last one's result, with
        gradients through all of them. Otherwise the steps train the passes in turn, each for
        its own result, at a lower cost.
    """

    loss: str = "published"
    share: float = 1.0
    rate: float = 1e-3
    final_rate: float = 1e-5
    batch: int = 32
    clip: float = 1.0
    weights: Mapping[str, float] = field(default_factory=dict)
    decay: float = 0.0
    eps: tuple[float, float] = (0.1, 0.01)
    stride: int = 1
    unrolled: bool = False

    def __post_init__(self) -> None:
        _choice("loss", self.loss, LOSSES)
        _whole("batch", self.batch, 1)
        _whole("stride", self.stride, 1)
        if self.stride > LARGEST_STRIDE:
            raise OptionError(f"stride is {self.stride}; take at most {LARGEST_STRIDE}")
        if not isinstance(self.unrolled, bool):
            raise OptionError(f"unrolled is {self.unrolled!r}; it must be true or false")
        for name in ("share", "rate", "clip", "final_rate", "decay"):
            as_positive(getattr(self, name), name, zero=name in ("final_rate", "decay"))
        _pair("eps", self.eps)
        if not isinstance(self.weights, Mapping):
            raise OptionError(f"weights is {self.weights!r}; it must be a table")
        known: tuple[str, ...] = {
            "published": TERMS,
            "energy": ("w_curvature", "w_fairness", "w_proximity", "balance"),
            "clean": ("angle",),
        }.get(self.loss, ())
        for name, value in self.weights.items():
            _choice(f"weights of a phase with loss {self.loss!r}:", name, known)
            as_positive(value, name, zero=True)
        if self.loss == "published" and not any(self.weights.values()):
            raise OptionError(f"a phase with loss 'published' needs weights: {', '.join(TERMS)}")

    @property
    def labelled(self) -> bool:
        """Whether the loss has a label term."""
        return self.loss == "label" or bool(self.weights.get("label"))


@dataclass(frozen=True)
class Config:
    """A training run.

    Attributes
    ----------
    name : str
        Name of the net.
    task : str
        Task of the net; see :mod:`gso.net.tasks`.
    model : dict
        Kind and settings of the net; see :class:`gso.net.CoarseNet`, :class:`gso.net.GSONet`.
    phases : tuple of Phase
        Phases of training, in sequence.
    steps : int
        Steps of the whole run; a limit in minutes replaces it.
    epochs : int
        Passes over the surfaces of the run, in place of `steps`; 0 for `steps`. All phases
        must then have the same batch and see the same surfaces.
    warm_up : float
        Fraction of the run over which the learning rate rises from zero.
    seed : int
        Seed of all random numbers.
    limit : int
        Number of surfaces of the train split that are used; 0 for all.
    fresh : int
        Number of additional surfaces drawn by the recipe. They have no labels in the dataset:
        only phases without labels, or with a teacher, use them.
    broad : int
        Number of additional surfaces of the broad set's train split (:mod:`gso.dataset.broad`),
        without labels like `fresh`.
    label : str
        Array of the dataset with the labels.
    augment : {"none", "symmetries", "shear"}
        Data augmentation: "symmetries" reverses and transposes grids and their labels; "shear"
        is a random shear and orthogonal map, to which labels cannot be adapted.
    sigma : tuple of 2 float
        "denoise": smallest and largest noise; its logarithm is uniformly distributed.
    init : str
        Net whose weights are the initial ones: a name or a .safetensors file.
    teacher : str
        Net whose results are the labels, in place of an array of the dataset.
    through : str
        Net whose results replace the input surfaces: Net-F is trained on those of Net-C.
    against : {"seen", "designs"}
        With `through`, the surfaces with which results are compared in training: the net's
        input, as published, or the designs. Validation always compares with the designs.
    ema : float
        Decay of the moving average of the weights. The averaged net is the one saved.
    optimiser : {"muon", "adamw"}
        "muon": Muon for the weights of layers with 8 or more channels on both sides, AdamW for
        the rest. "adamw": AdamW for all.
    weight_decay : float
        Decoupled weight decay: a step multiplies weights by 1 - learning rate * weight_decay.
    bf16 : bool or None
        Whether convolutions run in bfloat16; None uses it where the device supports it.
    validate_every, checkpoint_every : float
        Seconds between two validations, and between two checkpoints.
    validate : int
        Number of surfaces used for validation.
    """

    name: str
    task: str
    model: Mapping[str, object]
    phases: tuple[Phase, ...]
    steps: int = 10_000
    epochs: int = 0
    warm_up: float = 0.01
    seed: int = 0
    limit: int = 0
    fresh: int = 0
    broad: int = 0
    label: str = "developable"
    augment: str = "symmetries"
    sigma: tuple[float, float] = (0.0005, 0.02)
    init: str = ""
    teacher: str = ""
    through: str = ""
    against: str = "seen"
    ema: float = 0.999
    optimiser: str = "muon"
    weight_decay: float = 1e-2
    bf16: bool | None = None
    validate_every: float = 600.0
    checkpoint_every: float = 180.0
    validate: int = 128

    def __post_init__(self) -> None:
        _choice("task", self.task, tuple(tasks.names()))
        _choice("augment", self.augment, AUGMENTATIONS)
        _choice("against", self.against, ("seen", "designs"))
        _choice("optimiser", self.optimiser, OPTIMISERS)
        for name in ("steps", "validate", "limit", "fresh", "broad", "seed", "epochs"):
            _whole(name, getattr(self, name), int(name in ("steps", "validate")))
        for name in ("ema", "weight_decay", "warm_up", "validate_every", "checkpoint_every"):
            as_positive(getattr(self, name), name, zero=True)
        _pair("sigma", self.sigma)
        if not self.ema < 1 or not self.sigma[0] <= self.sigma[1]:
            raise OptionError("ema must be below 1, and sigma two positive numbers that rise")
        if self.warm_up > 1:
            raise OptionError(f"warm_up is {self.warm_up:g}; it is a fraction of the run, 0 to 1")
        if not self.phases:
            raise OptionError("a configuration needs [[phase]] tables")
        if self.teacher and tasks.get(self.task).noisy:
            raise OptionError(
                f"teacher does not go with task {self.task!r}: clean surfaces are its labels"
            )
        if self.teacher and not any(phase.labelled for phase in self.phases):
            raise OptionError("teacher: no phase learns labels; give one the weight 'label'")
        if not self.name or Path(self.name).name != self.name:
            raise OptionError(f"name {self.name!r} is no file name")
        if self.epochs and len({(phase.batch, phase.labelled) for phase in self.phases}) > 1:
            raise OptionError(
                "epochs: the phases have other batches, or other surfaces with labels; give steps"
            )
        for phase in self.phases:
            _fits(self, phase)

    def steps_for(self, count: int) -> int:
        """Return the steps of a run on a number of surfaces.

        >>> read("paper-flatten").steps_for(8320)
        32500
        """
        return -(-self.epochs * count // self.phases[0].batch) if self.epochs else self.steps

    def as_dict(self) -> Json:
        """Return the configuration as a dictionary with the layout of its file."""
        out: Json = json.loads(json.dumps(asdict(self)))
        out["phase"] = out.pop("phases")
        return out


def _fits(config: Config, phase: Phase) -> None:
    """Reject combinations of a task, a loss and other settings that do not go together."""
    task = tasks.get(config.task)
    clean = phase.loss == "clean"
    if clean != (task.noisy and phase.loss != "published"):
        raise OptionError(f"loss {phase.loss!r} does not go with task {config.task!r}")
    if phase.loss == "energy" and task.energy is None:
        raise OptionError(f"task {config.task!r} has no loss 'energy'")
    if config.through and not task.refines:
        able = " or ".join(repr(n) for n in tasks.names() if tasks.get(n).refines)
        raise OptionError(f"through is for task {able} only")
    if config.through and phase.labelled and not config.teacher:
        raise OptionError("through: a net's results have no labels, unless a teacher makes them")
    if config.against == "designs" and not config.through:
        raise OptionError("against = 'designs' goes with through only")
    if phase.labelled and config.augment == "shear":
        raise OptionError("labels do not follow a shear; take augment = 'symmetries'")
    wrong = {k for k, v in phase.weights.items() if v and k not in task.terms}
    if phase.loss == "published" and wrong:
        raise OptionError(f"weights {', '.join(sorted(wrong))} do not go with task {config.task!r}")


def read(path: AnyPath, **changes: object) -> Config:
    """Read a .toml or .json file, or a configuration of the package by its name.

    Parameters
    ----------
    path : path
        File, or the name of a configuration in ``gso/net/configs``.
    changes
        Values that replace those of the file, unless they are None. `steps` also replaces the
        file's `epochs`.

    Raises
    ------
    OptionError
        The file cannot be read, or a value is unknown or out of range.

    Examples
    --------
    >>> read("developable", seed=3).seed
    3
    """
    place = Path(path)
    if not place.suffix and not place.is_file():
        place = FOLDER / f"{place.name}.toml"
    try:
        data = place.read_bytes()
        given = json.loads(data) if place.suffix == ".json" else _toml(data.decode())
    except OSError as error:
        known = ", ".join(sorted(p.stem for p in FOLDER.glob("*.toml")))
        raise OptionError(
            f"{path} cannot be read: {error.strerror}; with the package come: {known}"
        ) from None
    except ValueError as error:
        raise OptionError(f"{path} is no configuration: {error}") from None
    if not isinstance(given, dict):
        raise OptionError(f"{path} must hold a table")
    made = {k: v for k, v in changes.items() if v is not None}
    if {"steps", "epochs"} <= made.keys():
        raise OptionError("steps and epochs both give the length of the run; take one")
    return from_dict(given | ({"epochs": 0} if "steps" in made else {}) | made)


def from_dict(given: Mapping[str, object]) -> Config:
    """Make a configuration from a dictionary as :meth:`Config.as_dict` returns it."""
    rest: Json = {"name": "net", **given}
    phases = rest.pop("phase", [])
    if not isinstance(phases, list) or not all(isinstance(p, dict) for p in phases):
        raise OptionError("phase must be a list of tables: [[phase]]")
    if not isinstance(rest.get("model"), dict) or "task" not in rest:
        raise OptionError("a configuration needs task and [model]")
    rest["phases"] = tuple(_made(Phase, p) for p in phases)
    return _made(Config, rest)


def _made(cls: type[C], given: Json) -> C:
    check_keywords(f"a configuration's {cls.__name__}", given, [f.name for f in fields(cls)])
    values: Json = {k: tuple(v) if isinstance(v, list) else v for k, v in given.items()}
    try:
        return cls(**values)
    except TypeError as error:
        raise OptionError(f"configuration: {error}") from None


def _toml(text: str) -> Json:
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib
    table: Json = tomllib.loads(text)
    return table


def _choice(what: str, value: object, known: tuple[str, ...]) -> None:
    if value not in known:
        raise OptionError(f"{what} is {value!r}; {choices(value, known)}")


def _whole(what: str, value: object, least: int) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise OptionError(f"{what} is {value!r}; it must be a whole number, {least} or more")


def _pair(what: str, value: object) -> None:
    if not isinstance(value, tuple) or len(value) != 2:
        raise OptionError(f"{what} is {value!r}; it must be two numbers")
    for one in value:
        as_positive(one, what)

"""What a training run is made of: TOML or JSON files, checked."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from os import PathLike
from pathlib import Path
from typing import Any

from gso.net.catalogue import TASKS
from gso.spelling import check_keywords, choices
from gso.status import OptionError

#: Configurations that come with the package.
FOLDER = Path(__file__).parent / "configs"

LOSSES = ("published", "label", "energy", "clean")
OPTIMISERS = ("muon", "adamw")
AUGMENTATIONS = ("none", "symmetries", "shear")
#: Steps of a phase through the vertices that leave a grid worth training on.
LARGEST_STRIDE = 4
#: What developable surfaces are judged by, and what there is for flat images only.
_JUDGED = ("k_left", "d_h", "fair_ratio")
_FLAT = ("iso", "iso_w", "iso_cell", "iso_cell_w")
#: Terms of the published losses, the figures that results are judged by, and their labels.
TERMS = ("in", "fair", "gc", *_JUDGED, *_FLAT, "label")
#: Terms that a task does not have.
_FOREIGN = {
    "developable": _FLAT,
    "flatten": ("in", "gc", *_JUDGED),
    "denoise": (*_JUDGED, *_FLAT, "label"),
}


@dataclass(frozen=True)
class Phase:
    r"""A stretch of training with one loss.

    Attributes
    ----------
    loss : {"published", "label", "energy", "clean"}
        "published": the weighted terms of Wang et al. 2024, and of the figures that results
        are judged by. "label": the distance to the optimiser's result, or a teacher's.
        "energy": the optimiser's own objective. "clean" (denoise): the distance to the
        surface without noise, and the angle of its normals.
    share : float
        Share of the run's steps or minutes, relative to the other phases'.
    rate : float
        Learning rate at the start of the phase, after a warm-up in the first one.
    final_rate : float
        Rate at its end; between the two it follows a cosine.
    batch : int
        Surfaces per step, of all processes together.
    clip : float
        Largest norm of the gradient.
    weights : dict
        "published": the factor on each term, the loss "label" among them. "energy"
        (developable): `w_curvature`, `w_fairness`, `w_proximity` replace those of the task's
        options; `balance` is the power of the design's own energy that each surface's is
        divided by: 1 lets all surfaces weigh alike, 0 lets the curved ones rule. "clean":
        `angle`, the factor on the normals' mean angle in degrees.
    decay : float
        "published": the weight of "in" falls as exp(-decay t), with t from 0 to 1.
    eps : tuple of 2 float
        "energy" (developable): smoothing of \|K\| at the start and from the middle on.
    stride : int
        The nets see every so-many-th vertex along both sides: with 2 a step costs a quarter.
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

    def __post_init__(self) -> None:
        _choice("loss", self.loss, LOSSES)
        _number("batch", self.batch, 1, whole=True)
        _number("stride", self.stride, 1, whole=True)
        if self.stride > LARGEST_STRIDE:
            raise OptionError(f"stride is {self.stride}; take at most {LARGEST_STRIDE}")
        for name in ("share", "rate", "final_rate", "clip", "decay"):
            _number(name, getattr(self, name), 0.0)
        _pair("eps", self.eps)
        for name in ("share", "rate", "clip"):
            if not getattr(self, name) > 0:
                raise OptionError(f"{name} of a phase must be positive")
        if not isinstance(self.weights, Mapping):
            raise OptionError(f"weights is {self.weights!r}; it must be a table")
        known: tuple[str, ...] = {
            "published": TERMS,
            "energy": ("w_curvature", "w_fairness", "w_proximity", "balance"),
            "clean": ("angle",),
        }.get(self.loss, ())
        for name, value in self.weights.items():
            _choice(f"weights of a phase with loss {self.loss!r}:", name, known)
            _number(name, value, 0.0)
        if self.loss == "published" and not any(self.weights.values()):
            raise OptionError(f"a phase with loss 'published' needs weights: {', '.join(TERMS)}")

    @property
    def labelled(self) -> bool:
        """Whether it learns labels, be it among other things."""
        return self.loss == "label" or bool(self.weights.get("label"))


@dataclass(frozen=True)
class Config:
    """A training run.

    Attributes
    ----------
    name : str
        Name of the net.
    task : {"developable", "flatten", "denoise"}
        What it is for.
    model : dict
        Kind and settings of the net; see :class:`gso.net.CoarseNet`, :class:`gso.net.GSONet`.
    phases : tuple of Phase
        What is minimised, one after the other.
    steps : int
        Steps of the whole run; a limit in minutes replaces it.
    seed : int
        Seed of all random numbers.
    limit : int
        Surfaces of the train split that are used; 0 for all.
    fresh : int
        Surfaces that are drawn by the recipe, beside those of the set, for phases that need
        no labels, or a teacher's.
    label : str
        Array of the set that phases with labels learn.
    augment : {"none", "symmetries", "shear"}
        What is done to surfaces: transposed and reversed grids, which labels follow; or a
        random shear and turn, which they do not.
    sigma : tuple of 2 float
        "denoise": smallest and largest noise; drawn evenly on a logarithmic scale.
    init : str
        Net to begin with: a name or a .safetensors file.
    teacher : str
        Net whose results phases with labels learn, in place of an array of the set.
    through : str
        Net whose results take the surfaces' place: Net-F learns from those of Net-C.
    against : {"seen", "designs"}
        With `through`, what results are compared with in training: the surfaces that the net
        sees, as published, or those that they were before. Validation takes the latter.
    ema : float
        Decay of the moving average of the weights, which is what is kept in the end.
    optimiser : {"muon", "adamw"}
        Muon for the weights of layers with 8 channels or more on both sides and AdamW for the
        rest, or AdamW for all.
    weight_decay : float
        Share of the weights, over the rate, that each step takes away.
    bf16 : bool or None
        Convolutions in bfloat16; None where the processor has it.
    validate_every, checkpoint_every : float
        Seconds between two of them.
    validate : int
        Surfaces that validation looks at.
    """

    name: str
    task: str
    model: Mapping[str, Any]
    phases: tuple[Phase, ...]
    steps: int = 10_000
    seed: int = 0
    limit: int = 0
    fresh: int = 0
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
        _choice("task", self.task, tuple(TASKS))
        _choice("augment", self.augment, AUGMENTATIONS)
        _choice("against", self.against, ("seen", "designs"))
        _choice("optimiser", self.optimiser, OPTIMISERS)
        _number("steps", self.steps, 1, whole=True)
        _number("validate", self.validate, 1, whole=True)
        _number("limit", self.limit, 0, whole=True)
        _number("fresh", self.fresh, 0, whole=True)
        _number("seed", self.seed, 0, whole=True)
        for name in ("ema", "weight_decay", "validate_every", "checkpoint_every"):
            _number(name, getattr(self, name), 0.0)
        _pair("sigma", self.sigma)
        if not self.ema < 1 or not self.sigma[0] <= self.sigma[1]:
            raise OptionError("ema must be below 1, and sigma two positive numbers that rise")
        if not self.phases:
            raise OptionError("a configuration needs [[phase]] tables")
        if self.teacher and self.task == "denoise":
            raise OptionError(
                "teacher does not go with task 'denoise': clean surfaces are its labels"
            )
        if self.teacher and not any(phase.labelled for phase in self.phases):
            raise OptionError("teacher: no phase learns labels; give one the weight 'label'")
        if not self.name or Path(self.name).name != self.name:
            raise OptionError(f"name {self.name!r} is no file name")
        for phase in self.phases:
            _fits(self, phase)

    def as_dict(self) -> dict[str, Any]:
        """The configuration as its file has it."""
        out = json.loads(json.dumps(asdict(self)))
        out["phase"] = out.pop("phases")
        return out


def _fits(config: Config, phase: Phase) -> None:
    """Refuse losses that a task has not."""
    if (phase.loss == "clean") != (config.task == "denoise" and phase.loss != "published"):
        raise OptionError(f"loss {phase.loss!r} does not go with task {config.task!r}")
    if config.through and config.task != "developable":
        raise OptionError("through is for task 'developable' only")
    if config.through and phase.labelled and not config.teacher:
        raise OptionError("through: a net's results have no labels, unless a teacher makes them")
    if config.against == "designs" and not config.through:
        raise OptionError("against = 'designs' goes with through only")
    if phase.labelled and config.augment == "shear":
        raise OptionError("labels do not follow a shear; take augment = 'symmetries'")
    wrong = {k for k, v in phase.weights.items() if v and k in _FOREIGN[config.task]}
    if phase.loss == "published" and wrong:
        raise OptionError(f"weights {', '.join(sorted(wrong))} do not go with task {config.task!r}")


def read(path: str | PathLike[str], **changes: Any) -> Config:
    """Read a .toml or .json file, or a configuration of the package by its name.

    Parameters
    ----------
    path : path
        File, or the name of one in ``gso/net/configs``.
    changes
        Values that replace those of the file, unless they are None.

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
    return from_dict(given | {k: v for k, v in changes.items() if v is not None})


def from_dict(given: Mapping[str, Any]) -> Config:
    """Configuration of a dictionary as :meth:`Config.as_dict` gives it."""
    rest = {"name": "net", **given}
    phases = rest.pop("phase", [])
    if not isinstance(phases, list) or not all(isinstance(p, dict) for p in phases):
        raise OptionError("phase must be a list of tables: [[phase]]")
    if not isinstance(rest.get("model"), dict) or "task" not in rest:
        raise OptionError("a configuration needs task and [model]")
    rest["phases"] = tuple(_made(Phase, p) for p in phases)
    return _made(Config, rest)


def _made(cls: Any, given: Mapping[str, Any]) -> Any:
    check_keywords(f"a configuration's {cls.__name__}", given, [f.name for f in fields(cls)])
    values = {k: tuple(v) if isinstance(v, list) else v for k, v in given.items()}
    try:
        return cls(**values)
    except TypeError as error:
        raise OptionError(f"configuration: {error}") from None


def _toml(text: str) -> Any:
    import sys

    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib
    return tomllib.loads(text)


def _choice(what: str, value: Any, known: tuple[str, ...]) -> None:
    if value not in known:
        raise OptionError(f"{what} is {value!r}; {choices(value, known)}")


def _number(what: str, value: Any, least: float, *, whole: bool = False) -> None:
    kind = int if whole else (int, float)
    sound = isinstance(value, kind) and not isinstance(value, bool) and math.isfinite(value)
    if not sound or not value >= least:
        raise OptionError(f"{what} is {value!r}; it must be a number, {least} or more")


def _pair(what: str, value: Any) -> None:
    if not isinstance(value, tuple) or len(value) != 2:
        raise OptionError(f"{what} is {value!r}; it must be two numbers")
    for one in value:
        _number(what, one, 0.0)
        if not one > 0:
            raise OptionError(f"{what} is {value!r}; it must be positive")

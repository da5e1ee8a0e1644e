"""What a set is made of: everything that its bytes depend on."""

from __future__ import annotations

import platform
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from gso.dataset import shapes
from gso.dataset.labels import KINDS, LABELS
from gso.status import OptionError

#: Changes whenever the same recipe would give other surfaces or labels.
VERSION = 2
#: Surfaces of the published set, and of its splits here.
PUBLISHED = 10401
_VALIDATION, _TEST = 1040, 1041
#: Hard surfaces for each of the others.
_HARD = 0.1
#: Packages that labels may depend on, in the last digits.
_PACKAGES = ("gso", "numpy", "scipy", "casadi", "libigl", "h5py", "cvxopt", "pypardiso")


@dataclass(frozen=True)
class Recipe:
    """What a set is made of.

    Attributes
    ----------
    n : int
        Surfaces of the train, validation and test splits together, 10 or more.
    seed : int
        Seed of all random numbers.
    size : int
        Samples along each side of a surface, 16 or more.
    labels : tuple of str
        Labels that every surface gets: "developable", "strain", "lengths".
    extras : bool
        Whether there are the small named splits of :mod:`gso.dataset.shapes`.

    Raises
    ------
    OptionError
        A value is out of range, or a label unknown.
    """

    n: int = PUBLISHED
    seed: int = 0
    size: int = 64
    labels: tuple[str, ...] = LABELS
    extras: bool = True

    def __post_init__(self) -> None:
        for name, least in (("n", 10), ("seed", 0), ("size", 16)):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < least:
                raise OptionError(f"{name} is {value!r}; it must be an integer, {least} or more")
        object.__setattr__(self, "labels", tuple(self.labels))
        unknown = [k for k in self.labels if k not in LABELS]
        if unknown or len(set(self.labels)) < len(self.labels):
            raise OptionError(
                f"labels are {', '.join(self.labels)}; take {', '.join(LABELS)}, each once at most"
            )

    @property
    def splits(self) -> dict[str, int]:
        """Surfaces by split, in the proportions of 8,320, 1,040 and 1,041.

        >>> list(Recipe(extras=False).splits.items())
        [('train', 8320), ('validation', 1040), ('test', 1041), ('hard', 1040)]
        """
        validation = round(self.n * _VALIDATION / PUBLISHED)
        test = round(self.n * _TEST / PUBLISHED)
        sizes = {"train": self.n - validation - test, "validation": validation, "test": test}
        sizes["hard"] = round(_HARD * self.n)
        return sizes | (dict.fromkeys(shapes.NAMES, shapes.COUNT) if self.extras else {})

    def as_dict(self) -> dict[str, Any]:
        """The recipe, its version and the solver's settings, for a manifest."""
        return {
            "version": VERSION,
            **asdict(self),
            "labels": list(self.labels),
            "options": {name: KINDS[name].options for name in self.labels},
        }

    @classmethod
    def from_dict(cls, given: dict[str, Any]) -> Recipe:
        """The recipe of a manifest."""
        return cls(
            given["n"], given["seed"], given["size"], tuple(given["labels"]), given["extras"]
        )


def versions() -> dict[str, str]:
    """Versions that bytes may depend on; "" for a package that is not installed."""
    found = {"python": platform.python_version(), "machine": platform.machine()}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = ""
    return found

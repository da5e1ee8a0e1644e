"""The recipe of a dataset: everything that determines its bytes."""

from __future__ import annotations

import platform
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version

from gso.dataset import shapes
from gso.dataset.labels import KINDS, LABELS
from gso.dataset.screen import STRATA
from gso.errors import OptionError
from gso.spelling import choices
from gso.typing import Json

#: Incremented whenever the same recipe would give other surfaces or labels.
VERSION = 2
#: Number of surfaces of the published set, and of its validation and test splits here.
PUBLISHED = 10401
_VALIDATION, _TEST = 1040, 1041
#: Kinds of surfaces.
SURFACES = ("bezier", "broad")
#: Size of the split "hard" relative to `Recipe.n`.
_HARD = 0.1
#: Packages whose version may change the last digits of labels.
_PACKAGES = ("gso", "numpy", "scipy", "casadi", "libigl", "h5py", "cvxopt", "pypardiso")


@dataclass(frozen=True)
class Recipe:
    """Definition of a dataset.

    Attributes
    ----------
    n : int
        Number of surfaces in the train, validation and test splits together, 10 or more.
    seed : int
        Seed of all random numbers.
    size : int
        Samples along each side of a surface, 16 or more.
    labels : tuple of str
        Labels of every surface: "developable", "strain", "lengths".
    extras : bool
        Whether to add the small named splits of :mod:`gso.dataset.shapes`.
    strata : {"curvature", "features"}
        Features whose intervals get fixed shares of the set: "curvature", K_A and sigma^2;
        "features", K_P, K_N, K_A and sigma^2, as in the paper. See :mod:`gso.dataset.screen`.
    surfaces : {"bezier", "broad"}
        "bezier": the published surfaces. "broad": those of :mod:`gso.dataset.broad`, whose
        families differ between the splits. These are not stratified, and `extras` adds nothing.

    Raises
    ------
    OptionError
        A value is out of range, or a label is unknown or repeated.
    """

    n: int = PUBLISHED
    seed: int = 0
    size: int = 64
    labels: tuple[str, ...] = LABELS
    extras: bool = True
    strata: str = STRATA[0]
    surfaces: str = SURFACES[0]

    def __post_init__(self) -> None:
        for name, least in (("n", 10), ("seed", 0), ("size", 16)):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < least:
                raise OptionError(f"{name} is {value!r}; it must be an integer, {least} or more")
        if self.strata not in STRATA:
            raise OptionError(f"strata is {self.strata!r}; {choices(self.strata, STRATA)}")
        if self.surfaces not in SURFACES:
            raise OptionError(f"surfaces is {self.surfaces!r}; {choices(self.surfaces, SURFACES)}")
        if self.broad and self.strata != STRATA[0]:
            raise OptionError(f"the broad set is not stratified; leave out strata={self.strata!r}")
        object.__setattr__(self, "labels", tuple(self.labels))
        unknown = [k for k in self.labels if k not in LABELS]
        if unknown or len(set(self.labels)) < len(self.labels):
            raise OptionError(
                f"labels are {', '.join(self.labels)}; take {', '.join(LABELS)}, each once at most"
            )

    @property
    def broad(self) -> bool:
        """Whether its surfaces are those of the broad set."""
        return self.surfaces == "broad"

    @property
    def splits(self) -> dict[str, int]:
        """Number of surfaces by split, in the proportions 8,320 : 1,040 : 1,041.

        >>> list(Recipe(extras=False).splits.items())
        [('train', 8320), ('validation', 1040), ('test', 1041), ('hard', 1040)]
        """
        validation = round(self.n * _VALIDATION / PUBLISHED)
        test = round(self.n * _TEST / PUBLISHED)
        sizes = {"train": self.n - validation - test, "validation": validation, "test": test}
        if self.broad:
            return sizes
        sizes["hard"] = round(_HARD * self.n)
        return sizes | (dict.fromkeys(shapes.NAMES, shapes.COUNT) if self.extras else {})

    def as_dict(self) -> Json:
        """Return the recipe, its version and the solver's settings, for a manifest."""
        given = asdict(self)
        # Sets that were made before there was a choice have no entry, and are the same.
        for name, known in (("strata", STRATA), ("surfaces", SURFACES)):
            if given[name] == known[0]:
                del given[name]
        return {
            "version": VERSION,
            **given,
            "labels": list(self.labels),
            "options": {name: KINDS[name].options for name in self.labels},
        }


def versions(device: str | None = None) -> dict[str, str]:
    """Return the versions that may affect the bytes; "" for a package that is not installed.

    With a device, on which surfaces are solved in batches, they include PyTorch's.
    """
    found = {"python": platform.python_version(), "machine": platform.machine()}
    for name in (*_PACKAGES, *(() if device is None else ("torch",))):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = ""
    return found

"""Settings shared by all tasks."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gso.errors import OptionError
from gso.spelling import KnownFields, choices

if TYPE_CHECKING:
    from typing_extensions import Self


@dataclass(frozen=True)
class Options(KnownFields):
    """Settings of the solver, to which every task adds its own.

    Use :func:`dataclasses.replace` to change some fields of a preset.

    Attributes
    ----------
    iterations : int
        Largest number of iterations of the last stage; tasks adapt it to the size of the grid.
    tolerance : float
        Stop when the relative decrease of the energy in one iteration is below this.
    method : {"gauss-newton", "levenberg-marquardt"}
        How the direction of a step is computed.
    backend : str or None
        Linear solver: "banded", "superlu", "cholmod", "pardiso"; None takes the fastest
        installed one for the matrix at hand.
    threads : int
        Number of BLAS threads during factorisations; 0 keeps the library's own setting, which
        is slower on a busy machine.
    """

    PRESETS: ClassVar[dict[str, dict[str, Any]]] = {}

    iterations: int = 20
    tolerance: float = 1e-4
    method: str = "gauss-newton"
    backend: str | None = None
    threads: int = 1

    def __post_init__(self) -> None:
        for f in fields(self):
            _check_number(f.name, str(f.type), getattr(self, f.name))
        if self.method not in ("gauss-newton", "levenberg-marquardt"):
            raise OptionError(
                f"no method {self.method!r}; "
                + choices(self.method, ("gauss-newton", "levenberg-marquardt"))
            )

    def in_unit(self, unit: float) -> Self:
        """Return the settings with lengths of the mesh's unit divided by another unit."""
        return self

    def for_pieces(self) -> Self:
        """Return the settings for a surface that is cut into pieces."""
        return self

    @classmethod
    def preset(cls, name: str) -> Self:
        """Return the settings of a named preset."""
        if name not in cls.PRESETS:
            raise OptionError(f"no preset {name!r}; {choices(name, cls.PRESETS)}")
        return cls(**cls.PRESETS[name])

    @classmethod
    def coerce(cls, given: str | Options | None) -> Self:
        """Return settings from a preset's name, an instance, or None for "balanced"."""
        if given is None or isinstance(given, str):
            return cls.preset(given or "balanced")
        if not isinstance(given, cls):
            raise OptionError(
                f"this task takes {cls.__module__}.{cls.__name__} or one of "
                f"{', '.join(cls.PRESETS)}, not {_type_name(type(given))}"
            )
        return given


def _type_name(kind: type) -> str:
    return kind.__name__ if kind.__module__ == "builtins" else f"{kind.__module__}.{kind.__name__}"


def _check_number(name: str, kind: str, value: object) -> None:
    """Raise unless a setting annotated as int or float is one, finite and not negative."""
    wanted = kind.split(" | ")
    if value is None and "None" in wanted:
        return
    if isinstance(value, str) and "str" in wanted:
        return
    if "int" in wanted:
        good, what = isinstance(value, int | np.integer) and value >= 0, "an integer"
    elif "float" in wanted:
        good = isinstance(value, int | float | np.number) and np.isfinite(value) and value >= 0
        what = "a finite number"
    else:
        return
    if isinstance(value, bool) or not good:
        raise OptionError(f"{name} is {value!r}; it must be {what}, 0 or more")

"""A reason against a result: code, value, bound and places; in words and as a record."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from gso import wording
from gso.typing import Json
from gso.verdict.codes import Code, Kind

#: Parts of a mesh that a reason is at, rather than about.
_ELEMENTS = ("vertex", "edge", "face")
#: Severity of the codes, the lowest first.
_ORDER = {code: k for k, code in enumerate(Code)}


@dataclass(frozen=True)
class Places:
    """Where something is: a kind of part of the result, and the numbers or names of those parts.

    Attributes
    ----------
    kind : str
        "vertex", "edge" (its ends, ``a-b``), "face", "piece", "part", "seam" or "hole".
    ids : tuple of int or str
        The worst first where they were measured; empty if it is about the whole.
    """

    kind: str = ""
    ids: tuple[int | str, ...] = ()

    def __str__(self) -> str:
        return wording.places(self.kind, self.ids) if self.ids else ""


@dataclass(frozen=True, repr=False)
class Reason:
    """Why a result is not usable as what was asked for.

    Attributes
    ----------
    code : Code
        What is wrong.
    value, bound : float or None
        The worst value, and the bound that it is beyond; None where nothing is measured.
    places : Places
        Where it is.
    owner : str
        The component, piece or design that has it, such as "component 1"; empty for the whole.
    detail : str
        Message of the error, for the codes that stand for one.

    Examples
    --------
    >>> why = Reason(Code.DEVIATION, 0.25, 0.2).within("component 1")
    >>> print(describe(why, "mm"))
    component 1: the result is 0.250 mm away from the design, more than 0.200 mm; allow more \
distance (max_deviation), or more strips or pieces
    >>> Reason.read(why.record()) == why
    True
    """

    code: Code
    value: float | None = None
    bound: float | None = None
    places: Places = Places()
    owner: str = ""
    detail: str = ""

    def __str__(self) -> str:
        return describe(self)

    def __repr__(self) -> str:
        return f"Reason({self.code.name}: {self})"

    def within(self, owner: str) -> Reason:
        """Return the reason of a component, piece or design as one of the whole."""
        return replace(self, owner=f"{owner}: {self.owner}" if self.owner else owner)

    def scaled(self, factor: float) -> Reason:
        """Return it in another unit of length; `factor` is how many of them the former one is."""
        if self.code.info.kind is not Kind.LENGTH or self.value is None or self.bound is None:
            return self
        return replace(self, value=factor * self.value, bound=factor * self.bound)

    def record(self, unit: str | None = None) -> Json:
        """Return it as JSON-compatible values, for readers with its words in a unit of length."""
        out: Json = {
            "code": self.code.value,
            "value": _finite(self.value),
            "bound": _finite(self.bound),
            "places": {"kind": self.places.kind, "ids": list(self.places.ids)},
            "owner": self.owner,
            "detail": self.detail,
        }
        return out if unit is None else out | {"text": describe(self, unit)}

    @classmethod
    def read(cls, record: Json) -> Reason:
        """Return what a record describes.

        Raises
        ------
        KeyError, ValueError
            It is no record of a reason.
        """
        where = Places(record["places"]["kind"], tuple(record["places"]["ids"]))
        code, given = Code[record["code"].upper()], (record["value"], record["bound"])
        return cls(code, *given, where, record["owner"], record["detail"])


def ordered(reasons: Iterable[Reason]) -> tuple[Reason, ...]:
    """Sort reasons by their code, the most severe first."""
    return tuple(sorted(reasons, key=lambda reason: _ORDER[reason.code]))


def crosses_itself(reasons: Iterable[Reason]) -> bool:
    """Tell whether a design passes through itself, so that no pattern of it is usable."""
    return any(reason.code is Code.CROSSES_ITSELF for reason in reasons)


def describe(reason: Reason, unit: str = "") -> str:
    """Say a reason in a sentence: what it is, with the numbers and the place, and what to do.

    Parameters
    ----------
    reason : Reason
    unit : str
        Name of its unit of length.
    """
    info, places = reason.code.info, reason.places
    value, bound = _numbers(reason, unit)
    said = info.sentence.format(value=value, bound=bound, detail=reason.detail)
    if places.ids:
        said += f" at {places}" if places.kind in _ELEMENTS else f": {places}"
    if not reason.detail:
        said += f"; {info.remedy}"
    return f"{reason.owner}: {said}" if reason.owner else said


def _numbers(reason: Reason, unit: str) -> tuple[str, str]:
    """Format value and bound with three digits, or as many as show that they differ."""
    both = ("", "")
    for digits in range(3, 8):
        both = tuple(  # type: ignore[assignment]
            "" if x is None else _number(x, reason.code.info.kind, unit, digits)
            for x in (reason.value, reason.bound)
        )
        if both[0] != both[1]:
            break
    return both


def _number(value: float, kind: Kind, unit: str, digits: int) -> str:
    if kind is Kind.LENGTH:
        return wording.length(value, unit, digits)
    if kind is Kind.SHARE:
        return wording.percent(value, digits)
    if kind is Kind.ANGLE:
        return f"{value:.{digits}g} degrees"
    return f"{value:.0f}" if kind is Kind.COUNT else f"{value:.{digits}g}"


def _finite(value: float | None) -> float | None:
    return value if value is not None and np.isfinite(value) else None

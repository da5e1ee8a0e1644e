"""Limits that a result has to keep beyond those of its task."""

from __future__ import annotations

from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class Limits:
    """Limits that a result has to keep beyond those of its task.

    Attributes
    ----------
    max_deviation : float or None
        Largest allowed distance from the design, in its unit.
    max_strain : float or None
        Largest allowed principal strain of the pattern.
    target_curvature : float or None
        Mean absolute curvature to reach, 1/size^2.
    moved : float
        Largest violation of a constraint by the design, in its unit: 0 if the design satisfies
        all constraints, infinite if a violation cannot be expressed as a length.
    """

    max_deviation: float | None = None
    max_strain: float | None = None
    target_curvature: float | None = None
    moved: float = 0.0

    @property
    def given(self) -> dict[str, float]:
        """The limits that were given, by name."""
        return {k: float(v) for k, v in asdict(self).items() if k != "moved" and v is not None}

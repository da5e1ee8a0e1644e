"""How much is run."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Settings:
    """Counts and sizes of a run.

    Attributes
    ----------
    name : str
        What the run is called.
    counts : dict of str to int
        Most surfaces of a method by its pace.
    timed : int
        Surfaces that are timed, one after the other with nothing beside them.
    sizes : tuple of int
        Sides of the grids in the comparison of times.
    repeats : int
        Solves of each size.
    examples : tuple of float
        Mean curvature of the surfaces that are drawn: those nearest to these.
    workers : int
        Processes for what is not timed; 0 for this one only.
    """

    name: str
    counts: dict[str, int] = field(default_factory=dict)
    timed: int = 64
    sizes: tuple[int, ...] = (16, 32, 64, 128, 256, 512)
    repeats: int = 5
    examples: tuple[float, ...] = (0.1, 0.3, 0.7)
    workers: int = 2


FULL = Settings("full", {"fast": 1_000_000, "slow": 64, "peer": 16})
QUICK = Settings(
    "quick",
    {"fast": 24, "slow": 3, "peer": 1},
    timed=8,
    sizes=(32, 64),
    repeats=3,
    examples=(0.3,),
)

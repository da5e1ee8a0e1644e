"""Numbers of surfaces and sizes of grids in a run."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Settings:
    """Counts and sizes of a run.

    Attributes
    ----------
    name : str
        Name of the run.
    counts : dict of str to int
        Largest number of surfaces of a method, by its pace.
    peers : int
        Largest number of surfaces of a method that is not of this package.
    timed : int
        Number of surfaces that are timed, one after the other with no other work.
    runs : int
        Number of times that these are timed, for methods of the pace "fast".
    numpy : dict of str to int
        Largest number of those that are timed with NumPy kernels, too, by the method's pace.
    sizes : tuple of int
        Sides of the grids in the comparison of times.
    repeats : int
        Largest number of solves of each size.
    examples : tuple of float
        Mean curvatures; the figures show the surfaces nearest to these.
    workers : int
        Worker processes for what is not timed; 0 for this process only.
    apart : bool
        Whether each method is timed at each size in a process of its own. Otherwise its peak memory
        is that of this process.
    """

    name: str
    counts: dict[str, int] = field(default_factory=dict)
    peers: int = 256
    timed: int = 64
    runs: int = 3
    numpy: dict[str, int] = field(default_factory=dict)
    sizes: tuple[int, ...] = (16, 32, 64, 128, 256, 512)
    repeats: int = 5
    examples: tuple[float, ...] = (0.1, 0.3, 0.7)
    workers: int = 2
    apart: bool = True


FULL = Settings(
    "full", {"fast": 640, "slow": 64, "peer": 16}, numpy={"fast": 64, "slow": 16, "peer": 8}
)
QUICK = Settings(
    "quick",
    {"fast": 24, "slow": 3, "peer": 1},
    timed=8,
    numpy={"fast": 8, "slow": 2, "peer": 1},
    sizes=(32, 64),
    repeats=3,
    examples=(0.3,),
)

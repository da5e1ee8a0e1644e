"""Packing of the parts' bounding rectangles on sheets: the bottom-left rule on a skyline."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

#: Orders in which rectangles are placed.
ORDERS: dict[str, Callable[[float, float], float]] = {
    "area": lambda wide, high: -wide * high,
    "long side": lambda wide, high: -max(wide, high),
    "height": lambda wide, high: -high,
}
#: Relative tolerance of the room that is left.
_ROUND = 1e-9


@dataclass(frozen=True)
class Placed:
    """A rectangle in its place.

    Attributes
    ----------
    item : int
        Number of the rectangle.
    choice : int
        Which of its sizes was taken.
    sheet : int
    x, y : float
        Its lower left corner.
    """

    item: int
    choice: int
    sheet: int
    x: float
    y: float


@dataclass
class _Sheet:
    """The lower left part of a sheet that is taken: steps (x, y, length) from left to right."""

    long: float
    wide: float
    steps: list[tuple[float, float, float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.steps = [(0.0, 0.0, self.wide)]

    def room(self, across: float, along: float) -> tuple[float, float] | None:
        """Return the place with the least extent along the sheet: along, across; None if none."""
        best: tuple[float, float] | None = None
        for k, (start, _, _) in enumerate(self.steps):
            if start + across > self.wide * (1.0 + _ROUND):
                break
            level, left, j = 0.0, across, k
            while left > _ROUND * self.wide and j < len(self.steps):
                level = max(level, self.steps[j][1])
                left -= self.steps[j][2]
                j += 1
            fits = level + along <= self.long * (1.0 + _ROUND)
            if fits and (best is None or level < best[0]):
                best = (level, start)
        return best

    def take(self, level: float, start: float, across: float, along: float) -> None:
        """Take a rectangle out of the room that is left."""
        out: list[tuple[float, float, float]] = []
        end = start + across
        for x, y, size in self.steps:
            stop = x + size
            if x < start:
                out.append((x, y, min(stop, start) - x))
            if stop > end:
                out.append((max(x, end), y, stop - max(x, end)))
        out.append((start, level + along, across))
        self.steps = sorted(s for s in out if s[2] > _ROUND * self.wide)


def packed(
    sizes: Sequence[Sequence[tuple[float, float]]], sheet: tuple[float, float], order: str
) -> list[Placed]:
    """Pack rectangles on as few sheets as they take in one order.

    Parameters
    ----------
    sizes : sequence of sequence of (float, float)
        Length along the sheet and width across it of each rectangle, for each allowed rotation.
    sheet : (float, float)
        Length and width of the sheets.
    order : str
        One of :data:`ORDERS`.

    Examples
    --------
    >>> [(p.sheet, p.x, p.y) for p in packed([[(2, 1)], [(2, 1)], [(2, 2)]], (4, 2), "area")]
    [(0, 2.0, 0.0), (0, 2.0, 1.0), (0, 0.0, 0.0)]
    """
    sheets: list[_Sheet] = []
    out = []
    rank = ORDERS[order]
    for item in sorted(range(len(sizes)), key=lambda k: rank(*sizes[k][0])):
        best: tuple[float, float, int, float] | None = None
        for number in range(len(sheets) + 1):
            if number == len(sheets):
                sheets.append(_Sheet(*sheet))
            for choice, (along, across) in enumerate(sizes[item]):
                found = sheets[number].room(across, along)
                if found is not None and (best is None or found[0] + along < best[3]):
                    best = (*found, choice, found[0] + along)
            if best is not None:
                break
        if best is None:
            raise ValueError(f"rectangle {item} is larger than a sheet")
        level, start, choice, _ = best
        along, across = sizes[item][choice]
        sheets[number].take(level, start, across, along)
        out.append(Placed(item, choice, number, level, start))
    return sorted(out, key=lambda p: p.item)

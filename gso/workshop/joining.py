"""The order in which panels are joined: a simple heuristic for the assembly sheet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gso import metrics
from gso.typing import Array
from gso.workshop.assembly_view import Picture, Stage, sides
from gso.workshop.panels import Made

#: Largest number of pictures of a design, and the larger side of each, in pixels.
PICTURES, _SIZE = 60, 300
#: Colours of what is joined already, and of what is joined now.
_OLD, _NEW = (0.86, 0.86, 0.84), (0.98, 0.68, 0.32)
#: How many times as much must be seen from behind for a picture from there.
_BEHIND = 1.5


@dataclass(frozen=True, eq=False)
class Step:
    """A panel that is joined to those before it.

    Attributes
    ----------
    panel : int
    seams : tuple of int
        Numbers of the seams that join it; none for the first panel, and for those that have no
        seam with earlier ones.
    closed : tuple of int
        Numbers of the seams between two edges of the panel itself.
    """

    panel: int
    seams: tuple[int, ...]
    closed: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class StepPicture:
    """A picture of one step, or of several where there are many.

    Attributes
    ----------
    first : int
        Number of the first step, from 1 on.
    steps : tuple of Step
    picture : Picture
        What is joined up to the last of them; their panels are coloured.
    is_behind : bool
        Whether it is seen from behind.
    """

    first: int
    steps: tuple[Step, ...]
    picture: Picture
    is_behind: bool = False

    def title(self) -> str:
        """Say which steps it shows."""
        last = self.first + len(self.steps) - 1
        said = f"step {last}" if last == self.first else f"steps {self.first} to {last}"
        return said + (", from behind" if self.is_behind else "")


def in_words(step: Step, made: Made) -> str:
    """Say which panel a step joins, to which others, and along which seams."""
    said = made.panels[step.panel].name
    if step.closed:
        said += f", closed along {_seams(step.closed)}"
    of_other: dict[str, list[int]] = {}
    for seam, other in made.mates(step.panel):
        if seam.number in step.seams:
            of_other.setdefault(made.panels[other].name, []).append(seam.number)
    joined = (f"to {name} along {_seams(numbers)}" for name, numbers in of_other.items())
    return said + (", joined " + ", ".join(joined) if of_other else "")


def order_of_joining(made: Made) -> list[Step]:
    """Order the panels of a design: the largest first, then neighbours.

    The next one is always that which has the longest seams with those that are joined; the larger
    one of equals. Where none has any, it is the largest of the rest.

    Examples
    --------
    >>> import gso
    >>> from gso.workshop.pattern_panels import of_net
    >>> points = [[x, y, z] for z in (0.0, 3.0) for y in (0.0, 2.0) for x in (0.0, 1.0)]
    >>> sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    >>> made = of_net("box", gso.unfold(gso.Mesh(points, sides)))
    >>> [(step.panel, len(step.closed)) for step in order_of_joining(made)]
    [(0, 7)]
    """
    count = len(made.panels)
    areas = _rounded(np.array([metrics.area(panel.surface) for panel in made.panels]))
    shared = np.zeros((count, count))
    numbers: dict[tuple[int, int], list[int]] = {}
    for seam in made.matings:
        a, b = seam.one.panel, seam.two.panel
        numbers.setdefault((min(a, b), max(a, b)), []).append(seam.number)
        if a != b:
            shared[a, b] += seam.length
            shared[b, a] += seam.length
    left = np.ones(count, bool)
    length = np.zeros(count)
    steps: list[Step] = []
    joined: list[int] = []
    while left.any():
        rest = np.flatnonzero(left)
        # Equal lengths and areas of symmetric designs differ by rounding errors.
        panel = int(rest[np.lexsort((rest, -areas[rest], -_rounded(length)[rest]))[0]])
        own = [n for k in joined for n in numbers.get((min(k, panel), max(k, panel)), ())]
        steps.append(
            Step(panel, tuple(sorted(own)), tuple(sorted(numbers.get((panel, panel), ()))))
        )
        joined.append(panel)
        left[panel] = False
        length += shared[panel]
    return steps


def step_pictures(made: Made, steps: Sequence[Step], most: int = PICTURES) -> list[StepPicture]:
    """Draw the steps of a design, each from the side from which more of what is new is seen.

    Parameters
    ----------
    made : Made
    steps : sequence of Step
        Of :func:`order_of_joining`.
    most : int
        Largest number of pictures: where there are more steps, each shows several.
    """
    each = -(-len(steps) // most)
    stages = [Stage(made, view, _SIZE) for view in sides(made.panels)]
    seams = {seam.number: seam for seam in made.matings}
    out = []
    for first in range(0, len(steps), each):
        own = tuple(steps[first : first + each])
        new = [step.panel for step in own]
        seen = []
        for stage in stages:
            stage.add(new)
            seen.append(int(np.isin(stage.owner, new).sum()))
        is_behind = seen[1] > _BEHIND * seen[0]
        colours = np.full((len(made.panels), 3), _OLD)
        colours[new] = _NEW
        joined = [seams[n] for step in own for n in step.seams]
        drawn = stages[int(is_behind)].picture(colours, new=new, seams=joined)
        out.append(StepPicture(first + 1, own, drawn, is_behind))
    return out


def _rounded(values: Array) -> Array:
    return np.asarray((values / max(float(values.max(initial=0.0)), 1e-300)).round(9))


def _seams(numbers: Sequence[int]) -> str:
    said = ", ".join(map(str, numbers))
    return f"seam {said}" if len(numbers) == 1 else f"seams {said}"

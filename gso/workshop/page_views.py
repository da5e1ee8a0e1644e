"""Where parts are: their mates, their places in their designs, and the order of joining."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from html import escape

import numpy as np

from gso.mesh.view import pale_colours
from gso.typing import Array, Json
from gso.workshop.assembly_view import Picture, Places, here
from gso.workshop.joining import StepPicture, in_words, step_pictures
from gso.workshop.page_data import Shown
from gso.workshop.page_text import drawn_as

#: Number of designs that are pictured.
_PICTURED = 12
_SIDES = ("from the front; thin lines are bends", "from behind")


class Views:
    """Pictures and seams of the panels that parts are drawn of.

    Parameters
    ----------
    shown : sequence of Shown
    certificate : dict
        Whose records say which panels are the same part.
    """

    def __init__(self, shown: Sequence[Shown], certificate: Json):
        self.shown = shown
        same = drawn_as(certificate)
        self._at: dict[str, list[tuple[int, int]]] = {}
        for design, one in enumerate(shown):
            for k, panel in enumerate(one.made.panels):
                self._at.setdefault(same.get(panel.name, panel.name), []).append((design, k))

    @cached_property
    def places(self) -> list[Places]:
        """Pictures of the first designs."""
        last = np.cumsum([len(one.panels) for one in self.shown])
        colours = np.split(pale_colours(int(last[-1]) if len(last) else 0), last[:-1])
        every = zip(self.shown[:_PICTURED], colours, strict=False)
        return [Places(one.made, own) for one, own in every]

    @cached_property
    def steps(self) -> list[list[StepPicture]]:
        """Pictures of the order of joining; none of designs of one panel."""
        return [
            step_pictures(one.made, one.steps) if len(one.steps) > 1 else []
            for one in self.shown[:_PICTURED]
        ]

    def mates(self, part: str) -> tuple[list[int], list[str]]:
        """Return the numbers of a part's seams, and the names of the panels it is joined to."""
        seams: set[int] = set()
        others: list[str] = []
        for design, panel in self._at[part]:
            made = self.shown[design].made
            for seam, other in made.mates(panel):
                seams.add(seam.number)
                if other != panel:
                    others.append(made.panels[other].name)
        return sorted(seams), list(dict.fromkeys(others))

    def place(self, part: str) -> tuple[Picture, str, list[Array]] | None:
        """Return the picture of a part's place, its identifier, and outlines of its panels.

        None if its design is not pictured.
        """
        design, first = self._at[part][0]
        if design >= len(self.places):
            return None
        places = self.places[design]
        side = places.side(first)
        own = [k for number, k in self._at[part] if number == design]
        loops = [loop for k in own for loop in places.shadow(side, k)]
        return places.pictures[side], f"view-{design}-{side}", loops

    def step_texts(self) -> list[tuple[str, Picture, list[str]]]:
        """Return title, picture and lines of text of every step of every design."""
        return [
            (
                f"{one.made.name}: {shot.title()}",
                shot.picture,
                [in_words(step, one.made) for step in shot.steps],
            )
            for one, own in zip(self.shown, self.steps, strict=False)
            for shot in own
        ]


def place_picture(views: Views, part: str) -> str:
    """Return the picture of a part's place as SVG; empty if its design is not pictured."""
    found = views.place(part)
    return "" if found is None else here(*found)


def whole_pictures(views: Views, address: Callable[[str], str]) -> list[str]:
    """Return the pictures of designs from both sides, with the names of their parts."""
    lines = []
    for design, places in enumerate(views.places):
        made = views.shown[design].made
        name = escape(made.name)
        said = ": the parts in their places" if made.panels[0].has_pattern else ""
        lines.append(f'<h3>{name}{said}</h3><div class="pictures">')
        for side, picture in enumerate(places.pictures):
            drawn = picture.svg(address, f"view-{design}-{side}")
            lines.append(f"<figure>{drawn}<figcaption>{_SIDES[side]}</figcaption></figure>")
        lines.append("</div>")
    return lines


def assembly_sheet(views: Views, address: Callable[[str], str]) -> list[str]:
    """Return the pictures of the order in which the parts of each design are joined."""
    lines = []
    for design, (one, own) in enumerate(zip(views.shown, views.steps, strict=False)):
        if not own:
            continue
        # The last picture of each side.
        last: dict[bool, tuple[str, Picture]] = {}
        lines.append(f'<h3>{escape(one.made.name)}: order of joining</h3><ol class="steps">')
        for shot in own:
            said = "".join(
                f'<li value="{shot.first + k}">{escape(in_words(step, one.made))}</li>'
                for k, step in enumerate(shot.steps)
            )
            side = "<p>from behind</p>" if shot.is_behind else ""
            name = f"step-{design}-{shot.first}"
            drawn = shot.picture.svg(address, name, last.get(shot.is_behind))
            last[shot.is_behind] = name, shot.picture
            lines.append(f"<li>{drawn}{side}<ol>{said}</ol></li>")
        lines.append("</ol>")
    return lines

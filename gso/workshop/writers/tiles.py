"""Division of a drawing into pages of paper that overlap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.errors import OptionError
from gso.geometry.flat_region import region
from gso.typing import Array
from gso.workshop.part import Drawing

#: Height of the strip below the window that has the title and the scale bar, in millimetres.
FOOT = 12.0


@dataclass(frozen=True, eq=False)
class Tile:
    """What one page shows.

    Attributes
    ----------
    name : str
        Row and column, such as B3: A1 is the upper left one.
    low, high : ndarray, (2,)
        Corners of its window in the drawing, in millimetres, with the overlap.
    """

    name: str
    low: Array
    high: Array


@dataclass(frozen=True, eq=False)
class Tiling:
    """Pages of a drawing.

    Attributes
    ----------
    tiles : tuple of Tile
        Those with something on them, row by row.
    page : (float, float)
        Width and height of the paper, in millimetres.
    rows, columns : int
        Of the whole division.
    """

    tiles: tuple[Tile, ...]
    page: tuple[float, float]
    rows: int
    columns: int


def tiled(drawing: Drawing, paper: tuple[float, float], overlap: float, margin: float) -> Tiling:
    """Divide a drawing into pages, upright or across, whichever takes fewer of them.

    Parameters
    ----------
    drawing : Drawing
    paper : (float, float)
        Width and height of the paper.
    overlap, margin : float
        By how much neighbouring windows overlap, and what is left free around each.

    Raises
    ------
    OptionError
        The margin and the overlap leave no room.
    """
    low, high = drawing.bounds
    choices = []
    for page in (paper, paper[::-1]):
        window = np.array([page[0] - 2 * margin, page[1] - 2 * margin - FOOT])
        step = window - overlap
        if step.min() <= 10.0:
            raise OptionError(
                f"a margin of {margin:g} and an overlap of {overlap:g} mm leave no room on paper "
                f"of {page[0]:g} by {page[1]:g} mm; lower them"
            )
        count = np.maximum(np.ceil((high - low - overlap - 1e-9) / step), 1).astype(int)
        choices.append((int(count.prod()), page, window, step, count))
    _, page, window, step, (columns, rows) = min(choices, key=lambda c: c[0])
    # The drawing stands in the middle of the pages.
    spare = step * (columns, rows) + overlap - (high - low)
    corner = np.array([low[0] - 0.5 * spare[0], high[1] + 0.5 * spare[1]])
    tiles = []
    for row in range(rows):
        for column in range(columns):
            left, top = corner + step * [column, -row]
            low_ = np.array([left, top - window[1]])
            one = Tile(_name(row, column), low_, low_ + window)
            if _shows(drawing, one):
                tiles.append(one)
    return Tiling(tuple(tiles), page, int(rows), int(columns))


def _name(row: int, column: int) -> str:
    """Return letters for the row and a number for the column.

    >>> _name(0, 0), _name(27, 2)
    ('A1', 'AB3')
    """
    letters, k = "", row + 1
    while k:
        k, digit = divmod(k - 1, 26)
        letters = chr(65 + digit) + letters
    return f"{letters}{column + 1}"


def _shows(drawing: Drawing, tile: Tile) -> bool:
    """Tell whether a part, with its inside, is in a window."""
    import shapely

    window = shapely.box(*tile.low, *tile.high)
    return any(region(part.outline).intersects(window) for part in drawing.parts)

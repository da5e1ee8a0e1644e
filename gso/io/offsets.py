"""Tables of offsets: lines of a boat or another hull in space, as CSV."""

from __future__ import annotations

import csv
import math

import numpy as np

from gso.errors import MeshError
from gso.io.source import read_bytes
from gso.typing import AnyPath, Array

#: Columns of the table with a row for each point.
_POINTS = ("line", "x", "y", "z")


def read_offsets(path: AnyPath) -> dict[str, Array]:
    r"""Read the lines of a table of offsets.

    The table has a heading. Either it has the columns ``line, x, y, z`` and a row for each point,
    in the order along the line. Or it has a row for each station: the first column is its ``x``,
    and two more for each line are its half-breadth and its height, ``NAME y`` and ``NAME z``; cells
    are empty where a line does not reach the station. Fields are divided by commas, semicolons or
    tabs. Empty rows and rows that begin with # are left out.

    Parameters
    ----------
    path : path

    Returns
    -------
    dict of str to ndarray, (n, 3)
        Points of each line, in the order of the table.

    Raises
    ------
    MeshError
        The file cannot be read, its heading is another one, or a cell is no finite number; the
        message names the row.

    Examples
    --------
    >>> import os, tempfile
    >>> path = os.path.join(tempfile.mkdtemp(), "hull.csv")
    >>> with open(path, "w") as file:
    ...     _ = file.write("x, keel y, keel z, sheer y, sheer z\n0, 0, 0, 1, 2\n3, 0, 1, 2, 2\n")
    >>> {name: line.tolist() for name, line in read_offsets(path).items()}
    {'keel': [[0.0, 0.0, 0.0], [3.0, 0.0, 1.0]], 'sheer': [[0.0, 1.0, 2.0], [3.0, 2.0, 2.0]]}
    """
    try:
        text = read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise MeshError(f"{path} is no text; save the table as CSV in UTF-8") from None
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip()]
    lines = [(k, line) for k, line in lines if not line.lstrip().startswith("#")]
    if not lines:
        raise MeshError(f"{path} is empty; it must be a table of offsets")
    divider = max(",;\t", key=lines[0][1].count)
    rows = list(csv.reader((line for _, line in lines), delimiter=divider))
    rows = [[cell.strip() for cell in row] for row in rows]
    head, numbers = rows[0], [k for k, _ in lines[1:]]
    if tuple(word.lower() for word in head) == _POINTS:
        return _by_point(path, rows[1:], numbers)
    return _by_station(path, head, rows[1:], numbers)


def _by_point(path: AnyPath, rows: list[list[str]], numbers: list[int]) -> dict[str, Array]:
    found: dict[str, list[list[float]]] = {}
    for row, number in zip(rows, numbers, strict=True):
        if len(row) != len(_POINTS):
            raise MeshError(f"{path}, row {number} has {len(row)} cells; it must have 4")
        point = [_number(path, cell, number) for cell in row[1:]]
        found.setdefault(row[0], []).append(point)
    return {name: np.array(points) for name, points in found.items()}


def _by_station(
    path: AnyPath, head: list[str], rows: list[list[str]], numbers: list[int]
) -> dict[str, Array]:
    names: list[str] = []
    for k in range(1, len(head) - 1, 2):
        (one, y), (other, z) = (head[j].rpartition(" ")[::2] for j in (k, k + 1))
        if (y.lower(), z.lower()) != ("y", "z") or one != other or not one:
            names = []
            break
        names.append(one)
    if not names or len(head) % 2 == 0 or head[0].lower() not in ("x", "station"):
        raise MeshError(
            f"{path} has the columns {', '.join(head)}; give line, x, y, z, or x and then NAME y "
            "and NAME z for each line"
        )
    found: dict[str, list[list[float]]] = {name: [] for name in names}
    for row, number in zip(rows, numbers, strict=True):
        row = [*row, *[""] * (len(head) - len(row))]
        if len(row) > len(head):
            raise MeshError(f"{path}, row {number} has {len(row)} cells, more than the heading")
        x = _number(path, row[0], number)
        for k, name in enumerate(names):
            cells = row[2 * k + 1 : 2 * k + 3]
            if any(cells):
                found[name].append([x, *(_number(path, cell, number) for cell in cells)])
    return {name: np.array(points).reshape(-1, 3) for name, points in found.items()}


def _number(path: AnyPath, cell: str, row: int) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise MeshError(f"{path}, row {row}: {cell!r} is no number")
    return value

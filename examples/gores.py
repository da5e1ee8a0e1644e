"""A hemisphere of triangles whose groups are gores, in millimetres.

``gso fabricate examples/out/gores.obj --keep-groups -o job`` cuts it between the gores.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _write import Faces, Points, parser, write_obj

RADIUS = 500.0
#: Columns of faces of a gore, and rows.
COLUMNS, ROWS = 4, 16


def hemisphere(count: int = 12, radius: float = RADIUS) -> tuple[Points, Faces, Faces]:
    """Return vertices (n, 3), triangles (m, 3) and the gore (m,) of each triangle."""
    around = count * COLUMNS
    a = 2.0 * np.pi * np.arange(around) / around
    b = np.linspace(0.0, 0.5 * np.pi, ROWS + 1)[1:]
    a, b = np.meshgrid(a, b, indexing="ij")
    ring = np.stack([np.sin(b) * np.cos(a), np.sin(b) * np.sin(a), np.cos(b)], axis=-1)
    i = np.arange(around * ROWS).reshape(around, ROWS)
    j = np.roll(i, -1, axis=0)
    top = np.full((around, 1), around * ROWS)
    faces = np.concatenate(
        [
            np.stack([top, i[:, :1], j[:, :1]], axis=-1),
            np.stack([i[:, :-1], i[:, 1:], j[:, 1:]], axis=-1),
            np.stack([i[:, :-1], j[:, 1:], j[:, :-1]], axis=-1),
        ],
        axis=1,
    )
    gore = np.repeat(np.arange(count), COLUMNS * faces.shape[1])
    points = np.concatenate([ring.reshape(-1, 3), [[0.0, 0.0, 1.0]]])
    return radius * points, faces.reshape(-1, 3), gore


def write(path: Path, count: int = 12, radius: float = RADIUS) -> None:
    """Write the hemisphere as OBJ, each gore a group."""
    points, faces, gore = hemisphere(count, radius)
    title = f"hemisphere of {count} gores, millimetres"
    write_obj(path, points, faces, title, [f"gore{k + 1}" for k in gore])


def main() -> None:
    """Write the hemisphere."""
    command = parser(__doc__, "gores.obj")
    command.add_argument("-n", type=int, default=12, help="number of gores (default 12)")
    args = command.parse_args()
    write(args.out, args.n)


if __name__ == "__main__":
    main()

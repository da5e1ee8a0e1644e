"""A row of 200 facade panels on a doubly curved wall, in millimetres.

The wall is a formula of our own: a cylinder whose radius swells with the height and waves along it.
Panels are 1.2 m wide and 1.5 m high with joints of 20 mm; each is a grid of its own. The outside
faces the street, -y.
"""

from __future__ import annotations

import numpy as np
from _write import Points, grid_faces, parser, write_obj

COLUMNS, ROWS = 50, 4
WIDTH, HEIGHT, JOINT = 1200.0, 1500.0, 20.0


def wall(s: Points, z: Points) -> Points:
    """Return points (..., 3) of the wall at lengths along it and heights."""
    turn = s / 40_000.0
    out = 600.0 * np.sin(z / 2500.0) + 350.0 * np.sin(s / 4500.0) * np.cos(z / 4000.0)
    radius = 40_000.0 + out
    return np.stack([radius * np.sin(turn), -radius * np.cos(turn) + 40_000.0, z], axis=-1)


def panels(n: int = 13) -> Points:
    """Return the panels, (200, n, n, 3), row by row."""
    t = np.linspace(0.0, 1.0, n)
    out = []
    for row in range(ROWS):
        for column in range(COLUMNS):
            s = column * (WIDTH + JOINT) + WIDTH * t
            z = row * (HEIGHT + JOINT) + HEIGHT * t
            out.append(wall(*np.meshgrid(s, z, indexing="ij")))
    return np.array(out)


def main() -> None:
    """Write all panels as one OBJ of 200 components."""
    command = parser(__doc__, "facade.obj")
    command.add_argument("-n", type=int, default=13, help="samples per side (default 13)")
    args = command.parse_args()
    grids = panels(args.n)
    faces = grid_faces(args.n, args.n)
    every = np.concatenate([faces + k * args.n**2 for k in range(len(grids))])
    write_obj(args.out, grids.reshape(-1, 3), every, "200 facade panels, millimetres")


if __name__ == "__main__":
    main()

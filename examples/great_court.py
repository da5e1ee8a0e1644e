"""The roof of the Great Court of the British Museum, from its published formula.

Source: Chris J. K. Williams, "The analytic and numerical definition of the geometry of
the British Museum Great Court Roof", in Mathematics & Design 2001, Deakin University,
pp. 434-440. The height over the plan is the sum of a change of level, a function with
finite curvature at the corners and one with a conical corner.

The plan is the rectangle -b <= x <= b, -d <= y <= c without the circle of radius a about
the origin, which is the Reading Room. Units are metres, z is up and +y is north.
"""

from __future__ import annotations

import numpy as np
from _write import Faces, Points, grid_faces, parser, write_grid, write_obj
from numpy.typing import ArrayLike

A = 22.245
B = 36.625
C = 46.025
D = 51.125
HEIGHT_CENTRE = 20.955
HEIGHT_EDGE = 19.71
LAMBDA = 0.5
MU = 14.0

# Corners of the rectangle at the two ends of each side, anticlockwise from above.
SIDES = {
    "east": ((B, -D), (B, C)),
    "north": ((B, C), (-B, C)),
    "west": ((-B, C), (-B, -D)),
    "south": ((-B, -D), (B, -D)),
}


def height(x: ArrayLike, y: ArrayLike) -> Points:
    """Height of the roof over plan points, z1 + z2 + z3 of Williams (2001).

    Parameters
    ----------
    x, y : array_like
        Plan coordinates in metres, between the circle and the rectangle; they broadcast.

    Examples
    --------
    >>> height([A, B], 0.0).round(3)
    array([20.955, 19.71 ])
    """
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    r = np.hypot(x, y)
    return _level_change(x, y, r) + _smooth_corners(x, y, r) + _conical_corners(x, y, r)


def _psi(x: Points, y: Points) -> Points:
    return (1 - x / B) * (1 + x / B) * (1 - y / C) * (1 + y / D)


def _level_change(x: Points, y: Points, r: Points) -> Points:
    eta = _psi(x, y) / _psi(A * x / r, A * y / r)
    return (HEIGHT_CENTRE - HEIGHT_EDGE) * eta + HEIGHT_EDGE


def _smooth_corners(x: Points, y: Points, r: Points) -> Points:
    psi = _psi(x, y)
    alpha = (r / A - 1) * psi
    sin = y / r
    east_west = 1 - sin**2
    # These two are 1 due north, due south, and 0 on the other three axes.
    north = (sin**2 + sin) / 2
    south = (sin**2 - sin) / 2
    first = (35 + 10 * psi) * east_west + 24 * north + (15 + 24 * psi) * south - 1.6
    second = 10 * north**2 * (1 - 3 * alpha) + 2.5 * south**2 * (r / A - 1) ** 2
    return alpha * ((1 - LAMBDA) * first - 10 * east_west + second)


def _conical_corners(x: Points, y: Points, r: Points) -> Points:
    e, w, n, s = B - x, B + x, C - y, D + y
    # The paper divides 1 - a/r by four terms of the form hypot(e, n) / (e n). Both sides
    # are multiplied by e w n s here, so that the edge needs no division by zero; in the
    # corners, where 0/0 is left, the limit is 0.
    below = (
        np.hypot(e, n) * w * s
        + np.hypot(e, s) * w * n
        + np.hypot(w, n) * e * s
        + np.hypot(w, s) * e * n
    )
    beta = (1 - A / r) * e * w * n * s / np.where(below == 0, 1.0, below)
    sin = y / r
    first = 3.5 * (1 - sin**2) + 3.0 * sin**2 + 0.3 * sin
    corner = (np.exp(-MU * e / B) + np.exp(-MU * w / B)) * (
        np.exp(-MU * n / C) + np.exp(-MU * s / D)
    )
    return beta * (LAMBDA * first + 1.05 * corner)


def quarter(side: str = "south", shape: tuple[int, int] = (33, 65)) -> Points:
    """Sample the roof between the circle and one side of the rectangle as a grid.

    The two ends of the grid run towards the corners of the rectangle. Grid points are
    equally spaced in angle on the circle and in length on the side.

    Parameters
    ----------
    side : {"south", "east", "north", "west"}
    shape : (H, W)
        Samples from the circle to the side, and along the side.

    Returns
    -------
    ndarray, (H, W, 3)
        Row 0 is on the circle, columns run anticlockwise: d/di x d/dj points up.
    """
    if side not in SIDES:
        raise ValueError(f"side {side!r} is not one of {', '.join(SIDES)}")
    start, end = np.array(SIDES[side])
    t = np.linspace(0.0, 1.0, shape[1])
    # This form of the blend keeps the constant coordinate of a side free of rounding.
    outer = start + t[:, None] * (end - start)
    first = np.arctan2(start[1], start[0])
    turn = (np.arctan2(end[1], end[0]) - first) % (2 * np.pi)
    inner = A * np.stack([np.cos(first + t * turn), np.sin(first + t * turn)], axis=-1)
    across = np.linspace(0.0, 1.0, shape[0])[:, None, None]
    plan = (1 - across) * inner + across * outer
    return np.concatenate([plan, height(plan[..., 0], plan[..., 1])[..., None]], axis=-1)


def roof(across: int = 16, short: int = 24, long: int = 32) -> tuple[Points, Faces]:
    """Mesh the whole roof with quads: a ring, all of whose inner vertices have valence 4.

    Parameters
    ----------
    across : int
        Quads from the circle to the rectangle.
    short, long : int
        Quads along the sides of 73.25 m and of 97.15 m.

    Returns
    -------
    vertices : ndarray, (n, 3)
    faces : ndarray, (m, 4)
        Anticlockwise seen from above.
    """
    counts = {"east": long, "north": short, "west": long, "south": short}
    # The last column of a quarter is the first of the next one.
    grids = [quarter(side, (across + 1, n + 1))[:, :-1] for side, n in counts.items()]
    ring = np.concatenate(grids, axis=1)
    around = ring.shape[1]
    faces = grid_faces(across + 1, around + 1)
    row, col = np.divmod(faces, around + 1)
    return ring.reshape(-1, 3), row * around + col % around


def main() -> None:
    """Write the roof and its four quarters as OBJ quads."""
    args = parser(__doc__, "great_court").parse_args()
    title = "Great Court roof (Williams 2001), metres"
    write_obj(args.out / "roof.obj", *roof(), title)
    for side in SIDES:
        write_grid(args.out / f"{side}.obj", quarter(side), f"{title}, {side} quarter")


if __name__ == "__main__":
    main()

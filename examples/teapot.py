"""The Utah teapot: 32 bicubic Bezier patches on 306 control vertices.

Source: Martin E. Newell, "The Utilization of Procedure Models in Digital Image
Synthesis", PhD thesis, University of Utah, 1975 (modelled on a teapot by Melitta). The
four patches of the bottom and the numbering with 306 vertices are those printed by Frank
Crow, "The Origins of the Teapot", IEEE Computer Graphics and Applications 7(1), 1987.

Patches, counted from 0: rim 0-3, upper body 4-7, lower body 8-11, handle 12-15, spout
16-19, knob 20-23, lid 24-27, bottom 28-31. z is up, the spout points along +x. Units are
Newell's; the height is 3.15.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from _write import Points, parser, write_grid
from numpy.typing import ArrayLike

HERE = Path(__file__).resolve().parent
PATCH_COUNT = 32
# A quarter of the upper body: curved both ways, no pole, nearly square quads.
PANEL = 4


@cache
def control_net() -> Points:
    """Return the control points of all patches, shape (32, 4, 4, 3), rows as published."""
    vertices = np.loadtxt(HERE / "teapot_vertices.csv", delimiter=",")
    numbers = np.loadtxt(HERE / "teapot_patches.csv", delimiter=",", dtype=np.int64)
    net = vertices[numbers - 1].reshape(PATCH_COUNT, 4, 4, 3)
    net.flags.writeable = False
    return net


def point(k: int, u: ArrayLike, v: ArrayLike) -> Points:
    """Evaluate patch `k` at parameters in [0, 1].

    Parameters
    ----------
    k : int
        Patch, 0 to 31.
    u, v : array_like
        Parameters down the published rows and along the published columns; they
        broadcast against each other.

    Returns
    -------
    ndarray, (..., 3)
    """
    if not 0 <= k < PATCH_COUNT:
        raise ValueError(f"patch {k} does not exist: the teapot has patches 0 to 31")
    return np.einsum("...a,...b,abc->...c", _bernstein(u), _bernstein(v), control_net()[k])


def patch(k: int, n: int = 64) -> Points:
    """Sample patch `k` as an (n, n, 3) grid, uniform in the parameters.

    Rows are the published ones. Columns run against the published order, so that the
    normal d/di x d/dj points out of the pot. In patches 20-23 and 28-31 row 0 is a single
    point, the pole at the top of the knob or in the middle of the bottom.

    Examples
    --------
    >>> patch(20, 5)[0, :, 2]
    array([3.15, 3.15, 3.15, 3.15, 3.15])
    """
    t = np.linspace(0.0, 1.0, n)
    return point(k, t[:, None], t[::-1])


def patches(n: int = 64) -> Points:
    """Sample all patches, shape (32, n, n, 3)."""
    return np.stack([patch(k, n) for k in range(PATCH_COUNT)])


def _bernstein(t: ArrayLike) -> Points:
    t = np.asarray(t, float)
    s = 1.0 - t
    return np.stack([s**3, 3 * s**2 * t, 3 * s * t**2, t**3], axis=-1)


def main() -> None:
    """Write every patch, or the panel only, as OBJ quads."""
    command = parser(__doc__, "teapot")
    command.add_argument("-n", type=int, default=64, help="samples per side (default 64)")
    command.add_argument(
        "--panel", type=Path, metavar="FILE", help=f"write 32 x 32 quads of patch {PANEL} to FILE"
    )
    args = command.parse_args()
    title = "Utah teapot (Newell 1975), patch {} of 0-31"
    if args.panel is not None:
        write_grid(args.panel, patch(PANEL, 33), title.format(PANEL))
        return
    for k, grid in enumerate(patches(args.n)):
        write_grid(args.out / f"patch_{k:02d}.obj", grid, title.format(k))


if __name__ == "__main__":
    main()

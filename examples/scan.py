"""A noisy mesh that stands for the scan of a helmet, in millimetres.

The vertices of the helmet of ``whole.py`` are moved by normally distributed noise, which depends on
nothing but the seed.
"""

from __future__ import annotations

import numpy as np
import whole
from _write import Faces, Points, parser, write_obj

#: Standard deviation of each coordinate, in millimetres.
NOISE = 0.3


def scan(noise: float = NOISE, seed: int = 0) -> tuple[Points, Faces]:
    """Return vertices (n, 3) with noise, and triangles (m, 3)."""
    points, faces = whole.helmet()
    return points + np.random.default_rng(seed).normal(scale=noise, size=points.shape), faces


def main() -> None:
    """Write the scan."""
    command = parser(__doc__, "scan.obj")
    command.add_argument("--noise", type=float, default=NOISE, help="in millimetres (default 0.3)")
    args = command.parse_args()
    write_obj(args.out, *scan(args.noise), f"helmet with noise of {args.noise} mm")


if __name__ == "__main__":
    main()

"""A terrain grid in metres: the Jacksboro fault, Tennessee.

Source: Shuttle Radar Topography Mission, NASA and USGS, 2000, three arc seconds, public
domain; the sample file ``jacksboro_fault_dem.npz`` that Matplotlib installs (added by Joe
Kington, 2014). It is read from the installed package; nothing is downloaded.
"""

from __future__ import annotations

import numpy as np
from _write import Points, parser, write_grid
from matplotlib.cbook import get_sample_data

# WGS 84 (NIMA TR 8350.2, 2000): equatorial radius in metres, first eccentricity squared.
EQUATORIAL_RADIUS = 6378137.0
ECCENTRICITY_SQUARED = 6.69437999014e-3


def terrain(window: tuple[int, int, int, int] | None = None, step: int = 1) -> Points:
    """Sample the terrain as a grid of points in metres.

    Degrees become metres by the two radii of curvature of the WGS 84 ellipsoid at the
    middle latitude of the whole file, one factor per direction. The east-west scale is
    then right to 0.2 % everywhere, and windows of one file fit together.

    Parameters
    ----------
    window : (row0, row1, col0, col1), optional
        Half-open ranges of rows, from the north, and of columns, from the west; all of
        the 344 x 403 samples by default.
    step : int
        Keep every `step`-th row and column of the window.

    Returns
    -------
    ndarray, (H, W, 3)
        x east and y north of the file's south-west sample, z the elevation. Row 0 is the
        northern edge, so that d/di x d/dj points up.
    """
    with np.load(get_sample_data("jacksboro_fault_dem.npz", asfileobj=False)) as data:
        elevation = data["elevation"].astype(float)
        # The file calls the latitude of its first row, the northern one, ymin.
        south, north = sorted((float(data["ymin"]), float(data["ymax"])))
        dx, dy = float(data["dx"]), float(data["dy"])
    per_longitude, per_latitude = metres_per_degree((south + north) / 2)
    rows, cols = elevation.shape
    row0, row1, col0, col1 = (0, rows, 0, cols) if window is None else window
    if not (0 <= row0 < row1 <= rows and 0 <= col0 < col1 <= cols):
        raise ValueError(f"window {window} does not fit the file's {rows} x {cols} samples")
    i = np.arange(row0, row1, step)
    j = np.arange(col0, col1, step)
    x, y = np.meshgrid(j * dx * per_longitude, (rows - 1 - i) * dy * per_latitude)
    return np.stack([x, y, elevation[np.ix_(i, j)]], axis=-1)


def metres_per_degree(latitude: float) -> tuple[float, float]:
    """Length of a degree of longitude and of latitude on WGS 84, in metres.

    >>> [round(m) for m in metres_per_degree(0.0)]
    [111319, 110574]
    """
    phi = np.radians(latitude)
    w = 1.0 - ECCENTRICITY_SQUARED * np.sin(phi) ** 2
    prime_vertical = EQUATORIAL_RADIUS / np.sqrt(w)
    meridional = EQUATORIAL_RADIUS * (1.0 - ECCENTRICITY_SQUARED) / w**1.5
    return float(np.radians(prime_vertical * np.cos(phi))), float(np.radians(meridional))


def main() -> None:
    """Write the terrain as NPY and as OBJ quads."""
    command = parser(__doc__, "terrain")
    command.add_argument("--step", type=int, default=4, help="keep every n-th sample (default 4)")
    command.add_argument("--window", type=int, nargs=4, metavar=("ROW0", "ROW1", "COL0", "COL1"))
    args = command.parse_args()
    grid = terrain(None if args.window is None else tuple(args.window), args.step)
    write_grid(args.out / "terrain.obj", grid, "Jacksboro fault (SRTM 2000), metres")
    np.save(args.out / "terrain.npy", grid)


if __name__ == "__main__":
    main()

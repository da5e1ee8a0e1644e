"""Histograms of quantities over groups of surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from gso.plot.draw import require, write
from gso.typing import AnyPath, Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_BARS = 40
_WIDTH, _HEIGHT = 3.4, 2.6


def plot_histograms(
    values: Mapping[str, Mapping[str, Array]],
    limits: Mapping[str, tuple[float, float]],
    *,
    path: AnyPath | None = None,
) -> Figure:
    """Draw a histogram per quantity, with a line per group.

    Parameters
    ----------
    values : dict of dict of ndarray, (n,)
        Values by quantity and group; the shares of a group sum to one.
    limits : dict of (float, float)
        Range of each quantity. Values outside count in the first or last bar; the last bar may
        be cut off.
    path : str or PathLike, optional
        A .png, .pdf or .svg file to write.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    GSOError
        Matplotlib is not installed.
    MeshError
        The file cannot be written.

    Examples
    --------
    >>> figure = plot_histograms({"K": {"train": np.ones(3), "test": np.zeros(2)}}, {"K": (0, 1)})
    >>> [len(axes.patches) for axes in figure.axes]
    [2]
    """
    require()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDTH * len(values), _HEIGHT), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    for axes, (name, groups) in zip(
        figure.subplots(1, len(values), squeeze=False)[0], values.items(), strict=True
    ):
        low, high = limits[name]
        tallest = 0.0
        for label, numbers in groups.items():
            inside = np.clip(numbers, low, high)
            share = np.full(len(inside), 1.0 / max(len(inside), 1))
            bars, _, _ = axes.hist(
                inside, _BARS, range=(low, high), weights=share, histtype="step", label=label
            )
            tallest = max(tallest, float(np.max(bars[:-1])))
        axes.set_ylim(0.0, 1.1 * tallest or None)
        axes.set_xlabel(name)
        axes.set_yticks([])
        axes.spines[["top", "left", "right"]].set_visible(False)
    figure.axes[0].legend(frameon=False, fontsize=8)
    return write(figure, path)

"""Application of nets to surfaces in any unit of length and position."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import ArrayLike

from gso.errors import MeshError, OptionError
from gso.hierarchy import resample
from gso.net import tasks
from gso.net.catalogue import NetLike, chain
from gso.net.inference import denoising
from gso.net.models.base import SIZE, Net, device_of, exact
from gso.net.weights import cached
from gso.quantities import as_positive
from gso.typing import Array

#: Smallest side of a grid that is resampled to the size of the nets.
SMALLEST = 4
#: Number of surfaces per batch.
_BATCH = 64


def predict(
    surface: ArrayLike,
    *,
    task: str = "developable",
    model: NetLike | None = None,
    repeat: int = 1,
    passes: int | None = None,
    sigma: float | None = None,
    device: str | None = None,
) -> Array:
    """Make surfaces developable, flatten or denoise them with a net.

    Surfaces are normalised to the unit ball, and results are transformed back. The nets are
    trained on 64 x 64 vertices. Other grids are resampled to that size by cubic splines, and
    the displacements are carried back to the grid's vertices: by evaluating their spline
    there (the default nets), or by cubic interpolation. For "denoise", larger grids are
    averaged to that size and the result is interpolated, without details between its
    vertices; smaller grids are extended beyond their border.

    Parameters
    ----------
    surface : array_like, (H, W, 3) or (B, H, W, 3)
        A grid or a batch of grids of one size, from 4 x 4 up (16 x 16 for "denoise"), in any
        unit of length.
    task : {"developable", "flatten", "denoise"}
        What to do.
    model : str, path or Net, optional
        Name of a net that comes with the package (:func:`gso.net.available`), a
        .safetensors file, or a net; the task's default net by default.
    repeat : int
        How often the last net is applied, each time to its previous result, normalised anew.
        Not for "flatten".
    passes : int, optional
        Largest number of passes; all of a net's by default. The default nets correct their own
        results in a few passes, and their time is proportional to the number.
    sigma : float, optional
        "denoise": standard deviation of the noise, in the unit of the input; by default it is
        estimated for each surface (:func:`gso.smoothing.estimate_sigma`). Nets without a noise
        input ignore it.
    device : str, optional
        "cpu", "cuda" ...; by default the GPU if there is one.

    Returns
    -------
    ndarray of float64
        Surfaces (..., H, W, 3) in the unit and position of the input, or flat images
        (..., H, W, 2) for "flatten", in the unit of the input and centred at the origin.

    Raises
    ------
    MeshError
        Grids are too small, not finite, or have no extent.
    OptionError
        An option is unknown or out of range.
    WeightsError
        There is no such net, or its file is damaged.

    Examples
    --------
    >>> u, v = np.meshgrid(np.linspace(0, 2, 20), np.linspace(0, 1, 30), indexing="ij")
    >>> panel = np.stack([u, v, 0.1 * u * v], axis=-1)
    >>> from gso.net import CoarseNet
    >>> predict(panel, task="flatten", model=CoarseNet("flatten")).shape
    (20, 30, 2)
    """
    points = _checked(surface)
    batch = points[None] if points.ndim == 3 else points
    kind, where = tasks.get(task), device_of(device)
    nets = _nets(model, task, where)
    if isinstance(repeat, bool) or not isinstance(repeat, int) or not 1 <= repeat <= 100:
        raise OptionError(f"repeat is {repeat!r}; take a whole number from 1 to 100")
    if repeat > 1 and kind.flat:
        raise OptionError("a flat image cannot be flattened again; leave repeat out")
    whole = isinstance(passes, int | np.integer) and not isinstance(passes, bool)
    if passes is not None and not (whole and passes >= 1):
        raise OptionError(f"passes is {passes!r}; take a whole number from 1 up, or None for all")
    nets += [nets[-1]] * (repeat - 1)
    if sigma is not None:
        as_positive(sigma, "sigma", zero=True)
    work = _denoised if kind.noisy else _predicted
    blocks = [
        work(batch[k : k + _BATCH], nets, passes, sigma, where)
        for k in range(0, len(batch), _BATCH)
    ]
    out = np.concatenate(blocks) if blocks else np.empty((*batch.shape[:3], kind.components))
    return out[0] if points.ndim == 3 else out


def _denoised(
    batch: Array, nets: list[Net], passes: int | None, sigma: float | None, device: torch.device
) -> Array:
    """Predict for noisy grids of any size, which :mod:`gso.net.inference.denoising` converts."""
    height, width = batch.shape[1:3]
    if (height, width) == (SIZE, SIZE):
        return _predicted(batch, nets, passes, sigma, device)
    if min(height, width) < denoising.SMALLEST:
        least = denoising.SMALLEST
        raise MeshError(
            f"a grid {height} x {width} is too small for a denoising net, which needs {least} "
            "vertices along each side; use gso.tno.optimize"
        )
    grids = np.stack([denoising.seen(grid) for grid in batch])
    noise: float | Array | None = None
    if sigma is not None:
        noise = sigma * denoising.share(height, width)
    elif _told(nets[0]):
        noise = np.array([denoising.sigma(*pair) for pair in zip(batch, grids, strict=True)])
    done = _predicted(grids, nets, passes, noise, device)
    return np.stack([denoising.back(grid, height, width) for grid in done])


def _predicted(
    batch: Array,
    nets: list[Net],
    passes: int | None,
    sigma: float | Array | None,
    device: torch.device,
) -> Array:
    out: Array = batch
    for net in nets:
        unit, centre, scale = _normalised(out)
        most = net.passes if passes is None else min(int(passes), net.passes)
        noise = _sigma(net, unit, scale, sigma, device)
        coarse = torch.as_tensor(_resampled(unit), dtype=torch.float32, device=device)
        with torch.inference_mode(), exact():
            if unit.shape[1:3] == (SIZE, SIZE):
                moved = net.displacements(coarse, noise, passes=most)
            else:
                fine = torch.as_tensor(unit, dtype=torch.float32, device=device)
                moved = net.displacements_at(coarse, fine, noise, passes=most)
            start = net.initial_geometry(torch.as_tensor(unit))
        out = scale * (start.numpy() + moved.double().cpu().numpy())
        if net.kind.flat:
            return out
        out = out + centre
    return out


def _nets(model: NetLike | None, task: str, device: torch.device) -> list[Net]:
    if isinstance(model, Net):
        nets = [model.to(device)]
    else:
        nets = [cached(path, device) for path in chain(model, task)]
    for net in nets:
        if net.task != task:
            raise OptionError(f"the net is for task {net.task!r}, not {task!r}")
    return nets


def _checked(surface: ArrayLike) -> Array:
    """Return grids as an array, or raise a MeshError that says what is wrong."""
    try:
        points = np.asarray(surface, dtype=np.float64)
    except (TypeError, ValueError):
        raise MeshError("the surface must be an array of numbers (H, W, 3)") from None
    if points.ndim not in (3, 4) or points.shape[-1] != 3:
        raise MeshError(f"expected a grid (H, W, 3) or a batch (B, H, W, 3), not {points.shape}")
    height, width = points.shape[-3:-1]
    if min(height, width) < SMALLEST:
        raise MeshError(f"a grid {height} x {width} is too small for a net; use gso.tno.optimize")
    if not np.isfinite(points).all():
        *which, i, j, _ = np.argwhere(~np.isfinite(points))[0]
        of = f" of surface {which[0]}" if which else ""
        raise MeshError(f"grid vertex ({i}, {j}){of} is not finite")
    with np.errstate(over="ignore"):
        reach = np.abs(points - points[..., :1, :1, :]).max(axis=(-3, -2, -1))
    bad = ~(np.isfinite(reach) & (reach > 0))
    if bad.any():
        of = f"surface {int(bad.argmax())}: " if points.ndim == 4 else ""
        raise MeshError(f"{of}all vertices are at one point, or too far apart for numbers")
    return points


def _normalised(batch: Array) -> tuple[Array, Array, Array]:
    """Normalise grids to the unit ball; return them, centroids and radii (B, 1, 1, 3 or 1)."""
    # Relative to the first vertex, so that grids far from the origin lose no digits.
    origin = batch[:, :1, :1]
    local = batch - origin
    middle = local.mean(axis=(1, 2), keepdims=True)
    local = local - middle
    size = np.abs(local).max(axis=(1, 2, 3), keepdims=True)
    scale = size * np.sqrt(((local / size) ** 2).sum(axis=-1).max(axis=(1, 2)))[:, None, None, None]
    return local / scale, origin + middle, scale


def _resampled(unit: Array) -> Array:
    """Resample grids to the size of the nets."""
    if unit.shape[1:3] == (SIZE, SIZE):
        return unit
    return np.stack([resample(grid, SIZE, SIZE) for grid in unit])


def _told(net: Net) -> bool:
    """Tell whether the noise level is an input of a net."""
    return bool(getattr(net, "sigma", False))


def _sigma(
    net: Net, unit: Array, scale: Array, sigma: float | Array | None, device: torch.device
) -> torch.Tensor | None:
    """Return the noise (B,) of each surface in the unit ball, None if the net does not use it."""
    if not _told(net):
        return None
    if sigma is not None:
        noise = sigma / scale.ravel()
    else:
        noise = np.array([denoising.sigma(grid, grid) for grid in unit])
    return torch.as_tensor(noise, dtype=torch.float32, device=device)

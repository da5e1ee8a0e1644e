"""Application of nets to surfaces in any unit of length and position."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, cast, overload

import numpy as np
from numpy.typing import ArrayLike

from gso import io
from gso.errors import BackendError, MeshError, OptionError
from gso.hierarchy import resample
from gso.mesh import Mesh
from gso.net import tasks
from gso.net.catalogue import SIZE, NetLike, chain, exported, in_turn, missing_packages
from gso.net.inference import denoising
from gso.net.inference.applied_net import AppliedNet
from gso.net.inference.harm import harmless
from gso.net.inference.mesh_grid import predicted
from gso.quantities import as_positive
from gso.typing import AnyPath, Array, MeshLike, Polyhedron

if TYPE_CHECKING:
    from gso.net.models.base import Net

#: Smallest side of a grid that is resampled to the size of the nets.
SMALLEST = 4
#: Number of surfaces per batch.
_BATCH = 64


@overload
def predict(
    surface: Polyhedron | PathLike[str],
    *,
    task: str = ...,
    model: NetLike | None = ...,
    repeat: int = ...,
    passes: int | None = ...,
    sigma: float | None = ...,
    device: str | None = ...,
    guarded: bool = ...,
) -> Mesh: ...
@overload
def predict(
    surface: ArrayLike,
    *,
    task: str = ...,
    model: NetLike | None = ...,
    repeat: int = ...,
    passes: int | None = ...,
    sigma: float | None = ...,
    device: str | None = ...,
    guarded: bool = ...,
) -> Array: ...
def predict(
    surface: MeshLike | ArrayLike,
    *,
    task: str = "developable",
    model: NetLike | None = None,
    repeat: int = 1,
    passes: int | None = None,
    sigma: float | None = None,
    device: str | None = None,
    guarded: bool = True,
) -> Mesh | Array:
    r"""Make surfaces developable, flatten or denoise them with a net.

    Surfaces are normalised to the unit ball, and results are transformed back. The nets are
    trained on 64 x 64 vertices. Other grids are resampled to that size by cubic splines, and
    the displacements are carried back to the grid's vertices: by evaluating their spline
    there (the default nets), or by cubic interpolation. For "denoise", larger grids are
    averaged to that size and the result is interpolated, without details between its
    vertices; smaller grids are extended beyond their border.

    A mesh that is no grid, in one piece with a boundary and without handles, is resampled to
    64 x 64 vertices (:func:`gso.parametrization.as_patch`), and the displacements are
    interpolated at its vertices; not for "denoise". That is done by a harmonic map; for
    "developable" also by the flat image, where that leaves clearly less curvature.

    Parameters
    ----------
    surface : array_like, (H, W, 3) or (B, H, W, 3), or Mesh
        A grid or a batch of grids of one size, from 4 x 4 up (16 x 16 for "denoise"), in any
        unit of length. Or a mesh, or what else :func:`gso.as_mesh` takes: (vertices, faces), a
        trimesh.Trimesh, a path.
    task : {"developable", "flatten", "denoise"}
        What to do.
    model : str, path, Net or sequence, optional
        Name of a net that comes with the package (:func:`gso.net.available`), a
        .safetensors file, a .onnx file (:func:`gso.net.export`), which needs onnxruntime in
        place of PyTorch, or a net; the task's default net by default. Several in a sequence
        are applied one after the other.
    repeat : int
        How often the last net is applied, each time to its previous result, normalised anew.
        Not for "flatten".
    passes : int, optional
        Largest number of passes; all of a net's by default. The default nets correct their own
        results in a few passes, and their time is proportional to the number. An exported net
        has the number that it was exported with.
    sigma : float, optional
        "denoise": standard deviation of the noise, in the unit of the input; by default it is
        estimated for each surface (:func:`gso.smoothing.estimate_sigma`). Nets without a noise
        input ignore it.
    device : str, optional
        "cpu", "cuda" ...; by default the GPU if there is one.
    guarded : bool
        "developable": whether to halve displacements that leave more mean \|K\|, in the worse split
        of the quads, than the input has, and to return the input if that does not help. Surfaces
        that are developable, or have noise that the nets do not know, so come back as they are.

    Returns
    -------
    ndarray of float64, or Mesh
        Surfaces (..., H, W, 3) in the unit and position of the input, or flat images
        (..., H, W, 2) for "flatten", in the unit of the input and centred at the origin. For a
        mesh a mesh with the same faces; that of a flat image lies in the plane z = 0.

    Raises
    ------
    BackendError
        PyTorch is not installed, or onnxruntime for a .onnx file.
    MeshError
        Grids are too small, not finite, or have no extent; a mesh cannot be resampled.
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
    kind = tasks.get(task)
    if _is_mesh(surface):
        mesh = io.as_mesh(surface)

        def ask(grid: Array) -> Array:
            return predict(
                grid,
                task=task,
                model=model,
                repeat=repeat,
                passes=passes,
                sigma=sigma,
                device=device,
                guarded=False,
            )

        try:
            found = predicted(mesh, kind, ask, guarded)
        except MeshError as error:
            raise MeshError(
                f"the mesh cannot be resampled to a grid for a net: {error}; use gso.tno.optimize"
            ) from None
        return mesh.replaced(np.pad(found, [(0, 0), (0, 3 - found.shape[1])]))
    points = _checked(cast(ArrayLike, surface))
    batch = points[None] if points.ndim == 3 else points
    nets = _nets(model, task, device)
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
        work(batch[k : k + _BATCH], nets, passes, sigma) for k in range(0, len(batch), _BATCH)
    ]
    out = np.concatenate(blocks) if blocks else np.empty((*batch.shape[:3], kind.components))
    if guarded and kind.harm is not None:
        out = np.stack([harmless(*pair, kind.harm) for pair in zip(batch, out, strict=True)])
    return out[0] if points.ndim == 3 else out


def _is_mesh(surface: object) -> bool:
    """Tell meshes, pairs (vertices, faces) and paths from arrays."""
    if isinstance(surface, tuple | list):
        return len(surface) == 2 and all(np.ndim(part) == 2 for part in surface)
    return isinstance(surface, str | Path) or hasattr(surface, "faces")


def _denoised(
    batch: Array, nets: list[AppliedNet], passes: int | None, sigma: float | None
) -> Array:
    """Predict for noisy grids of any size, which :mod:`gso.net.inference.denoising` converts."""
    height, width = batch.shape[1:3]
    if (height, width) == (SIZE, SIZE):
        return _predicted(batch, nets, passes, sigma)
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
    elif nets[0].told:
        noise = np.array([denoising.sigma(*pair) for pair in zip(batch, grids, strict=True)])
    done = _predicted(grids, nets, passes, noise)
    return np.stack([denoising.back(grid, height, width) for grid in done])


def _predicted(
    batch: Array, nets: list[AppliedNet], passes: int | None, sigma: float | Array | None
) -> Array:
    out: Array = batch
    for net in nets:
        unit, centre, scale = _normalised(out)
        most = net.passes if passes is None else min(int(passes), net.passes)
        noise = _sigma(net, unit, scale, sigma)
        moved = net.displacements(_resampled(unit), unit, noise, most)
        out = scale * (net.start(unit) + moved)
        if tasks.get(net.task).flat:
            return out
        out = out + centre
    return out


def _nets(model: NetLike | None, task: str, device: str | None) -> list[AppliedNet]:
    """Make the nets ready that are applied one after the other."""
    several = in_turn(model)
    if not several:
        raise OptionError("model is an empty sequence; give at least one net")
    if why := missing_packages(model):
        raise BackendError(why)
    nets = [net for one in several for net in _one_or_chain(one, task, device)]
    for net in nets:
        if net.task != task:
            raise OptionError(f"the net is for task {net.task!r}, not {task!r}")
    return nets


def _one_or_chain(
    model: AnyPath | Net | None, task: str, device: str | None
) -> Sequence[AppliedNet]:
    if model is not None and not isinstance(model, str | Path):
        from gso.net.inference.torch_net import torch_net

        return [torch_net(cast("Net", model), device)]
    return [_of_file(path, device) for path in chain(model, task)]


def _of_file(path: Path, device: str | None) -> AppliedNet:
    if exported(path):
        from gso.net.inference.onnx_net import onnx_net

        return onnx_net(path, device)
    from gso.net.inference.torch_net import torch_net

    return torch_net(path, device)


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


def _sigma(net: AppliedNet, unit: Array, scale: Array, sigma: float | Array | None) -> Array | None:
    """Return the noise (B,) of each surface in the unit ball, None if the net does not use it."""
    if not net.told:
        return None
    if sigma is not None:
        return np.asarray(sigma / scale.ravel())
    return np.array([denoising.sigma(grid, grid) for grid in unit])

"""Labels of a dataset: the solver's results for each surface."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any, ParamSpec, TypeVar

import numpy as np

from gso import tasks, tno
from gso.errors import ConvergenceWarning, GSOError, MeshError
from gso.mesh import Mesh
from gso.mesh.normals import vertex_normals
from gso.metrics import unit
from gso.result import Result
from gso.typing import Array, Json
from gso.unknowns.spline import spline_matrix

P = ParamSpec("P")
T = TypeVar("T")

#: Control points along each side of the spline fitted to the normal offsets.
CONTROLS = 16
#: Status of a surface on which the solver raised an error.
FAILED = "FAILED"

_DEVELOPABLE = (
    "loss_gc_before",
    "loss_gc",
    "loss_gc_worst_before",
    "loss_gc_worst",
    "loss_gc_half",
    "K_A_r",
    "K_A_r_worst",
    "d_H",
    "distance_mean",
    "distance_max",
    "fairness_ratio",
)
_FLATTEN = (
    "loss_iso_cell",
    "edge_length_error",
    "strain_mean",
    "strain_p99",
    "strain_max",
    "area_error",
    "flipped_cells",
)


@dataclass(frozen=True)
class Kind:
    """A kind of label.

    Attributes
    ----------
    arguments : dict
        Keyword arguments of :func:`gso.tno.optimize`.
    arrays : callable
        Function that extracts the label's arrays, by name, from a result.
    metrics : tuple of str
        Names of the metrics that are stored.
    """

    arguments: dict[str, Any]
    arrays: Callable[[Result], dict[str, Array]]
    metrics: tuple[str, ...]

    @property
    def options(self) -> Json:
        """Settings of the solver."""
        return asdict(tno.check(**self.arguments).options)


@dataclass(frozen=True)
class Label:
    """A label of one surface: arrays and metrics by name, and the solver's status."""

    arrays: dict[str, Array]
    metrics: dict[str, float]
    status: str


def solve(kind: str, points: Array) -> Label:
    """Label one surface (H, W, 3) of the unit ball.

    If the solver raises an error, arrays and metrics are NaN and the status is :data:`FAILED`.

    Examples
    --------
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 17), np.linspace(-1, 1, 17), indexing="ij")
    >>> label = solve("strain", np.stack([u, v, 0.3 * u * v], axis=-1))
    >>> label.arrays["strain"].shape, label.metrics["flipped_cells"]
    ((17, 17, 2), 0.0)
    """
    what = KINDS[kind]
    try:
        mesh = Mesh.from_grid(points, weld=False)
        with warnings.catch_warnings():
            # The stored status says the same.
            warnings.simplefilter("ignore", ConvergenceWarning)
            result = tno.optimize(mesh, verdict=False, **what.arguments)
        return _labelled(kind, result)
    except GSOError:
        return _failed(kind, len(points))


def solve_many(
    kind: str, points: Array, device: str | None = None, elsewhere: bool = False
) -> list[Label]:
    """Label surfaces (B, H, W, 3) of the unit ball.

    Parameters
    ----------
    kind : str
        Kind of the labels.
    points : ndarray, (B, H, W, 3)
    device : str, optional
        Where to solve them in batches, for the kinds in :data:`BATCHED`; one by one when not
        given.
    elsewhere : bool
        Whether this is a worker for which another process minimises there, see
        :class:`gso.tno.batched.device_executor.DeviceExecutor`.

    Raises
    ------
    BackendError
        PyTorch is not installed.
    OptionError
        There is no such device.
    """
    if device is None or kind not in BATCHED:
        return [solve(kind, p) for p in points]
    from gso.tno.batched.batches import check_batch, solve_batch

    batch = check_batch(device=device, **KINDS[kind].arguments)
    designs: list[Mesh | GSOError] = [_or_error(Mesh.from_grid, p, weld=False) for p in points]
    good = [d for d in designs if isinstance(d, Mesh)]
    if elsewhere:
        from gso.tno.batched.device_executor import minimise_elsewhere

        results = iter(solve_batch(batch, good, minimise_elsewhere))
    else:
        # PyTorch is not loaded where another process minimises.
        from gso.tno.batched.device import check_device
        from gso.tno.batched.many import solve_all

        check_device(device)
        results = solve_all(batch, good)
    found = [next(results) if isinstance(d, Mesh) else d for d in designs]
    labels = [_or_error(_labelled, kind, f) if isinstance(f, Result) else f for f in found]
    return [x if isinstance(x, Label) else _failed(kind, points.shape[1]) for x in labels]


def _or_error(function: Callable[P, T], *given: P.args, **keywords: P.kwargs) -> T | GSOError:
    """Call a function, and return what it raises on purpose."""
    try:
        return function(*given, **keywords)
    except GSOError as error:
        return error


def _labelled(kind: str, result: Result) -> Label:
    """Return the label that a result gives."""
    what, known = KINDS[kind], _measured(result)
    metrics = {name: float(known.get(name, np.nan)) for name in what.metrics}
    return Label(what.arrays(result), metrics, result.status.name)


def _failed(kind: str, size: int) -> Label:
    """Return the label of a surface, size x size, on which the solver raised an error."""
    nowhere = {name: np.full(s, np.nan) for name, s in shapes(kind, size).items()}
    return Label(nowhere, dict.fromkeys(KINDS[kind].metrics, np.nan), FAILED)


def _measured(result: Result) -> dict[str, float]:
    """Return the metrics of a result, and of its flat image if a surface result has one."""
    if result.flat is None or result.task == "flatten":
        return result.metrics
    flatten = tasks.get("flatten").metrics
    return flatten(result.mesh, result.mesh, result.flat, unit(result.design)) | result.metrics


def shapes(kind: str, size: int) -> dict[str, tuple[int, ...]]:
    """Return the shapes of the arrays of a label of a grid size x size."""
    controls = min(CONTROLS, size)
    known: dict[str, dict[str, tuple[int, ...]]] = {
        "developable": {
            "developable": (size, size, 3),
            "offsets": (size, size),
            "spline": (controls, controls),
            "spline_residual": (),
        },
        "strain": {"strain": (size, size, 2)},
        "lengths": {"lengths": (size, size, 2)},
        "jiang2020": {"jiang2020": (size, size, 3), "jiang2020_flat": (size, size, 2)},
    }
    return known[kind]


def fit_spline(offsets: Array, controls: int = CONTROLS) -> tuple[Array, float]:
    """Fit a bicubic spline to a field on a grid by least squares.

    Parameters
    ----------
    offsets : ndarray, (H, W)
        Values on the grid.
    controls : int
        Control points along each side; at most as many as samples.

    Returns
    -------
    coefficients : ndarray, (controls, controls)
        Coefficients in the basis of :func:`gso.unknowns.spline.tensor_matrix`.
    misfit : float
        Root mean square residual, in the unit of the field.

    Examples
    --------
    >>> u, v = np.meshgrid(np.linspace(0, 1, 32), np.linspace(0, 1, 32), indexing="ij")
    >>> coefficients, misfit = fit_spline(u**3 - v)
    >>> coefficients.shape, misfit < 1e-12
    ((16, 16), True)
    """
    along, across = (_basis(n, min(controls, n)) for n in offsets.shape)
    # A least-squares fit in a tensor-product basis separates into one fit per direction.
    coefficients = along.inverse @ offsets @ across.inverse.T
    misfit = along.matrix @ coefficients @ across.matrix.T - offsets
    return coefficients, float(np.sqrt((misfit**2).mean()))


@dataclass(frozen=True)
class _Basis:
    matrix: Array
    inverse: Array


@lru_cache(maxsize=8)
def _basis(samples: int, controls: int) -> _Basis:
    matrix = spline_matrix(samples, controls).toarray()
    return _Basis(matrix, np.linalg.pinv(matrix))


def _developable(result: Result) -> dict[str, Array]:
    design, grid = result.design, result.design.grid_index
    moved = result.mesh.vertices - design.vertices
    offsets = (moved * vertex_normals(design)).sum(axis=1)[grid]
    coefficients, misfit = fit_spline(offsets)
    return {
        "developable": result.mesh.vertices[grid],
        "offsets": offsets,
        "spline": coefficients,
        "spline_residual": np.array(misfit),
    }


def _flat(name: str, result: Result) -> Array:
    if result.flat_grid is None:
        raise MeshError(f"the solver gave no flat image for {name!r}")
    return result.flat_grid


def _jiang(result: Result) -> dict[str, Array]:
    vertices = result.mesh.vertices[result.design.grid_index]
    return {"jiang2020": vertices, "jiang2020_flat": _flat("jiang2020", result)}


#: Labels that a recipe may give to every surface.
LABELS = ("developable", "strain", "lengths")
#: Kinds of labels that can be made in batches.
BATCHED = LABELS
#: Reference labels, made only for requested splits.
REFERENCES = ("jiang2020",)

KINDS = {
    "developable": Kind({"task": "developable", "options": "balanced"}, _developable, _DEVELOPABLE),
    "strain": Kind(
        {"task": "flatten", "formulation": "strain", "options": "balanced"},
        lambda result: {"strain": _flat("strain", result)},
        _FLATTEN,
    ),
    "lengths": Kind(
        {"task": "flatten", "formulation": "lengths", "options": "balanced"},
        lambda result: {"lengths": _flat("lengths", result)},
        _FLATTEN,
    ),
    "jiang2020": Kind(
        {"task": "developable", "options": "jiang2020"}, _jiang, _DEVELOPABLE + _FLATTEN
    ),
}

"""Loops over elements, compiled by Numba where it is installed and where that pays.

The loops evaluate the same graphs as :mod:`gso.solver.kernels`. They need no arrays of
products: an element's part of the matrix is added at once. Without Numba, and if it fails, NumPy
does the work.
"""

from __future__ import annotations

import inspect
import logging
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from gso.energy.base import Residual, Vectors
from gso.errors import BackendError
from gso.solver.cached_source import compile_source
from gso.solver.kernels import casadi_function, casadi_geometric_stiffness
from gso.solver.printing import Graph, loop_source
from gso.typing import Array, Ints

#: Environment variable: "numpy" for no compiled loops, "numba" for them on small meshes too.
VARIABLE = "GSO_KERNELS"
#: Number of elements below which loading Numba, or a compiled loop, takes longer than it saves.
_LEAST = 3000

_log = logging.getLogger("gso")
_numpy_only: ContextVar[bool] = ContextVar("numpy_only", default=False)


@dataclass(frozen=True)
class Loop:
    """A compiled loop over elements, see :func:`gso.solver.printing.loop_source`.

    Attributes
    ----------
    run : callable
    rows : int
        Number of residuals of an element.
    """

    run: Callable[..., None]
    rows: int


@contextmanager
def without(active: bool = True) -> Iterator[None]:
    """Evaluate all terms by NumPy if `active`, unless the environment variable says otherwise."""
    token = _numpy_only.set(active)
    try:
        yield
    finally:
        _numpy_only.reset(token)


def residual(function: Residual, shape: tuple[int, ...], constants: int, count: int) -> Loop | None:
    """Return the loop that evaluates residuals only; None if NumPy is to do it."""
    return _residual_loop(function, shape, constants, False) if _pays(count) else None


def jacobian(function: Residual, shape: tuple[int, ...], constants: int, count: int) -> Loop | None:
    """Return the loop that evaluates residuals and Jacobians; None if NumPy is to do it."""
    return _residual_loop(function, shape, constants, True) if _pays(count) else None


def stiffness(vectors: Vectors, shape: tuple[int, ...], constants: int, count: int) -> Loop | None:
    """Return the loop for the rows of the geometric stiffness; None if NumPy is to do it."""
    return _stiffness_loop(vectors, shape, constants) if _pays(count) else None


def adder(rows: int, wide: int, size: int, kind: int) -> Callable[..., None]:
    """Return :func:`add_elements` compiled for elements of one kind.

    Parameters
    ----------
    rows, wide, size : int
        Number of residuals, coordinates and unknowns of an element.
    kind : int
        Of the chain rule.
    """
    return _adder(rows, wide, size, kind) or add_elements


def _pays(count: int) -> bool:
    choice = os.environ.get(VARIABLE, "") or ("numpy" if _numpy_only.get() else "")
    if choice == "numpy" or not _installed():
        return False
    return choice == "numba" or count >= _LEAST


@lru_cache(maxsize=1)
def _installed() -> bool:
    return find_spec("numba") is not None


@lru_cache(maxsize=256)
def _residual_loop(
    function: Residual, shape: tuple[int, ...], constants: int, jacobian: bool
) -> Loop | None:
    return _loop(casadi_function(function, shape, constants, jacobian))


@lru_cache(maxsize=32)
def _stiffness_loop(vectors: Vectors, shape: tuple[int, ...], constants: int) -> Loop | None:
    return _loop(casadi_geometric_stiffness(vectors, shape, constants))


def _loop(graph: Graph) -> Loop | None:
    run = _compile(loop_source(graph))
    return None if run is None else Loop(run, int(graph.size1_out(0)))


@lru_cache(maxsize=256)
def _adder(rows: int, wide: int, size: int, kind: int) -> Callable[..., None] | None:
    # With numbers in place of these names the compiler unrolls the inner loops.
    source = inspect.getsource(add_elements).replace("def add_elements(", "def kernel(")
    for line, value in (
        ("rows, count = first.shape", f"rows, count = {rows}, first.shape[1]"),
        ("wide = slope.shape[1] // rows", f"wide = {wide}"),
        ("size = columns.shape[0]", f"size = {size}"),
        ("if kind == 1:", f"if {kind == 1}:"),
        ("elif kind == 2:", f"elif {kind == 2}:"),
    ):
        if line not in source:
            raise BackendError(f"the loop has no line {line!r}")
        source = source.replace(line, value)
    return _compile(source)


def _compile(source: str) -> Callable[..., None] | None:
    """Compile a loop; None if Numba fails, which is said once for each loop."""
    try:
        return compile_source(source)
    except Exception as error:
        _log.warning("Numba failed, NumPy evaluates the terms instead: %s", error)
        return None


def add_elements(
    slope: Array,
    first: Array,
    second: Array,
    factor: Array,
    columns: Ints,
    places: NDArray[np.int32],
    doubled: bool,
    kind: int,
    gather: Ints,
    begin: Ints,
    unknown: Ints,
    share: Array,
    start: int,
    gradient: Array,
    values: Array,
    work: Array,
) -> None:
    """Add the gradient and the matrices of some elements; written for Numba.

    Parameters
    ----------
    slope : ndarray, (b, r * k)
        Jacobians by coordinates of the elements from `start` on.
    first, second : ndarray, (r, b)
        Derivative and curvature of the loss.
    factor : ndarray, (e,)
        Weights of all elements.
    columns : ndarray of int, (q, e)
        Unknowns of all elements.
    places : ndarray of int, (e, pairs)
        Places of the entries of all elements' matrices.
    doubled : bool
        Whether an unknown may occur twice in an element.
    kind : int
        Of the chain rule: 0 where coordinates are unknowns, 1 where each point moves with one, 2
        where coordinates are sums of unknowns.
    gather : ndarray of int, (k, e)
        Coordinates of all elements.
    begin, unknown, share : ndarray
        1: `share` is the derivative of every coordinate by its unknown. 2: the parts of
        coordinate k of element e are those from ``begin[e * wide + k]`` on, where wide is the
        number of coordinates; the place in the element of each part's unknown, and its factor.
    start : int
    gradient, values : ndarray
        What is added to.
    work : ndarray, (r, q)
        Memory for the Jacobian by unknowns of one element.
    """
    rows, count = first.shape
    wide = slope.shape[1] // rows
    size = columns.shape[0]
    for i in range(count):
        e = start + i
        if kind == 1:
            dim = wide // size
            for r in range(rows):
                for a in range(size):
                    total = 0.0
                    for d in range(a * dim, a * dim + dim):
                        total += slope[i, r * wide + d] * share[gather[d, e]]
                    work[r, a] = total
        elif kind == 2:
            work[:] = 0.0
            for k in range(wide):
                for t in range(begin[e * wide + k], begin[e * wide + k + 1]):
                    for r in range(rows):
                        work[r, unknown[t]] += slope[i, r * wide + k] * share[t]
        else:
            for r in range(rows):
                for a in range(size):
                    work[r, a] = slope[i, r * wide + a]
        for a in range(size):
            total = 0.0
            for r in range(rows):
                total += first[r, i] * work[r, a]
            gradient[columns[a, e]] += factor[e] * total
        t = 0
        for a in range(size):
            for b in range(a, size):
                total = 0.0
                for r in range(rows):
                    total += second[r, i] * work[r, a] * work[r, b]
                total *= factor[e]
                if doubled and a != b and columns[a, e] == columns[b, e]:
                    total *= 2.0
                values[places[e, t]] += total
                t += 1

"""Kernels: the residual of one element, differentiated by CasADi, printed as NumPy code.

CasADi evaluates mapped functions slowly when called with NumPy arrays. Its expression graph,
printed as straight-line array code and run on blocks of elements that stay in the
processor's cache, gives identical values ten times faster.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from types import ModuleType
from typing import Any

import numpy as np

from gso.energy.base import Residual, Vectors
from gso.errors import OptionError
from gso.geometry.ops import TINY
from gso.solver.printing import Graph, numpy_source
from gso.typing import Array, S

#: Elements per block: a kernel's work arrays then fit the second-level cache.
BLOCK = 1024


def _points(x: Sequence[S], shape: tuple[int, ...]) -> list[tuple[S, ...]]:
    ends = np.cumsum(shape)
    return [
        tuple(x[k] for k in range(end - dim, end)) for dim, end in zip(shape, ends, strict=True)
    ]


def _casadi() -> ModuleType:
    import casadi

    return casadi


@lru_cache(maxsize=128)
def casadi_function(
    residual: Residual, shape: tuple[int, ...], constants: int, jacobian: bool
) -> Graph:
    """Make the CasADi function of one element: (coordinates, constants) -> residuals, Jacobian.

    Parameters
    ----------
    residual : callable
        Residual of a term.
    shape : tuple of int
        Dimension of each point of the stencil, in order.
    constants : int
        Number of constants.
    jacobian : bool
        Also return the dense Jacobian, row by row.

    Raises
    ------
    OptionError
        The residual cannot be evaluated for symbols.
    """
    ca = _casadi()
    x, c = ca.SX.sym("x", sum(shape)), ca.SX.sym("c", constants)
    try:
        value = ca.vertcat(*residual(_points(x, shape), ca.vertsplit(c)))
    except Exception as error:
        name = getattr(residual, "__qualname__", repr(residual))
        why = (str(error).strip() or type(error).__name__).splitlines()[-1]
        raise OptionError(
            f"the residual {name} of a term fails for CasADi symbols: {why}; it must return a "
            "tuple of expressions of its points and constants, without conditions"
        ) from error
    outputs = [value]
    if jacobian:
        outputs.append(ca.vec(ca.densify(ca.jacobian(value, x)).T))
    function: Graph = ca.Function("element", [x, c], outputs, {"cse": True})
    return function


@lru_cache(maxsize=32)
def casadi_geometric_stiffness(vectors: Vectors, shape: tuple[int, ...], constants: int) -> Graph:
    """Make the CasADi function of one element: lengths of its plane vectors, and rows h.

    The second derivative (geometric stiffness) of the length of a vector (u, v) that is linear
    in the coordinates is the rank-one matrix ``h h^T``, ``h = (u dv - v du) / length^(3/2)``.
    """
    ca = _casadi()
    x, c = ca.SX.sym("x", sum(shape)), ca.SX.sym("c", constants)
    found = vectors(_points(x, shape), ca.vertsplit(c))
    pairs = ca.vertcat(*(ca.horzcat(*pair) for pair in found))
    u, v = pairs[:, 0], pairs[:, 1]
    length = ca.sqrt(ca.fmax(u * u + v * v, TINY))
    turn = ca.diag(u) @ ca.jacobian(v, x) - ca.diag(v) @ ca.jacobian(u, x)
    rows = ca.diag(1.0 / (length * ca.sqrt(length))) @ turn
    outputs = [length, ca.vec(ca.densify(rows).T)]
    function: Graph = ca.Function("stiffness", [x, c], outputs, {"cse": True})
    return function


class Kernel:
    """Evaluates residuals, and optionally their Jacobian, on arrays of elements.

    Made from a function of :func:`casadi_function` or :func:`casadi_geometric_stiffness`. Call with
    coordinates (k, e) and constants (c, e); returns residuals (r, e) and Jacobian
    (r, k, e), which is empty without `jacobian`.
    """

    def __init__(self, function: Graph, shape: tuple[int, ...], *, jacobian: bool):
        self.rows = int(function.size1_out(0))
        self.columns = sum(shape)
        self.jacobian = jacobian
        self.source, self._work = numpy_source(function), int(function.sz_w())
        scope: dict[str, Any] = {"np": np}
        exec(compile(self.source, "<gso kernel>", "exec"), scope)
        self._run = scope["kernel"]

    def __call__(self, x: Array, c: Array) -> tuple[Array, Array]:
        count = x.shape[1]
        value = np.empty((self.rows, count))
        slope = np.empty((self.rows * self.columns if self.jacobian else 0, count))
        work = np.empty((self._work, min(BLOCK, count)))
        with np.errstate(all="ignore"):
            for start in range(0, count, BLOCK):
                at = slice(start, min(start + BLOCK, count))
                w = work[:, : at.stop - start]
                self._run(x[:, at], c[:, at], value[:, at], slope[:, at], w)
        return value, slope.reshape(self.rows, self.columns if self.jacobian else 0, count)


@lru_cache(maxsize=128)
def kernel(residual: Residual, shape: tuple[int, ...], constants: int, jacobian: bool) -> Kernel:
    """Return the kernel of a residual, printed at first use and cached."""
    function = casadi_function(residual, shape, constants, jacobian)
    return Kernel(function, shape, jacobian=jacobian)


@lru_cache(maxsize=32)
def geometric_stiffness(vectors: Vectors, shape: tuple[int, ...], constants: int) -> Kernel:
    """Return the kernel of the geometric stiffness, see :attr:`gso.energy.Term.vectors`."""
    return Kernel(casadi_geometric_stiffness(vectors, shape, constants), shape, jacobian=True)

"""Kernels on PyTorch tensors: the graphs of :mod:`gso.solver.kernels`, for many surfaces."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import torch
from torch import Tensor

from gso.energy.base import Residual, Vectors
from gso.solver.kernels import casadi_function, casadi_geometric_stiffness
from gso.solver.printing import Graph, torch_source


class Kernel:
    """Evaluates residuals, and optionally their Jacobian, on tensors of elements.

    Parameters
    ----------
    function : casadi.Function
        The function of one element.
    columns : int
        Number of coordinates of an element.
    jacobian : bool
        Whether the function has a Jacobian.
    """

    def __init__(self, function: Graph, columns: int, *, jacobian: bool):
        self.rows = int(function.size1_out(0))
        self.columns = columns if jacobian else 0
        self.slots = int(function.sz_w())
        self.source, self.numbers = torch_source(function)
        scope: dict[str, Any] = {"torch": torch}
        exec(compile(self.source, "<gso kernel>", "exec"), scope)
        self._run = scope["kernel"]
        self._numbers: dict[torch.device, tuple[Tensor, ...]] = {}

    def __call__(self, x: Tensor, c: Tensor) -> tuple[Tensor, Tensor]:
        """Evaluate elements.

        Parameters
        ----------
        x : Tensor, (k, ...)
            Coordinates.
        c : Tensor, (c, ...)
            Constants.

        Returns
        -------
        residuals : Tensor, (r, ...)
        slope : Tensor, (r, k, ...)
            Their Jacobian; (r, 0, ...) without one.
        """
        shape = x.shape[1:]
        residual = x.new_empty((self.rows, *shape))
        slope = x.new_empty((self.rows * self.columns, *shape))
        work = x.new_empty((self.slots, *shape))
        if x.device not in self._numbers:
            self._numbers[x.device] = x.new_tensor(self.numbers).unbind()
        arrays = (array.unbind() for array in (x, c, residual, slope, work))
        self._run(*arrays, self._numbers[x.device])
        return residual, slope.view(self.rows, self.columns, *shape)


@lru_cache(maxsize=128)
def kernel(residual: Residual, shape: tuple[int, ...], constants: int, jacobian: bool) -> Kernel:
    """Return the kernel of a residual, printed at first use and cached."""
    function = casadi_function(residual, shape, constants, jacobian)
    return Kernel(function, sum(shape), jacobian=jacobian)


@lru_cache(maxsize=32)
def geometric_stiffness(vectors: Vectors, shape: tuple[int, ...], constants: int) -> Kernel:
    """Return the kernel of the geometric stiffness, see :attr:`gso.energy.Term.vectors`."""
    function = casadi_geometric_stiffness(vectors, shape, constants)
    return Kernel(function, sum(shape), jacobian=True)

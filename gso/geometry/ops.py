"""Square root, atan2, minimum, maximum, where and stack for NumPy, torch and CasADi numbers.

The module is found from the type of the argument, so neither torch nor casadi is imported
here: a caller with such a number has imported its package already.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

# Below this a squared length counts as zero. Its root has a finite derivative, so a
# degenerate element gives zeros and never a NaN.
TINY = 1e-60
TINY_SINGLE = 1e-30


def _module_of(x: Any) -> Any:
    """Return the torch or casadi module that `x` belongs to, or None for NumPy."""
    root = type(x).__module__.partition(".")[0]
    return sys.modules[root] if root in ("torch", "casadi") else None


def sqrt(x: Any) -> Any:
    """Return the square root of ``max(x, tiny)``: finite, with a finite derivative, at zero."""
    mod = _module_of(x)
    if mod is None:
        return np.sqrt(np.maximum(x, TINY))
    if mod.__name__ == "torch":
        return mod.sqrt(mod.clamp(x, min=TINY if x.dtype == mod.float64 else TINY_SINGLE))
    return mod.sqrt(mod.fmax(x, TINY))


def atan2(y: Any, x: Any) -> Any:
    """Return the angle of the vector (x, y), radians."""
    mod = _module_of(y)
    return np.arctan2(y, x) if mod is None else mod.atan2(y, x)


def minimum(x: Any, y: Any) -> Any:
    """Return the smaller of two numbers."""
    mod = _module_of(x)
    if mod is None:
        return np.minimum(x, y)
    if mod.__name__ != "torch":
        return mod.fmin(x, y)
    return mod.minimum(x, y) if _module_of(y) is mod else mod.clamp(x, max=y)


def maximum(x: Any, y: Any) -> Any:
    """Return the larger of two numbers."""
    mod = _module_of(x)
    if mod is None:
        return np.maximum(x, y)
    if mod.__name__ != "torch":
        return mod.fmax(x, y)
    return mod.maximum(x, y) if _module_of(y) is mod else mod.clamp(x, min=y)


def power(x: Any, exponent: float) -> Any:
    """Return ``x**exponent``, by multiplications where the exponent is whole and at most eight.

    >>> power(np.array([2.0]), 7.0)
    array([128.])
    """
    whole = int(exponent) if 2.0 < exponent <= 8.0 else 0
    if whole != exponent:
        return x**exponent
    half = power(x, whole // 2)
    return half * half * x if whole % 2 else half * half


def where(condition: Any, x: Any, y: Any) -> Any:
    """Return x where a condition on NumPy arrays or torch tensors holds, and y elsewhere."""
    mod = _module_of(condition)
    return np.where(condition, x, y) if mod is None else mod.where(condition, x, y)


def like(x: Any, values: Any) -> Any:
    """Broadcast values to the shape of a NumPy array or torch tensor x."""
    mod = _module_of(x)
    if mod is None:
        return np.broadcast_to(np.asarray(values, x.dtype), x.shape)
    given = values if _module_of(values) is mod else mod.as_tensor(values).to(x)
    return given.expand(x.shape)


def stack(arrays: Sequence[Any]) -> Any:
    """Stack NumPy arrays or torch tensors of one shape along a new first axis."""
    mod = _module_of(arrays[0])
    return np.stack(arrays) if mod is None else mod.stack(tuple(arrays))

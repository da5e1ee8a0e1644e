"""Square root, atan2, minimum, maximum, where, stack ... for NumPy, torch and CasADi numbers.

The module is found from the type of the argument, so neither torch nor casadi is imported
here: a caller with such a number has imported its package already.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np

from gso.typing import B, S

# Below this a squared length counts as zero. Its root has a finite derivative, so a
# degenerate element gives zeros and never a NaN.
TINY = 1e-60
TINY_SINGLE = 1e-30


def _module_of(x: object) -> ModuleType:
    """Return the module that `x` belongs to: torch or casadi, otherwise NumPy."""
    root = type(x).__module__.partition(".")[0]
    return sys.modules[root] if root in ("torch", "casadi") else np


def sqrt(x: S) -> S:
    """Return the square root of ``max(x, tiny)``: finite, with a finite derivative, at zero."""
    mod = _module_of(x)
    number: Any = x
    if mod is np:
        root: S = np.sqrt(np.maximum(number, TINY))
    elif mod.__name__ == "torch":
        tiny = TINY if number.dtype == mod.float64 else TINY_SINGLE
        root = mod.sqrt(mod.clamp(number, min=tiny))
    else:
        root = mod.sqrt(mod.fmax(number, TINY))
    return root


def atan2(y: S, x: S) -> S:
    """Return the angle of the vector (x, y), radians."""
    mod = _module_of(y)
    angle: S = mod.arctan2(y, x) if mod is np else mod.atan2(y, x)
    return angle


def minimum(x: S, y: S | float) -> S:
    """Return the smaller of two numbers."""
    mod = _module_of(x)
    if mod is np:
        small: S = mod.minimum(x, y)
    elif mod.__name__ != "torch":
        small = mod.fmin(x, y)
    else:
        small = mod.minimum(x, y) if _module_of(y) is mod else mod.clamp(x, max=y)
    return small


def maximum(x: S, y: S | float) -> S:
    """Return the larger of two numbers."""
    mod = _module_of(x)
    if mod is np:
        large: S = mod.maximum(x, y)
    elif mod.__name__ != "torch":
        large = mod.fmax(x, y)
    else:
        large = mod.maximum(x, y) if _module_of(y) is mod else mod.clamp(x, min=y)
    return large


def power(x: B, exponent: float) -> B:
    """Return ``x**exponent``, by multiplications where the exponent is whole and at most eight.

    >>> power(np.array([2.0]), 7.0)
    array([128.])
    """
    whole = int(exponent) if 2.0 < exponent <= 8.0 else 0
    if whole != exponent:
        return x**exponent
    half = power(x, whole // 2)
    return half * half * x if whole % 2 else half * half


def where(condition: object, x: S | float, y: S | float) -> S:
    """Return x where a condition on NumPy arrays or torch tensors holds, and y elsewhere."""
    chosen: S = _module_of(condition).where(condition, x, y)
    return chosen


def like(x: B, values: B | float) -> B:
    """Broadcast values to the shape of a NumPy array or torch tensor x."""
    mod = _module_of(x)
    if mod is np:
        full: B = mod.broadcast_to(mod.asarray(values, x.dtype), x.shape)
    else:
        given: Any = values if _module_of(values) is mod else mod.as_tensor(values).to(x)
        full = given.expand(x.shape)
    return full


def stack(arrays: Sequence[B]) -> B:
    """Stack NumPy arrays or torch tensors of one shape along a new first axis."""
    stacked: B = _module_of(arrays[0]).stack(tuple(arrays))
    return stacked


def concatenate(arrays: Sequence[B], axis: int) -> B:
    """Join NumPy arrays or torch tensors along an axis."""
    mod = _module_of(arrays[0])
    joined: B = mod.concatenate(arrays, axis) if mod is np else mod.cat(tuple(arrays), dim=axis)
    return joined


def padded(x: B, top: int, bottom: int, left: int, right: int) -> B:
    """Add rows and columns of zeros to a NumPy array or torch tensor (..., H, W)."""
    mod = _module_of(x)
    number: Any = x
    if mod is np:
        none = [(0, 0)] * (number.ndim - 2)
        larger: Any = np.pad(number, [*none, (top, bottom), (left, right)])
    else:
        larger = mod.nn.functional.pad(number, (left, right, top, bottom))
    added: B = larger
    return added

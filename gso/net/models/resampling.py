"""Spline fields and resampling of grids in torch, as matrix products."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import torch
from torch import Tensor

from gso.hierarchy import resample
from gso.unknowns.spline import spline_matrix


@lru_cache(maxsize=64)
def _basis(samples: int, controls: int, dtype: torch.dtype, device: torch.device) -> Tensor:
    matrix = spline_matrix(samples, controls).toarray()
    # The cached tensor may be used in training, so it must not be an inference tensor.
    with torch.inference_mode(False):
        return torch.tensor(matrix, dtype=dtype, device=device)


def spline_field(coefficients: Tensor, height: int, width: int) -> Tensor:
    """Evaluate clamped bicubic splines, coefficients (B, c, n, m), as (B, c, height, width).

    The basis is that of :func:`gso.unknowns.spline.tensor_matrix`.

    >>> bool((spline_field(torch.ones(1, 1, 4, 5), 7, 9) - 1.0).abs().max() < 1e-6)
    True
    """
    n, m = coefficients.shape[-2:]
    kind, place = coefficients.dtype, coefficients.device
    along, across = _basis(height, n, kind, place), _basis(width, m, kind, place)
    return along @ coefficients @ across.T


def resampled(values: Tensor, height: int, width: int) -> Tensor:
    """Interpolate values (B, H, W, d) to (B, height, width, d) by cubic splines, on the CPU."""
    if values.shape[1:3] == (height, width):
        return values
    each = values.detach().cpu().double().numpy()
    done = np.stack([resample(v, height, width) for v in each])
    return torch.as_tensor(done, dtype=values.dtype, device=values.device)

"""Grids at another resolution, and splines on grids, as products of matrices."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import torch
from torch import Tensor

from gso.resample import resample
from gso.variables.spline import spline_matrix


@lru_cache(maxsize=64)
def _basis(samples: int, controls: int, dtype: torch.dtype, device: torch.device) -> Tensor:
    matrix = spline_matrix(samples, controls).toarray()
    # It outlives the call: made in inference mode, it would be of no use in training.
    with torch.inference_mode(False):
        return torch.tensor(matrix, dtype=dtype, device=device)


def spline_field(coefficients: Tensor, height: int, width: int) -> Tensor:
    """Values (B, c, height, width) of clamped bicubic splines with coefficients (B, c, n, m).

    The basis is that of :func:`gso.variables.spline.tensor_matrix`.

    >>> bool((spline_field(torch.ones(1, 1, 4, 5), 7, 9) - 1.0).abs().max() < 1e-6)
    True
    """
    n, m = coefficients.shape[-2:]
    kind, place = coefficients.dtype, coefficients.device
    along, across = _basis(height, n, kind, place), _basis(width, m, kind, place)
    return along @ coefficients @ across.T


def resampled(values: Tensor, height: int, width: int) -> Tensor:
    """Values (B, H, W, d) of grids, interpolated to (B, height, width, d) by cubic splines."""
    if values.shape[1:3] == (height, width):
        return values
    each = values.detach().cpu().double().numpy()
    done = np.stack([resample(v, height, width) for v in each])
    return torch.as_tensor(done, dtype=values.dtype, device=values.device)

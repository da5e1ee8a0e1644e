"""JSON files of values that may be NumPy's."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gso.io.atomic import write_bytes
from gso.typing import AnyPath


def plain(value: Any) -> Any:
    """Replace what JSON lacks: NumPy numbers, and numbers that are not finite by None.

    >>> plain({"strains": (np.float64(0.5), np.inf), "count": np.int64(2)})
    {'strains': [0.5, None], 'count': 2}
    """
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, bool | str) or value is None:
        return value
    if isinstance(value, int | np.integer):
        return int(value)
    number = float(value)
    return number if math.isfinite(number) else None


def write_json(path: AnyPath, content: Any) -> None:
    """Write values to a JSON file, as :func:`plain` returns them."""
    write_bytes(path, json.dumps(plain(content), indent=2).encode() + b"\n")

"""Solves of many surfaces at once, on PyTorch tensors whose last axis is that of the surfaces.

Raises
------
BackendError
    PyTorch is not installed.
"""

from importlib.util import find_spec

from gso.errors import BackendError

if find_spec("torch") is None:
    raise BackendError('batched solves need torch: pip install ".[net]" in the folder of gso')

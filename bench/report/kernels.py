"""The two builds of the solver: with kernels compiled by Numba, and with NumPy kernels."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

from gso.solver.loops import VARIABLE
from report import store

#: Values of the environment variable for the build without Numba, and for Numba on small meshes.
NUMPY, NUMBA = "numpy", "numba"


def numba() -> str:
    """Return the version of Numba, or "" if it is not installed."""
    return store.installed(("numba",))["numba"]


def compiled() -> bool:
    """Return whether the build that the run uses has compiled kernels."""
    return bool(numba()) and os.environ.get(VARIABLE) != NUMPY


def described() -> str:
    """Return a sentence on the build that the run uses."""
    if not numba():
        return "Numba is not installed, so all times are those with NumPy kernels."
    if not compiled():
        return f"{VARIABLE} is {NUMPY}, so all times are those with NumPy kernels."
    small = ", on small meshes too" if os.environ.get(VARIABLE) == NUMBA else ""
    return (
        f"Unless said otherwise, times are those with kernels compiled by Numba {numba()}{small}."
    )


def key(choice: str = "") -> str:
    """Return what the results of a build depend on.

    Parameters
    ----------
    choice : str
        Value of the environment variable; "" for the build that the run uses.
    """
    choice = choice or os.environ.get(VARIABLE, "")
    return NUMPY if choice == NUMPY or not numba() else f"numba {numba()} {choice}".strip()


@contextmanager
def chosen(choice: str) -> Iterator[None]:
    """Solve with the kernels that a value of the environment variable names; "" changes nothing."""
    with patch.dict(os.environ, {VARIABLE: choice} if choice else {}):
        yield

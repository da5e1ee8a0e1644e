"""Short representations of objects with arrays, as a prompt or a notebook shows them."""

from __future__ import annotations

import base64
import html
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import Any

import numpy as np

#: Largest number of lines, and of characters of a line and of one value.
LINES, WIDTH, _VALUE = 5, 100, 40
#: Largest number of elements of an array, or of a sequence, that is shown whole.
_FEW = 4


def short_repr(self: Any) -> str:
    """Return the representation of a dataclass with at most `LINES` lines.

    Arrays are shown by their shapes, sequences by their lengths, and other dataclasses by their
    names. A class takes it by ``__repr__ = short_repr``.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass
    ... class Net:
    ...     points: np.ndarray
    ...     rows: list
    ...     name: str = "net"
    ...     __repr__ = short_repr
    >>> Net(np.zeros((8, 8, 3)), [0] * 9)
    Net(points=float64 (8, 8, 3), rows=9 items, name='net')
    """
    shown = [f"{f.name}={_value(getattr(self, f.name))}" for f in fields(self) if f.repr]
    text = f"{type(self).__name__}({', '.join(shown)})"
    lines = textwrap.wrap(text, WIDTH, subsequent_indent="    ", break_long_words=False)
    if len(lines) > LINES:
        lines = [*lines[: LINES - 1], "    ...)"]
    return "\n".join(lines)


def html_repr(self: Any) -> str:
    """Return what a notebook shows: the representation, and a picture where one can be drawn.

    A class takes it by ``_repr_html_ = html_repr``. :mod:`gso.plot` draws the picture; it is asked
    by its name, since it is a later layer.
    """
    shown = f"<pre>{html.escape(repr(self))}</pre>"
    data: bytes | None = import_module("gso.plot").png(self)
    if data is None:
        return shown
    code = base64.b64encode(data).decode()
    return f'{shown}<img style="max-width: 100%" src="data:image/png;base64,{code}" alt="">'


def _value(value: object) -> str:
    if isinstance(value, np.ndarray):
        if value.ndim == 1 and value.size <= _FEW:
            return str(value.tolist())
        return f"{value.dtype} {value.shape}"
    if is_dataclass(value) and not isinstance(value, type):
        return f"{type(value).__name__}(...)"
    if isinstance(value, Sequence | Mapping) and not isinstance(value, str):
        plain = all(isinstance(one, str | int | float | bool) for one in value)
        if len(value) > _FEW or not plain or isinstance(value, Mapping):
            return f"{len(value)} item{'s' * (len(value) != 1)}"
    text = repr(value)
    return text if len(text) <= _VALUE and "\n" not in text else f"{type(value).__name__}(...)"

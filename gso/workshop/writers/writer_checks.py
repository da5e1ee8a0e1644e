"""Checks of what a writer is asked for, before anything is written."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import GSOError, MeshError
from gso.workshop.part import Drawing, Part


def require(package: str, files: str) -> None:
    """Raise an error if a package is not installed.

    Raises
    ------
    GSOError
        With instructions to install it.

    Examples
    --------
    >>> require("no_such_package", "DWG files")
    Traceback (most recent call last):
    gso.errors.GSOError: DWG files need no_such_package: pip install "gso[workshop]"
    """
    if find_spec(package) is None:
        raise GSOError(f'{files} need {package}: pip install "gso[workshop]"')


def check(drawing: Drawing) -> None:
    """Reject a drawing that cannot be written.

    Raises
    ------
    MeshError
        There are no parts, the sheet has no area, a line has too few points, or a number is not
        finite; the message names the part.

    Examples
    --------
    >>> check(Drawing(()))
    Traceback (most recent call last):
    gso.errors.MeshError: the drawing has no parts; add one before writing it
    """
    if not drawing.parts:
        raise MeshError("the drawing has no parts; add one before writing it")
    if drawing.sheet is not None:
        size = np.asarray(drawing.sheet, float)
        if size.shape != (2,) or not (np.isfinite(size).all() and (size > 0).all()):
            raise MeshError(f"the sheet's size is {drawing.sheet}; give two positive lengths")
    for part in drawing.parts:
        _check_part(part)


def _check_part(part: Part) -> None:
    where = f"part {part.name!r}"
    _points(part.outline, 3, f"{where}: its outline")
    for lines, least, what in (
        (part.holes, 3, "hole"),
        (part.creases, 2, "crease"),
        (part.marks, 2, "mark"),
        (part.seams, 2, "seam"),
        ([bend.line for bend in part.bends], 2, "bend"),
    ):
        for number, line in enumerate(lines):
            _points(line, least, f"{where}: {what} {number}")
    for number, bend in enumerate(part.bends):
        if len(bend.line) != 2:
            raise MeshError(f"{where}: bend {number} has {len(bend.line)} points; give its 2 ends")
        if not np.isfinite(bend.angle) or np.isnan(bend.radius):
            raise MeshError(f"{where}: the angle or radius of bend {number} is not a number")
    for label in part.labels:
        _vector((*np.ravel(label.at), label.height, label.angle), 4, f"{where}: a label")
        if label.height <= 0:
            raise MeshError(f"{where}: a label's height is {label.height}; give a positive one")
    for notch in part.notches:
        _vector((*np.ravel(notch.at), *np.ravel(notch.inward)), 4, f"{where}: a notch")
    if part.grain is not None:
        _vector(part.grain, 2, f"{where}: its grain")


def _points(line: ArrayLike, least: int, what: str) -> None:
    points = np.asarray(line)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < least:
        raise MeshError(
            f"{what} is an array {points.shape}; give (k, 2) with {least} points or more"
        )
    if not np.isfinite(points).all():
        raise MeshError(f"{what} has coordinates that are not finite")


def _vector(values: ArrayLike, count: int, what: str) -> None:
    numbers = np.asarray(values, float)
    if numbers.shape != (count,) or not np.isfinite(numbers).all():
        raise MeshError(f"{what} has coordinates that are missing or not finite")

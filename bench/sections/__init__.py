"""Sections of ``python bench/run_all.py --only``: one file for each subject."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

#: Files with sections; each lists them as ``SECTIONS``.
SUBJECTS = tuple(sorted(path.stem for path in Path(__file__).parent.glob("[a-z]*.py")))


def sections(subjects: Iterable[str] = SUBJECTS) -> dict[str, Callable[..., dict[str, Any]]]:
    """Return the sections of some subjects by name, such as "tno.developable"."""
    return {
        f"{subject}.{section.__name__}": section
        for subject in subjects
        for section in importlib.import_module(f"sections.{subject}").SECTIONS
    }

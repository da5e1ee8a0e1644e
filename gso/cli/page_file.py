"""The page of a result as a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gso.result import Result
    from gso.seams import Segmentation
    from gso.unfolding import Net

#: Suffixes of pages.
PAGES = (".html",)


def write_page(
    found: Result | Segmentation | Net, source: str, out: str, unit: str, **more: Any
) -> None:
    """Write the page of what was made of a file; `more` are options of its drawings.

    Raises
    ------
    MeshError
        None of its pieces has a flat pattern.
    """
    from gso.io.atomic import write_bytes
    from gso.workshop.result_page import result_page

    write_bytes(out, result_page(found, Path(source).stem, unit=unit, **more).encode())

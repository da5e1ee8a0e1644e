"""Pages of results in a browser, or pictures of them in a notebook."""

from __future__ import annotations

import atexit
import os
import sys
import tempfile
import webbrowser
from importlib import import_module
from pathlib import Path
from typing import Any

from gso.errors import GSOError


def show(self: Any, *, unit: str = "mm", name: str = "result") -> None:
    """Open the page of the result in a browser; in a notebook, show its picture.

    The page turns, and folds patterns to their places. It is a temporary file, which is there until
    Python ends: a script that shows a result should wait, for instance by ``input()``.

    Parameters
    ----------
    unit : str
        Unit of the coordinates.
    name : str
        What the design is called.

    Raises
    ------
    GSOError
        There is no browser.
    """
    # The page is one of a later layer, which is asked by its name.
    if in_notebook():
        picture(self)
        return
    page: str = import_module("gso.workshop.result_page").result_page(self, name, unit=unit)
    handle, path = tempfile.mkstemp(suffix=".html", prefix="gso-")
    atexit.register(Path(path).unlink, missing_ok=True)
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(page)
    open_file(Path(path))


def open_file(page: Path) -> None:
    """Open a page in the browser.

    Raises
    ------
    GSOError
        There is no browser.
    """
    if not webbrowser.open(page.resolve().as_uri()):
        raise GSOError(
            f"there is no browser to open {page} with; write the page to a file by gso view or "
            "--page, and open it where there is one"
        )


def in_notebook() -> bool:
    """Tell whether this process is the kernel of a notebook."""
    found = sys.modules.get("IPython")
    return found is not None and getattr(found.get_ipython(), "kernel", None) is not None


def picture(found: object) -> None:
    """Show the picture of an object in a notebook."""
    import_module("IPython.display").display(found)

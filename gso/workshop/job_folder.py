"""The folder of a fabrication: what an earlier run left there, and what must not be replaced."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path

from gso.errors import MeshError, OptionError
from gso.io.json_file import write_json
from gso.typing import Unwelded
from gso.verdict import Code, failure

#: Folders of drawings and surfaces, the folder of what was made, and files.
FOLDERS, WORK, CERTIFICATE, PAGE, PAPER, SOLIDS = (
    ("parts", "sheets", "surfaces"),
    "work",
    "certificate.json",
    "index.html",
    "parts.pdf",
    "folded.step",
)


def opened(place: Path, inputs: Iterable[object]) -> set[str]:
    """Create the folder, or take over that of an earlier run.

    Its certificate says until the end that the run has not ended.

    Parameters
    ----------
    place : Path
    inputs : iterable
        The designs; those that are files must not be among what is replaced.

    Returns
    -------
    set of str
        The drawings, surfaces and solids that an earlier run wrote.

    Raises
    ------
    MeshError
        The folder cannot be written to.
    OptionError
        It has files that would be replaced and that no earlier run wrote.
    """
    replaced = [(place / name).resolve() for name in (*FOLDERS, WORK)]
    for one in inputs:
        source = path_of(one)
        above = [] if source is None else list(source.resolve().parents)
        for inner in replaced:
            if inner in above:
                raise OptionError(
                    f"{source} is in {inner}, whose files are replaced; name another folder"
                )
    try:
        place.mkdir(parents=True, exist_ok=True)
        ours = (place / WORK).is_dir() or _certificate(place) is not None
        theirs = [
            n for n in (*FOLDERS, PAGE, PAPER, SOLIDS, CERTIFICATE, WORK) if (place / n).exists()
        ]
        if theirs and not ours:
            raise OptionError(
                f"{place} has {theirs[0]}, which gso fabricate did not write; name another folder"
            )
        for name in (*FOLDERS, WORK):
            if (place / name).exists() and not (place / name).is_dir():
                raise OptionError(f"{place / name} is a file; remove it or name another folder")
        (place / WORK).mkdir(exist_ok=True)
    except OSError as error:
        raise MeshError(f"{place}: {error.strerror}; -o names a folder") from None
    files = _certificate(place) or []
    why = [failure(Code.UNFINISHED).record("mm")]
    write_json(place / CERTIFICATE, {"usable": False, "reasons": why, "files": files})
    drawn = {n for n in files if n.count("/") == 1 and n.split("/")[0] in FOLDERS and ".." not in n}
    return drawn | ({PAPER, SOLIDS} & set(files))


def path_of(given: object) -> Path | None:
    """Return the file that a design is read from, if it is one."""
    source = given.surface if isinstance(given, Unwelded) else given
    return Path(os.fsdecode(source)) if isinstance(source, str | os.PathLike) else None


def _certificate(place: Path) -> list[str] | None:
    """Return the files that an earlier run wrote; None if there was none."""
    try:
        return [str(n) for n in json.loads((place / CERTIFICATE).read_text("utf-8"))["files"]]
    except (OSError, ValueError, KeyError, TypeError):
        return None

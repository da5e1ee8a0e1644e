"""The manifest of a dataset: its recipe, package versions, files and statistics."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

from gso.errors import DatasetError
from gso.io.json_file import write_json
from gso.typing import Json

NAME = "manifest.json"
FORMAT = 1

#: (reference, split).
References = set[tuple[str, str]]


def load(folder: Path) -> Json:
    """Read a manifest.

    Raises
    ------
    DatasetError
        The manifest is missing, damaged, or of another format.
    """
    path = folder / NAME
    try:
        record: Json = json.loads(path.read_bytes())
        if record["format"] != FORMAT:
            raise DatasetError(f"{path} is of format {record['format']}, not {FORMAT}")
        if not isinstance(record["files"], list):
            raise DatasetError(f"{path} is damaged: it lists no files")
    except (OSError, ValueError, KeyError, TypeError) as error:
        if isinstance(error, DatasetError):
            raise
        raise DatasetError(f"{path} is missing or damaged: {error}") from None
    return record


def write(folder: Path, record: Json) -> None:
    """Write a manifest atomically."""
    write_json(folder / NAME, record)


def pairs(record: Json) -> References:
    """Return the pairs of reference and split in a manifest."""
    return {(name, split) for name, splits in record["references"].items() for split in splits}


def damaged(folder: Path, record: Json) -> list[str]:
    """Return the files that are missing or do not match their checksum in the manifest."""
    return [entry["name"] for entry in record["files"] if not _good(folder, entry)]


def _good(folder: Path, entry: Json) -> bool:
    try:
        content = (folder / entry["name"]).read_bytes()
    except OSError:
        return False
    return hashlib.sha256(content).hexdigest() == str(entry["sha256"])

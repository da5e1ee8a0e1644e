"""What was made of each design, kept in files so that a run that was ended goes on."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np

from gso import io
from gso.errors import MeshError
from gso.workshop.asking import Ask
from gso.workshop.certificate import digest, plain
from gso.workshop.designs import Design
from gso.workshop.making import made
from gso.workshop.panels import Made

#: Version of the files; those of another one are made again.
_FORMAT = 2


def key(design: Design, ask: Ask) -> str:
    """Return what identifies the work on a design: its digest and what was asked."""
    own = [digest(design.mesh), design.kept.tolist()]
    said = json.dumps([_FORMAT, *own, plain(ask.record())], sort_keys=True)
    return hashlib.sha256(said.encode()).hexdigest()


def store(one: Made, own: str, path: Path) -> None:
    """Write what was made; it replaces the file when it is complete."""
    record = np.frombuffer(json.dumps([own, plain(one.record)]).encode(), np.uint8)
    with io.replacing(path) as file:
        np.savez_compressed(file, record=record, **one.arrays())


def work_on(ask: Ask, folder: str, design: Design) -> str:
    """Make one design and store it; for worker processes."""
    store(made(design, ask), key(design, ask), Path(folder) / f"{design.name}.npz")
    return design.name


def stored(name: str, own: str, path: Path) -> Made | None:
    """Read what was made; None if there is nothing, or of another design or request."""
    from gso.io.arrays import read_arrays

    try:
        data = read_arrays(path.read_bytes())
        said, record = json.loads(data["record"].tobytes())
        return Made.from_arrays(name, data, record) if said == own else None
    except (OSError, KeyError, ValueError, MeshError):
        # A file that is missing or damaged is made again.
        return None

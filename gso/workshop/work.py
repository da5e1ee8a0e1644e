"""What was made of each design, kept in files so that a run that was ended goes on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np

from gso import io
from gso.constraints import record_of
from gso.errors import MeshError
from gso.executors import open_executor
from gso.io.json_file import plain
from gso.typing import Keywords
from gso.verdict import Reason
from gso.workshop.certificate import digest
from gso.workshop.design_panels import made
from gso.workshop.designs import Design
from gso.workshop.fabrication_settings import FabricationSettings
from gso.workshop.panels import Made

#: Version of the files; those of another one are made again.
_FORMAT = 10


def key(design: Design, settings: FabricationSettings) -> str:
    """Return what identifies the work on a design: its digest and what was asked."""
    edges = [ids.tolist() for ids in (design.kept, design.uncut, design.along, design.avoid)]
    held = [record_of(constraint) for constraint in design.constraints]
    own = [digest(design.mesh), *edges, design.sheet, held]
    said = json.dumps([_FORMAT, version("gso"), *own, plain(settings.record())], sort_keys=True)
    return hashlib.sha256(said.encode()).hexdigest()


def store(one: Made, own: str, path: Path) -> None:
    """Write what was made; it replaces the file when it is complete."""
    said = [own, plain(one.record), [reason.record() for reason in one.reasons]]
    record = np.frombuffer(json.dumps(said).encode(), np.uint8)
    whole: Keywords = {"record": record, **one.arrays()}
    with io.replacing(path) as file:
        np.savez_compressed(file, **whole)


def work_on(
    settings: FabricationSettings,
    folder: Path,
    design: Design,
    say: Callable[[str], None] = lambda said: None,
    workers: int | None = 0,
) -> None:
    """Make one design and store it; in worker processes too."""
    one = made(design, settings, say, workers)
    store(one, key(design, settings), folder / f"{design.name}.npz")


def stored(name: str, own: str, path: Path) -> Made | None:
    """Read what was made; None if there is nothing, or of another design or request."""
    from gso.io.arrays import read_arrays

    try:
        data = read_arrays(path.read_bytes())
        said, record, reasons = json.loads(data["record"].tobytes())
        if said != own:
            return None
        made_before = Made.from_arrays(name, data, record)
        return replace(made_before, reasons=tuple(map(Reason.read, reasons)))
    except (OSError, KeyError, ValueError, MeshError):
        # A file that is missing or damaged is made again.
        return None


def made_all(
    designs: Sequence[Design],
    chosen: Iterable[int],
    settings: FabricationSettings,
    folder: Path,
    workers: int | None,
    scheduler: str | None,
    say: Callable[[str], None],
) -> tuple[dict[int, Made], dict[int, str]]:
    """Make designs, or read what an earlier call made; return what failed too."""
    found: dict[int, Made] = {}
    failed: dict[int, str] = {}
    todo = []

    def read(design: Design) -> Made | None:
        return stored(design.name, key(design, settings), folder / f"{design.name}.npz")

    for k in chosen:
        one = read(designs[k])
        if one is None:
            todo.append(k)
        else:
            found[k] = one
    # The largest first, so that no large one runs alone at the end.
    todo.sort(key=lambda k: -len(designs[k].mesh.vertices))
    here = scheduler is None and (workers == 0 or len(todo) == 1)
    work = partial(work_on, settings, folder.resolve())
    if here:
        work = partial(work, say=say, workers=workers)
    items = (designs[k] for k in todo)
    total = len(found) + len(todo)
    say(f"designs: {len(found)} of {total}")
    with open_executor(0 if here else workers, scheduler) as executor:
        for done in executor.as_completed(work, items):
            k = todo[done.index]
            one = read(designs[k]) if done.ok else None
            if one is None:
                lost = "its file in the folder work is missing; is the folder shared?"
                failed[k] = done.error or lost
            else:
                found[k] = one
            say(f"designs: {len(found) + len(failed)} of {total}")
    return found, failed

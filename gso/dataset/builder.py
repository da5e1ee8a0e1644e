"""Build a set: streaming, resumable, the same bytes whatever happened on the way.

A folder holds files of :data:`gso.dataset.shard.LENGTH` surfaces each, and a manifest. A file
appears under its name only when it is complete, and its content depends on the recipe
alone; so a build that was killed goes on with the files that are not there. The manifest
gets its checksums and statistics last.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, contextmanager
from functools import partial
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from typing import Any

from gso.dataset import cluster, hdf, manifest, shard
from gso.dataset.claim import claimed
from gso.dataset.labels import KINDS, REFERENCES
from gso.dataset.recipe import Recipe, versions
from gso.dataset.screen import Selection, select
from gso.dataset.store import Dataset
from gso.dataset.summary import summarise
from gso.io import replacing
from gso.spelling import choices, known_keywords
from gso.status import DatasetError, MeshError, OptionError
from gso.tno import pool
from gso.tno.linear import blas_threads

_OTHER_RECIPE = "give its own options, or another folder"
_OTHER_VERSIONS = "install what it was begun with, or build in another folder"

#: (what is counted, how many there are, how many there will be).
Tick = Callable[[str, int, int], None]


@known_keywords()
def build(
    folder: str | PathLike[str],
    recipe: Recipe | None = None,
    *,
    reference: Iterable[str] = (),
    reference_splits: Iterable[str] = ("test",),
    workers: int | None = None,
    scheduler: str | None = None,
    tick: Tick | None = None,
) -> Dataset:
    """Build a set, or what is missing of it.

    Parameters
    ----------
    folder : path
        Where; new, empty, or with a set of the same recipe, whole or in part.
    recipe : Recipe, optional
        What it is made of; the published size when not given.
    reference : iterable of {"jiang2020"}
        References to add to some splits, now or to a set that is there already.
    reference_splits : iterable of str
        Splits that get them.
    workers : int, optional
        Processes; the number of cores when not given, 0 for none (in this process).
    scheduler : str, optional
        Address of a Dask cluster that does the work instead.
    tick : callable, optional
        Told what is counted, how many there are, and how many there will be.

    Returns
    -------
    Dataset

    Raises
    ------
    OptionError
        A reference or split is unknown.
    DatasetError
        The folder holds something else or another recipe, another build is at work in it,
        packages have changed since it was begun, the disk is full, a worker died on a file
        repeatedly. Files that are complete stay.

    Examples
    --------
    >>> import tempfile
    >>> recipe = Recipe(n=10, size=16, labels=("strain",), extras=False)
    >>> data = build(tempfile.mkdtemp(), recipe, workers=0)
    >>> data["train"].arrays["surface"].shape
    (8, 16, 16, 3)
    """
    recipe = Recipe() if recipe is None else recipe
    wanted = _references(recipe, reference, reference_splits)
    if find_spec("h5py") is None or find_spec("filelock") is None:
        raise DatasetError(
            'datasets need h5py and filelock: pip install ".[dataset]" in the folder of gso'
        )
    place = Path(folder)
    with claimed(place):
        with _kept():
            record = _begin(place, recipe)
        bad = manifest.damaged(place, record)
        if record["complete"] and wanted <= manifest.pairs(record) and not bad:
            return Dataset(place)
        _check_same(place, record, "versions", versions(), _OTHER_VERSIONS)
        wanted |= manifest.pairs(record)
        with blas_threads(1):
            selection = select(
                recipe.n,
                recipe.splits["hard"],
                seed=recipe.seed,
                tick=None if tick is None else partial(tick, "surfaces drawn"),
            )
        everything = list(tasks(recipe, selection, wanted))
        for part in (shard.LABELS, *REFERENCES):
            todo = [task for task in everything if task.part == part]
            _make(place, recipe, todo, set(bad), workers, scheduler, tick)
        with _kept():
            record = _listed(place, record, recipe, everything, wanted, selection.drawn)
            record["summary"] = summarise(Dataset(place, record))
            manifest.write(place, record | {"complete": True})
    return Dataset(place)


def tasks(
    recipe: Recipe, selection: Selection, references: Iterable[tuple[str, str]]
) -> Iterator[shard.Task]:
    """Every file of a set."""
    first = 0
    asked = set(references)
    for split, count in recipe.splits.items():
        if split == "hard":
            ids = selection.hard.tolist()
        elif first < recipe.n:
            ids = selection.main[first : first + count].tolist()
            first += count
        else:
            ids = list(range(count))
        parts = [shard.LABELS, *(r for r in REFERENCES if (r, split) in asked)]
        for number, start in enumerate(range(0, count, shard.LENGTH)):
            some = tuple(ids[start : start + shard.LENGTH])
            yield from (shard.Task(split, number, some, part) for part in parts)


def _begin(folder: Path, recipe: Recipe) -> dict[str, Any]:
    """The manifest that is there, or that of a new set.

    Raises
    ------
    DatasetError
        It is that of another recipe.
    """
    record = {
        "format": manifest.FORMAT,
        "recipe": recipe.as_dict(),
        "versions": versions(),
        "references": {},
        "files": [],
        "complete": False,
    }
    # As it will be read: lists for tuples.
    record = json.loads(json.dumps(record))
    if not (folder / manifest.NAME).exists():
        manifest.write(folder, record)
        return record
    there = manifest.load(folder)
    _check_same(folder, there, "recipe", record["recipe"], _OTHER_RECIPE)
    return there


def _check_same(
    folder: Path, there: dict[str, Any], what: str, new: dict[str, Any], hint: str
) -> None:
    """Refuse to go on with a set that was begun otherwise."""
    old = there[what]
    said = [f"{k} {old.get(k)!r}, not {v!r}" for k, v in new.items() if old.get(k) != v]
    if said:
        raise DatasetError(f"{folder} holds a set with {', '.join(said)}; {hint}")


def _references(
    recipe: Recipe, names: Iterable[str], splits: Iterable[str]
) -> set[tuple[str, str]]:
    """Pairs of reference and split that are asked for, checked."""
    from gso import tno

    asked = {(name, split) for name in names for split in splits}
    for name, split in sorted(asked):
        if name not in REFERENCES:
            raise OptionError(f"no reference {name!r}; there is {', '.join(REFERENCES)}")
        if split not in recipe.splits:
            raise OptionError(f"no split {split!r}; {choices(split, recipe.splits)}")
        tno.check(**KINDS[name].arguments)
    return asked


def _make(
    place: Path,
    recipe: Recipe,
    todo: list[shard.Task],
    bad: set[str],
    workers: int | None,
    scheduler: str | None,
    tick: Tick | None,
) -> None:
    """Make the files that are bad or not there."""
    missing = [task for task in todo if task.name in bad or not _intact(place, task)]
    total = sum(len(task.ids) for task in todo)
    done = total - sum(len(task.ids) for task in missing)
    if not missing:
        return
    reference = missing[0].part != shard.LABELS
    what = f"surfaces with {missing[0].part}" if reference else "surfaces labelled"
    if tick is not None:
        tick(what, done, total)
    work = partial(shard.make, recipe, versions())
    if scheduler is not None:
        results = cluster.spread(work, missing, scheduler=scheduler)
    else:
        results = pool.spread(work, missing, workers=workers)
    with closing(results):
        for result in results:
            task = missing[result.index]
            if result.error is not None:
                raise DatasetError(
                    f"{task.name}: {result.error}; {done} of {total} {what}, which are kept"
                )
            with _kept(f"; {done} of {total} {what}"):
                path = place / task.name
                path.parent.mkdir(exist_ok=True)
                with replacing(path) as file:
                    file.write(result.value)
            done += len(task.ids)
            if tick is not None:
                tick(what, done, total)


def _intact(place: Path, task: shard.Task) -> bool:
    """Whether a file is there and can be opened."""
    path = place / task.name
    if not path.exists():
        return False
    try:
        hdf.contents(path)
    except DatasetError:
        return False
    return True


@contextmanager
def _kept(so_far: str = "") -> Iterator[None]:
    """Say of an error in writing that nothing is lost."""
    try:
        yield
    except (OSError, MeshError) as error:
        raise DatasetError(
            f"{error}{so_far}, and nothing of it is lost; make room, then build again with the "
            "same options"
        ) from None


def _listed(
    folder: Path,
    record: dict[str, Any],
    recipe: Recipe,
    todo: Iterable[shard.Task],
    references: manifest.References,
    drawn: int,
) -> dict[str, Any]:
    """Manifest of a set whose files are all there, but for its statistics."""
    files = []
    for task in todo:
        content = (folder / task.name).read_bytes()
        files.append(
            {
                "name": task.name,
                "split": task.split,
                "part": task.part,
                "count": len(task.ids),
                "bytes": len(content),
                "sha256": hashlib.sha256(content).hexdigest(),
            }
        )
    splits = {
        name: [s for s in recipe.splits if (name, s) in references]
        for name in sorted({name for name, _ in references})
    }
    return {key: record[key] for key in ("format", "recipe", "versions")} | {
        "references": splits,
        "reference_options": {name: KINDS[name].options for name in splits},
        "splits": recipe.splits,
        "drawn": drawn,
        "files": files,
    }

"""Resumable, byte-reproducible builds of datasets.

A dataset is a folder with a manifest and files of :data:`gso.dataset.shard.LENGTH` surfaces
each. Files are written atomically, and their content depends only on the recipe. A resumed
build therefore makes only the missing files. Checksums and statistics are added to the
manifest last.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib.util import find_spec
from pathlib import Path

from gso import tno
from gso.dataset import hdf, manifest, shard
from gso.dataset.claim import claimed
from gso.dataset.labels import KINDS, REFERENCES
from gso.dataset.recipe import Recipe, versions
from gso.dataset.screen import Selection, select
from gso.dataset.store import Dataset
from gso.dataset.summary import summarise
from gso.errors import DatasetError, MeshError, OptionError
from gso.executors import Executor, open_executor
from gso.io.atomic import write_bytes
from gso.linalg import blas_threads
from gso.spelling import choices
from gso.typing import AnyPath, Json

_OTHER_RECIPE = "give its own options, or another folder"
_OTHER_VERSIONS = "install what it was begun with, or build in another folder"

#: Progress callback: (name of the counted items, number done, total number).
Tick = Callable[[str, int, int], None]


def build(
    folder: AnyPath,
    recipe: Recipe | None = None,
    *,
    reference: Iterable[str] = (),
    reference_splits: Iterable[str] = ("test",),
    workers: int | None = None,
    scheduler: str | None = None,
    device: str | None = None,
    tick: Tick | None = None,
) -> Dataset:
    """Build a dataset, or its missing files.

    Parameters
    ----------
    folder : path
        Folder of the dataset: new, empty, or with a complete or partial dataset of the same
        recipe.
    recipe : Recipe, optional
        Definition of the dataset; ``Recipe()``, with the published size, by default.
    reference : iterable of {"jiang2020"}
        Reference labels to add to some splits; an existing dataset can be extended.
    reference_splits : iterable of str
        Splits that get the reference labels.
    workers : int, optional
        Number of processes that work at a time; the number of cores by default, 0 for this
        process only. With a graphics processor as many more wait for it meanwhile.
    scheduler : str, optional
        Address of a Dask cluster that does the work instead.
    device : str, optional
        "cpu", "cuda" ...: label the surfaces of each file in a batch, by
        :func:`gso.tno.optimize_batch`. The labels are the same up to rounding errors and what
        the iterations make of them; on a graphics processor the rounding errors may differ from
        build to build. Reference labels are made one by one.
    tick : callable, optional
        Progress callback, called with the name of the counted items, the number done and the
        total number.

    Returns
    -------
    Dataset

    Raises
    ------
    OptionError
        A reference or split is unknown, or there is no such device.
    BackendError
        A device is given, and PyTorch is not installed.
    DatasetError
        The folder holds something else, another recipe or labels made on another device,
        another build is running in it, package versions have changed since the build began,
        the disk is full, or a worker process died repeatedly on the same file. Complete files
        are kept.

    Examples
    --------
    >>> import tempfile
    >>> recipe = Recipe(n=10, size=16, labels=("strain",), extras=False)
    >>> data = build(tempfile.mkdtemp(), recipe, workers=0)
    >>> data["train"].arrays["surface"].shape
    (8, 16, 16, 3)
    """
    recipe = Recipe() if recipe is None else recipe
    tick = tick or (lambda what, count, total: None)
    wanted = _references(recipe, reference, reference_splits)
    if find_spec("h5py") is None or find_spec("filelock") is None:
        raise DatasetError(
            'datasets need h5py and filelock: pip install ".[dataset]" in the folder of gso'
        )
    if device is not None and scheduler is None:
        _check_device(device)
    place = Path(folder)
    with claimed(place):
        with _kept():
            record = _begin(place, recipe, device)
        # A set goes on with the device that it was begun with.
        if device is None and record.get("device") is not None:
            device = record["device"]
            if scheduler is None:
                _check_device(device)
        bad = manifest.damaged(place, record)
        if record["complete"] and wanted <= manifest.pairs(record) and not bad:
            return Dataset(place)
        _check_same(place, record, "versions", versions(device), _OTHER_VERSIONS)
        wanted |= manifest.pairs(record)
        with blas_threads(1):
            selection = None if recipe.broad else _selected(recipe, tick)
        everything = list(tasks(recipe, selection, wanted))
        for part in (shard.LABELS, *REFERENCES):
            todo = [task for task in everything if task.part == part]
            # References are made one by one, without a device.
            own = device if part == shard.LABELS else None
            with _opened(workers, scheduler, own, recipe.size) as (executor, elsewhere):
                work = partial(
                    shard.make, recipe, versions(device), device=device, elsewhere=elsewhere
                )
                _make(place, work, todo, set(bad), executor, tick)
        with _kept():
            drawn = recipe.n if selection is None else selection.drawn
            record = _listed(place, record, recipe, everything, wanted, drawn)
            record["summary"] = summarise(Dataset(place, record))
            manifest.write(place, record | {"complete": True})
    return Dataset(place)


def _selected(recipe: Recipe, tick: Tick) -> Selection:
    return select(
        recipe.n,
        recipe.splits["hard"],
        seed=recipe.seed,
        strata=recipe.strata,
        tick=partial(tick, "surfaces drawn"),
    )


def tasks(
    recipe: Recipe, selection: Selection | None, references: Iterable[tuple[str, str]]
) -> Iterator[shard.Task]:
    """Yield one task per file of a dataset; the broad set has no selection."""
    first = 0
    asked = set(references)
    for split, count in recipe.splits.items():
        if selection is None:
            ids = list(range(count))
        elif split == "hard":
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


def _begin(folder: Path, recipe: Recipe, device: str | None) -> Json:
    """Return the existing manifest, or write and return that of a new dataset.

    Raises
    ------
    DatasetError
        The existing manifest has another recipe, or labels made on another device.
    """
    record: Json = {
        "format": manifest.FORMAT,
        "recipe": recipe.as_dict(),
        "versions": versions(device),
        "references": {},
        "files": [],
        "complete": False,
    }
    if device is not None:
        record["device"] = device.partition(":")[0]
    # A JSON round trip converts tuples to lists, for comparison with a manifest from disk.
    record = json.loads(json.dumps(record))
    if not (folder / manifest.NAME).exists():
        manifest.write(folder, record)
        return record
    there = manifest.load(folder)
    _check_same(folder, there, "recipe", record["recipe"], _OTHER_RECIPE)
    made, asked = there.get("device"), record.get("device")
    if asked is not None and made != asked:
        begun = "without --device" if made is None else f"with --device {made}"
        raise DatasetError(
            f"{folder} holds a set that was begun {begun}, not with --device {asked}; "
            f"{_OTHER_RECIPE}"
        )
    return there


def _check_same(folder: Path, there: Json, what: str, new: Json, hint: str) -> None:
    """Raise a DatasetError if `new` differs from the existing manifest's entry `what`."""
    old = there[what]
    said = [f"{k} {old.get(k)!r}, not {v!r}" for k, v in new.items() if old.get(k) != v]
    if said:
        raise DatasetError(f"{folder} holds a set with {', '.join(said)}; {hint}")


def _references(
    recipe: Recipe, names: Iterable[str], splits: Iterable[str]
) -> set[tuple[str, str]]:
    """Return the requested pairs of reference and split, checked."""
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
    work: Callable[[shard.Task], bytes],
    todo: list[shard.Task],
    bad: set[str],
    executor: Executor,
    tick: Tick,
) -> None:
    """Make the files that are missing or damaged."""
    missing = [task for task in todo if task.name in bad or not _intact(place, task)]
    total = sum(len(task.ids) for task in todo)
    done = total - sum(len(task.ids) for task in missing)
    if not missing:
        return
    reference = missing[0].part != shard.LABELS
    what = f"surfaces with {missing[0].part}" if reference else "surfaces labelled"
    tick(what, done, total)
    for made in executor.as_completed(work, missing):
        task = missing[made.index]
        if made.result is None:
            raise DatasetError(
                f"{task.name}: {made.error}; {done} of {total} {what}, which are kept"
            )
        with _kept(f"; {done} of {total} {what}"):
            path = place / task.name
            path.parent.mkdir(exist_ok=True)
            write_bytes(path, made.result)
        done += len(task.ids)
        tick(what, done, total)


def _check_device(device: str) -> None:
    """Raise an OptionError if there is no such device, or a BackendError without PyTorch."""
    from gso.tno.batched.device import check_device

    check_device(device)


@contextmanager
def _opened(
    workers: int | None, scheduler: str | None, device: str | None, size: int
) -> Iterator[tuple[Executor, bool]]:
    """Open what makes files, and tell whether this process minimises for it."""
    if scheduler is not None or workers == 0 or device is None or device.startswith("cpu"):
        with open_executor(workers, scheduler, main=True) as executor:
            yield executor, False
        return
    from gso.tno.batched.many import planners

    # Workers label different surfaces at a time, so that few stages are ready together.
    with planners(device, size**2, workers, enough=0.25) as executor:
        yield executor, True


def _intact(place: Path, task: shard.Task) -> bool:
    """Tell whether a file exists and can be opened."""
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
    """Convert write errors to a DatasetError which says that complete files are kept."""
    try:
        yield
    except (OSError, MeshError) as error:
        raise DatasetError(
            f"{error}{so_far}, and nothing of it is lost; make room, then build again with the "
            "same options"
        ) from None


def _listed(
    folder: Path,
    record: Json,
    recipe: Recipe,
    todo: Iterable[shard.Task],
    references: manifest.References,
    drawn: int,
) -> Json:
    """Return the manifest of a dataset whose files all exist, without its statistics."""
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
    kept = ("format", "recipe", "versions", "device")
    return {key: record[key] for key in kept if key in record} | {
        "references": splits,
        "reference_options": {name: KINDS[name].options for name in splits},
        "splits": recipe.splits,
        "drawn": drawn,
        "files": files,
    }

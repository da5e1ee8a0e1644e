"""``gso optimize`` on many files in parallel: one line per file, errors do not stop the rest."""

from __future__ import annotations

import os
import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gso.cli import progress, report
from gso.cli import shared_options as shared
from gso.errors import GSOError, MeshError, OptionError
from gso.io.json_file import write_json

if TYPE_CHECKING:
    from gso.cli.optimize_job import Job


def many(
    job: Job,
    files: tuple[str, ...],
    folder: str,
    *,
    suffix: str | None,
    plot: str | None,
    table: str | None,
    workers: int | None,
    scheduler: str | None = None,
    as_json: bool = False,
) -> bool:
    """Optimise files into a folder, and return whether all results are usable."""
    outs = _outputs(files, folder, suffix)
    pictures = [None if plot is None else str(Path(plot, f"{Path(o).stem}.png")) for o in outs]
    _each_its_own(files, [p for p in pictures if p is not None])
    job.spare(files, *outs, *pictures, table)
    for path in filter(None, (folder, plot)):
        _make_folder(path)
    for out, picture in zip(outs, pictures, strict=True):
        job.check(out, picture)
    if workers is None:
        from gso.executors.base import useful_workers

        workers = useful_workers(len(files))
    records: dict[int, dict[str, Any]] = {}
    with closing(progress.Counts()) as bar, report.status_only():
        bar.tick("files", 0, len(files))
        for item in job.solve_many(files, workers, scheduler):
            file, out = files[item.index], outs[item.index]
            try:
                if item.result is None:
                    raise MeshError(item.error or "failed")
                job.write(item.result, out, pictures[item.index])
                done = report.record(file, out, item.result, job.named)
                if not as_json and not (job.quiet and done["usable"]):
                    bar.write(report.line(done), file=sys.stderr if job.quiet else sys.stdout)
            except GSOError as error:
                done = {"input": file, "usable": False, "error": str(error)}
                bar.write(f"gso: error: {_named(file, str(error))}", file=sys.stderr)
            records[item.index] = done
            bar.tick("files", len(records), len(files))
    ordered = [records[k] for k in sorted(records)]
    if table is not None:
        write_json(table, ordered)
    if as_json:
        shared.tell_json(ordered)
    good = sum(bool(r["usable"]) for r in records.values())
    if not job.quiet and not as_json:
        click.echo(f"{good} of {len(files)} results usable")
    return good == len(files)


def _outputs(files: tuple[str, ...], folder: str, suffix: str | None) -> list[str]:
    """Return the output path of each input: its name in the folder.

    Raises
    ------
    OptionError
        Two inputs have the same output path.
    """
    if suffix is not None and not suffix.startswith("."):
        suffix = f".{suffix}"
    outs = [
        str(Path(folder, Path(f).name if suffix is None else f"{Path(f).stem}{suffix}"))
        for f in files
    ]
    _each_its_own(files, outs)
    return outs


def _each_its_own(files: tuple[str, ...], outs: list[str]) -> None:
    """Raise an OptionError if two inputs have the same output path."""
    owner: dict[str, str] = {}
    for file, out in zip(files, outs, strict=False):
        place = os.path.realpath(out)
        if place in owner:
            raise OptionError(f"{owner[place]} and {file} would both be written to {out}")
        owner[place] = file


def _make_folder(path: str) -> None:
    try:
        os.makedirs(path, exist_ok=True)
    except OSError as error:
        raise MeshError(f"{path}: cannot be made a folder: {error.strerror or error}") from None


def _named(file: str, message: str) -> str:
    """Return the message in one line that begins with the file's name."""
    message = " ".join(message.split())
    return message if message.startswith(file) else f"{file}: {message}"

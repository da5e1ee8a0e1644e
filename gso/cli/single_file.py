"""A command on one file: read, solve, write, print."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso.cli import file_options
from gso.cli import shared_options as shared
from gso.cli.page_file import write_page
from gso.errors import MeshError, OptionError

if TYPE_CHECKING:
    from gso.cli.optimize_job import Job

#: Vertices up to which a single surface is optimised without compiled loops.
_SMALL = 20_000


def single(
    job: Job,
    file: str,
    out: str,
    *,
    plot: str | None,
    page: str | None,
    table: str | None,
    as_json: bool = False,
) -> bool:
    """Solve for one file, and return whether the result is usable."""
    if out == file_options.STANDARD and as_json:
        raise OptionError("-o - and --json would both write to standard output; give one of them")
    with file_options.written(out) as path:
        return _single(job, file, out, path, plot, page, table, as_json)


def _single(
    job: Job,
    file: str,
    out: str,
    path: str,
    plot: str | None,
    page: str | None,
    table: str | None,
    as_json: bool,
) -> bool:
    from gso.cli import report
    from gso.cli.progress import iterations
    from gso.io.json_file import write_json
    from gso.solver import loops

    job.check(path, plot)
    job.spare([file], path, plot, page, table)
    mesh = file_options.load(file, job.weld)
    if path.lower().endswith(".npy") and mesh.grid_shape is None:
        raise MeshError(f"{out}: the mesh is no grid, which is all that .npy holds; use .npz")
    far = job.keywords.get("max_deviation")
    shared.tell_size(mesh, job.unit, far, job.quiet, drawn=path.lower().endswith(".svg"))
    # For one solve of a small mesh, loading compiled loops takes longer than they save.
    small = len(mesh.vertices) <= _SMALL
    with iterations() as callback, report.status_only(), loops.without(small):
        result = job.solve(mesh, callback=callback)
    job.write(result, path, plot)
    if page is not None:
        write_page(result, file, page, job.unit)
    record = report.record(file, out, result, job.named)
    if table is not None:
        write_json(table, record)
    if as_json:
        shared.tell_json(record)
    else:
        aside = out == file_options.STANDARD
        shared.tell(report.text(record).splitlines(), quiet=job.quiet, aside=aside)
    return bool(record["usable"])

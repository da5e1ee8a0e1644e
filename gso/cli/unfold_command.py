"""``gso unfold``: the net of a surface of flat faces, with its folds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from gso.cli import file_options
from gso.cli import shared_options as shared
from gso.cli.commands import Command
from gso.cli.page_file import write_page
from gso.errors import OptionError

if TYPE_CHECKING:
    from gso.mesh import Mesh
    from gso.typing import Ints, Json
    from gso.unfolding import Net


@click.command(
    cls=Command,
    short_help="Make the net of a surface of flat faces.",
    example="gso unfold house.obj -o house.pdf --paper A4 --tabs 5\n"
    "lays flat faces out in one plane, with lines to bend along",
)
@click.argument("name", metavar="IN", type=click.Path())
@shared.output(
    "Drawing to write, .svg, .dxf or .pdf: the parts at 1:1 with layers to cut and to fold. In a "
    "PDF each part that fits has a page of its own.",
)
@shared.cut
@shared.keep
@shared.keep_groups
@shared.sheet
@click.option(
    "--flat-angle",
    metavar="DEGREES",
    type=float,
    default=0.01,
    help="Edges with smaller angles are no folds.",
)
@click.option("--effort", metavar="X", default=1.0, help="Factor of the time of the search.")
@click.option("--seed", metavar="N", type=click.IntRange(0), default=0, help="Of the search.")
@shared.tabs
@shared.numbers
@click.option(
    "--paper",
    metavar="A4",
    help="Pages of the PDF; without --sheet parts are divided so that each fits one if it can.",
)
@shared.page
@shared.unit
@shared.scale
@shared.height
@shared.up
@file_options.weld
@file_options.chord
@file_options.force
@shared.as_json
@shared.quiet
def unfold(
    name: str,
    out: str,
    cut: tuple[tuple[int, int], ...],
    keep: tuple[tuple[int, int], ...],
    keep_groups: bool,
    sheet: tuple[float, float] | None,
    flat_angle: float,
    effort: float,
    seed: int,
    tabs: float | None,
    numbers: str | None,
    paper: str | None,
    page: str | None,
    unit: str,
    scale: float | None,
    height: str | float | None,
    up: str,
    weld: float | None,
    force: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Cut the surface IN along edges, lay its flat faces out, and draw them to OUT.

    The shape stays as it is. The parts are as few as are found, and do not overlap. Mountain and
    valley folds are in layers of their own.
    """
    from dataclasses import replace

    import numpy as np

    from gso import io
    from gso.quantities import millimetres
    from gso.seams import Labels
    from gso.unfolding import unfold as make
    from gso.workshop import Finish, drawn, of_net, writers
    from gso.workshop.names import spelled
    from gso.workshop.part_notes import book_notes, page_notes
    from gso.workshop.writers.pdf import SUFFIX, room

    writer = writers.check_output(out)
    if paper is not None and writer.SUFFIX != SUFFIX:
        raise OptionError(f"--paper {paper} needs an output whose name ends in {SUFFIX}")
    file_options.spare([name], [out, page], force)
    finish = Finish(notches=None, tabs=tabs, numbers=numbers)
    edges = np.array(cut, np.int64).reshape(-1, 2)
    # CAD files are meshed once.
    is_cad = io.suffix_of(name) in io.SPLINE_SUFFIXES
    solids = file_options.load(name, weld) if is_cad else None
    mesh = solids or file_options.source(name, weld)
    if keep_groups:
        groups = solids or file_options.load(name, weld)
        edges = np.concatenate([edges, Labels("g").edges(groups)])
    factor = file_options.scale_of([mesh], scale, height, up, unit)

    # Faces that are larger than a page are divided in the PDF; a sheet must be large enough.
    least = sheet or (None if paper is None else room(paper))
    net = make(
        mesh,
        cut=edges,
        keep=np.array(keep, np.int64).reshape(-1, 2),
        sheet=least and finish.room(least, 1.0),
        larger=sheet is None,
        unit=unit,
        scale=factor,
        flat_angle=flat_angle,
        effort=effort,
        seed=seed,
    )
    if solids is not None:
        net = replace(net, notes=(*net.notes, *_both_sides(solids, name)))
    shared.tell_size(net.mesh, unit, None, quiet)
    options = {} if paper is None else {"paper": paper}
    parts = of_net(spelled(Path(name).stem), net)
    drawing, bare = drawn([parts], millimetres(unit), finish)
    if paper is not None:
        bare += [*page_notes(drawing.parts, paper), *book_notes(drawing, paper)]
    writers.write(drawing, out, **options)
    if page is not None:
        write_page(net, name, page, unit, finish=finish)
    if as_json:
        shared.tell_json(record(net, unit) | {"output": out, "notes": [*net.notes, *bare]})
    elif not quiet:
        click.echo("\n".join([*text(net, unit), *(f"note: {note}" for note in bare)]))


def _both_sides(solids: Mesh, name: str) -> list[str]:
    """Say how many solids of a CAD file are sheets, whose net has both sides."""
    from gso.components import split
    from gso.errors import MeshError
    from gso.sheet_metal import sheet_solid

    try:
        sheets = sum(sheet_solid(part.mesh) is not None for part in split(solids))
    except MeshError:
        # A thickness that is not the same everywhere.
        sheets = 1
    if not sheets:
        return []
    return [
        f"solids of sheet metal: {sheets}. Their nets have both sides and the narrow faces; for "
        f"the blank to cut and bend: gso fabricate {name} -o parts"
    ]


def record(net: Net, unit: str) -> Json:
    """Return what was made as plain numbers; areas and lengths are in the unit."""
    return {
        "unit": unit,
        "parts": [
            {"part": k + 1, "area": area, "folds": int(folds)}
            for k, (area, folds) in enumerate(zip(net.areas.tolist(), _folds(net), strict=True))
        ],
        "mountain": int((net.angles > 0).sum()),
        "valley": int((net.angles <= 0).sum()),
        "cut_length": net.cut_length,
    }


def _folds(net: Net) -> Ints:
    """Return the number of folds of each part."""
    import numpy as np

    part = np.empty(len(net.pattern.flat), np.int64)
    part[net.pattern.faces] = net.part[:, None]
    return np.bincount(part[net.folds.edges[:, 0]], minlength=len(net))


def text(net: Net, unit: str) -> list[str]:
    """Format what was made as a table."""
    from gso.cli.report import columns

    folds = _folds(net)
    rows: list[tuple[str, ...]] = [("part", f"area {unit}2", "folds")]
    for k, area in enumerate(net.areas.tolist()):
        rows.append((str(k + 1), f"{area:.6g}", str(folds[k])))
    lines = columns(rows)
    up = int((net.angles > 0).sum())
    lines.append(
        f"parts: {len(net)}; folds: {up} mountain, {len(net.angles) - up} valley; "
        f"length of the cuts: {net.cut_length:.6g} {unit}"
    )
    return [*lines, *(f"note: {note}" for note in net.notes)]

"""``gso pieces``: cut a design into pieces that can be laid flat."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gso.cli import file_options
from gso.cli import shared_options as shared
from gso.cli.commands import Command
from gso.cli.page_file import write_page
from gso.errors import OptionError

if TYPE_CHECKING:
    from gso.seams import Segmentation

#: Name of the page in the folder.
PAGE = "index.html"


@click.command(
    cls=Command,
    short_help="Cut a design into pieces that can be laid flat.",
    example="gso pieces bunny.obj -o pieces --max-deviation 2mm\n"
    "finds few pieces within 2 mm that can be laid flat",
)
@click.argument("name", metavar="IN", type=click.Path())
@shared.output(
    "Folder to write to: the pieces as groups of an OBJ file, their patterns at 1:1 (SVG), a "
    "picture, the table (JSON), and index.html, a page to look at.",
    "folder",
    "DIR",
)
@shared.max_strain
@shared.max_deviation
@shared.max_pieces
@click.option(
    "--seam", metavar="X", type=float, help="Budget of all seams, relative to the root of the area."
)
@shared.darts
@shared.symmetric
@shared.min_neck
@shared.min_size
@shared.seams_along("--along")
@shared.avoid
@shared.sheet
@shared.keep_groups
@click.option("--denoise", is_flag=True, help="Denoise the design first, such as a scan.")
@click.option(
    "--denoise-auto",
    is_flag=True,
    help="Denoise the design only if it is noisy, and no farther than its noise is large.",
)
@shared.seam_effort
@shared.unit
@shared.workers
@file_options.weld
@file_options.chord
@file_options.force
@shared.as_json
@shared.quiet
def pieces(
    name: str,
    folder: str,
    weld: float | None,
    force: bool,
    as_json: bool,
    quiet: bool,
    keep_groups: bool,
    denoise: bool,
    denoise_auto: bool,
    along: str | None,
    avoid: str | None,
    **given: Any,
) -> None:
    """Find seams of the design IN, and write its pieces and their patterns to DIR.

    Without --max-deviation the shape stays as it is; --max-strain is then 1 % when it is not given.
    With it the shape changes within that distance; --max-strain is then 0.1 % when it is not given.
    The exit code is 0 only if the pieces are what was asked for; otherwise the reasons are
    printed.
    """
    from gso import plot
    from gso.cli.progress import words
    from gso.seams import Groups
    from gso.seams import pieces as search
    from gso.seams.piece_files import record, save

    if denoise and denoise_auto:
        raise OptionError("--denoise and --denoise-auto exclude each other; give one of them")
    given["denoise"] = "auto" if denoise_auto else denoise
    if os.path.isfile(folder):
        raise OptionError(f"{folder} is a file; -o names a folder")
    outputs = [os.path.join(folder, end) for end in ("pieces.obj", "pieces.json", PAGE)]
    file_options.spare([name, along, avoid], outputs, force)
    mesh = file_options.source(name, weld)
    given |= {
        "along": file_options.lines("--along", along),
        "avoid": file_options.lines("--avoid", avoid),
    }
    with words() as say:
        found = search(mesh, keep=Groups() if keep_groups else None, callback=say, **given)
    shared.tell_size(found.design, given["unit"], given["max_deviation"], quiet)
    save(found, folder, given["unit"])
    if plot.available():
        try:
            plot.plot_pieces(found, os.path.join(folder, "pieces.png"))
        except ImportError as error:
            click.echo(f"note: no picture, as Matplotlib cannot be imported: {error}", err=True)
    if found.known_pattern is not None:
        write_page(found, name, os.path.join(folder, PAGE), given["unit"])
    else:
        # That of other pieces.
        Path(folder, PAGE).unlink(missing_ok=True)
    if as_json:
        shared.tell_json(record(found, given["unit"]))
    else:
        shared.tell(text(found, given["unit"]), quiet=quiet)
    click.get_current_context().exit(0 if found.usable else 1)


def text(found: Segmentation, unit: str) -> list[str]:
    """Format pieces as a table, with what was measured and the reasons against them."""
    from gso.cli.report import columns
    from gso.verdict import describe

    size = found.design.diagonal
    rows: list[tuple[str, ...]] = [
        ("piece", f"length {unit}", f"width {unit}", f"seam {unit}", f"darts {unit}", "strain")
    ]
    for row in found.table():
        strain = f"{100 * row['strain_max']:.3g} %" if "strain_max" in row else "-"
        sizes = [f"{row[k]:.4g}" if k in row else "-" for k in ("length", "width")]
        rows.append((row["name"], *sizes, f"{row['seam']:.4g}", f"{row['darts']:.4g}", strain))
    lines = columns(rows)
    known = found.metrics
    lines.append(
        f"pieces: {len(found)}; seams: {found.lengths.sum():.4g} {unit} "
        f"({found.seam_length:.3g} times the root of the area); narrowest place: "
        f"{known['neck']:.4g} {unit}"
    )
    if "deviation_max" in known:
        far, mean = known["deviation_max"], known["deviation_mean"]
        lines.append(
            f"distance from the design: {mean:.4g} {unit} on average, {far:.4g} {unit} at most "
            f"({100 * far / size:.2g} % of the diagonal)"
        )
    lines += [f"note: {note}" for note in found.notes]
    lines += [f"not usable: {describe(reason, unit)}" for reason in found.reasons]
    return lines

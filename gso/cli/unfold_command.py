"""``gso unfold``: the net of a surface of flat faces, with its folds."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gso.cli import file_options
from gso.cli import shared_options as shared
from gso.errors import OptionError

if TYPE_CHECKING:
    from gso.typing import Ints
    from gso.unfolding import Net
    from gso.workshop import Drawing


@click.command(short_help="Make the net of a surface of flat faces.")
@click.argument("name", metavar="IN", type=click.Path())
@shared.output(
    "Drawing to write, .svg, .dxf or .pdf: the parts at 1:1 with layers to cut and to fold.",
)
@click.option(
    "--cut", metavar="A-B", multiple=True, help="Edge to cut, by its vertices, the first being 0."
)
@click.option("--keep", metavar="A-B", multiple=True, help="Edge that is not cut in any case.")
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
@shared.unit
@file_options.weld
@file_options.chord
@file_options.force
@shared.quiet
def unfold(
    name: str,
    out: str,
    cut: tuple[str, ...],
    keep: tuple[str, ...],
    keep_groups: bool,
    sheet: tuple[float, float] | None,
    flat_angle: float,
    effort: float,
    seed: int,
    unit: str,
    weld: float | None,
    force: bool,
    quiet: bool,
) -> None:
    """Cut the surface IN along edges, lay its flat faces out, and draw them to OUT.

    The shape stays as it is. The parts are as few as are found, and do not overlap. Mountain and
    valley folds are in layers of their own.
    """
    import numpy as np

    from gso.mesh import Mesh
    from gso.seams import Labels
    from gso.unfolding import unfold as make
    from gso.workshop import writers

    writers.check_output(out)
    file_options.spare([name], [out], force)
    edges = _edges(cut, "cut")
    mesh = file_options.load(name, weld) if keep_groups else file_options.source(name, weld)
    if isinstance(mesh, Mesh):
        edges = np.concatenate([edges, Labels("g").edges(mesh)])
    net = make(
        mesh,
        cut=edges,
        keep=_edges(keep, "keep"),
        sheet=sheet,
        unit=unit,
        flat_angle=flat_angle,
        effort=effort,
        seed=seed,
    )
    writers.write(drawn(net, Path(name).stem, unit), out)
    if not quiet:
        click.echo("\n".join(text(net, unit)))


def _edges(given: tuple[str, ...], name: str) -> Ints:
    """Return edges, given as texts, as an array (k, 2)."""
    import numpy as np

    out = []
    for word in given:
        found = re.fullmatch(r"\s*(\d+)\s*-\s*(\d+)\s*", word)
        if found is None:
            raise OptionError(f"--{name} is {word!r}; it must be two vertices such as 0-7")
        out.append([int(found[1]), int(found[2])])
    return np.array(out, np.int64).reshape(-1, 2)


def drawn(net: Net, name: str, unit: str) -> Drawing:
    """Return the parts of a net side by side, in millimetres."""
    from gso.quantities import millimetres
    from gso.workshop import Finish, fitted, of_net, parts_from
    from gso.workshop.names import spelled
    from gso.workshop.output_files import beside

    made = of_net(spelled(name), net)
    finish = Finish(notches=None)
    return beside(parts_from(fitted(made, millimetres(unit), finish), finish))


def text(net: Net, unit: str) -> list[str]:
    """Format what was made as a table."""
    import numpy as np

    from gso.cli.report import columns

    part = np.empty(len(net.pattern.flat), np.int64)
    part[net.pattern.faces] = net.part[:, None]
    folds = np.bincount(part[net.folds.edges[:, 0]], minlength=len(net))
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

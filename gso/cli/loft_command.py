"""``gso loft``: developable panels between the lines of a table of offsets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gso.cli import file_options
from gso.cli import shared_options as shared
from gso.cli.commands import Command

if TYPE_CHECKING:
    from gso.typing import Json
    from gso.workshop import Drawing, HullPanel

#: Largest distance of a panel from its lines, where none is given.
_ON = "0.1%"


@click.command(
    cls=Command,
    short_help="Make the panels of a hull from its lines.",
    example="gso loft dinghy.csv -o dinghy.dxf --unit m\n"
    "makes a developable panel between each two lines, and its mirror image, as patterns at 1:1",
)
@click.argument("name", metavar="CSV", type=click.Path())
@shared.output(
    "File to write: .svg, .dxf or .pdf for the patterns at 1:1 with their bend lines, or a mesh "
    "such as .obj with a group for each panel, which gso fabricate takes."
)
@click.option(
    "--mirror/--no-mirror",
    "mirrored",
    default=None,
    help="Mirror each panel at y = 0; by default if all lines are on one side of it.",
)
@click.option(
    "--rulings",
    metavar="N",
    type=click.IntRange(3, 2000),
    default=33,
    help="Lines to bend along, of each panel.",
)
@shared.max_deviation
@shared.page
@shared.unit
@file_options.force
@shared.as_json
@shared.quiet
def loft(
    name: str,
    out: str,
    mirrored: bool | None,
    rulings: int,
    max_deviation: str | float | None,
    page: str | None,
    unit: str,
    force: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Make developable panels between the lines of the table CSV, and write them to OUT.

    The table has a row for each point, with the columns line, x, y, z; or one for each station,
    with x and, for each line, NAME y and NAME z. Panels are between lines that follow each other:
    keel, chine, sheer. The exit code is 0 only if every panel is developable and within
    --max-deviation of its lines, 0.1 % of the diagonal when it is not given.
    """
    from gso import io
    from gso.io.atomic import write_bytes
    from gso.quantities import as_length
    from gso.workshop import hull_panels, whole_hull, writers
    from gso.workshop.result_page import hull_page

    drawing = not out.lower().endswith(io.suffixes())
    if drawing:
        writers.check_output(out)
    else:
        io.check_writable(out)
    file_options.spare([name], [out, page], force)
    panels = hull_panels(io.read_offsets(name), mirrored=mirrored, rulings=rulings)
    hull = whole_hull(panels)
    if drawing:
        writers.write(drawn(panels, unit), out)
    else:
        io.save(hull, out)
    far = _ON if max_deviation is None else max_deviation
    allowed = as_length(far, "--max-deviation", diagonal=hull.diagonal, unit=unit)
    if page is not None:
        write_bytes(page, hull_page(panels, allowed, unit=unit).encode())
    found = [record(panel, allowed) for panel in panels]
    if as_json:
        shared.tell_json({"unit": unit, "output": out, "panels": found})
    else:
        shared.tell(text(found, unit), quiet=quiet)
    click.get_current_context().exit(0 if all(one["usable"] for one in found) else 1)


def drawn(panels: list[HullPanel], unit: str) -> Drawing:
    """Return the patterns of panels side by side, in millimetres."""
    from gso.quantities import millimetres
    from gso.workshop import Finish, of_surface
    from gso.workshop import drawn as side_by_side
    from gso.workshop.names import spelled

    made = [
        of_surface(spelled(p.name), p.surface.mesh, p.surface.pattern, {}, p.surface.folded)
        for p in panels
    ]
    return side_by_side(made, millimetres(unit), Finish(notches=None))[0]


def record(panel: HullPanel, allowed: float) -> Json:
    """Return what was measured of a panel as plain numbers."""
    import numpy as np

    flat = panel.surface.pattern.flat
    long, wide = sorted(np.ptp(flat, axis=0).tolist(), reverse=True)
    why = panel.faults(allowed)
    return {
        "panel": panel.name,
        "length": long,
        "width": wide,
        "off": panel.off,
        "usable": not why,
        "reasons": why,
    }


def text(found: list[Json], unit: str) -> list[str]:
    """Format what was made as a table."""
    from gso.cli.report import columns

    rows: list[tuple[str, ...]] = [("panel", f"length {unit}", f"width {unit}", f"off {unit}")]
    for one in found:
        rows.append((one["panel"], *(f"{one[k]:.4g}" for k in ("length", "width", "off"))))
    lines = columns(rows)
    return lines + [
        f"not usable: panel {one['panel']}: {', '.join(one['reasons'])}; move a line, divide "
        "the panel by another line, or allow more (--max-deviation)"
        for one in found
        if not one["usable"]
    ]

"""Options that several commands share: one name, one unit, one default and one spelling each."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, TypeVar

import click

from gso.cli.page_file import PAGES
from gso.errors import OptionError
from gso.quantities import MILLIMETRES, as_length, as_strain, size_notes

if TYPE_CHECKING:
    from gso.mesh import Mesh

_Command = TypeVar("_Command", bound=Callable[..., object])


class _Length(click.ParamType):  # type: ignore[type-arg]
    """A length such as ``5``, ``5mm`` or ``0.5%``: a number, or a text that is checked."""

    name = "length"

    def convert(
        self, value: str | float, param: click.Parameter | None, ctx: click.Context | None
    ) -> str | float:
        try:
            as_length(value, "it", diagonal=1.0)
        except OptionError:
            self.fail(
                f"{value!r} is no positive length such as 5, 5mm or 0.5% (of the diagonal of the "
                "bounding box)",
                param,
                ctx,
            )
        try:
            return float(value)
        except ValueError:
            return value


class _Millimetres(click.ParamType):  # type: ignore[type-arg]
    """A length in millimetres, such as ``2`` or ``0.2cm``, as a number."""

    name = "mm"

    def convert(
        self, value: str | float, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        try:
            # There is no design yet that a per cent could refer to.
            return as_length(value, "it", diagonal=float("nan"))
        except OptionError:
            self.fail(f"{value!r} is no positive length such as 2, 2mm or 0.2cm", param, ctx)


class _Strain(click.ParamType):  # type: ignore[type-arg]
    """A strain such as ``0.01`` or ``1%``, as a ratio."""

    name = "strain"

    def convert(
        self, value: str | float, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        try:
            return as_strain(value, "it")
        except OptionError:
            self.fail(f"{value!r} is no positive strain such as 0.01 or 1%", param, ctx)


class _Edge(click.ParamType):  # type: ignore[type-arg]
    """An edge such as ``0-7`` as a pair of vertices."""

    name = "edge"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        found = re.fullmatch(r"\s*(\d+)\s*-\s*(\d+)\s*", str(value))
        if found is None:
            self.fail(f"{value!r} is no edge; give its two vertices, such as 0-7", param, ctx)
        return int(found[1]), int(found[2])


LENGTH, MM, STRAIN, EDGE = _Length(), _Millimetres(), _Strain(), _Edge()


def output(help: str, name: str = "out", metavar: str = "OUT") -> Callable[[_Command], _Command]:
    """Return the option for what a command writes."""
    return click.option(
        "-o", "--output", name, metavar=metavar, required=True, type=click.Path(), help=help
    )


max_deviation = click.option(
    "--max-deviation",
    metavar="LENGTH",
    type=LENGTH,
    help="Largest distance between design and result, both ways: 5 (in the design's unit), 5mm, or "
    "0.5% of its diagonal.",
)
max_strain = click.option(
    "--max-strain",
    metavar="STRAIN",
    type=STRAIN,
    help="Largest strain of the flat patterns: 0.01 or 1%.",
)
min_radius = click.option(
    "--min-radius",
    metavar="LENGTH",
    type=LENGTH,
    help="Smallest radius that the surface may be bent to, as for --max-deviation.",
)
max_strips = click.option(
    "--max-strips",
    metavar="N",
    type=click.IntRange(1, 64),
    default=64,
    help="Largest number of strips side by side of one piece.",
)
sheet = click.option(
    "--sheet",
    metavar="L W",
    type=MM,
    nargs=2,
    help="Length and width of a sheet, in mm: every part must fit on one.",
)
scale = click.option(
    "--scale",
    metavar="X",
    type=float,
    help="Factor of the design's size; all other options are about the scaled design.",
)
height = click.option(
    "--height",
    metavar="LENGTH",
    type=LENGTH,
    help="The same by the height that the design gets, such as 200mm.",
)
up = click.option(
    "--up", type=click.Choice("xyz"), default="z", help="The axis that --height is along."
)
tabs = click.option(
    "--tabs", metavar="MM", type=float, help="Width of tabs along seams, for paper."
)
seam_overlap = click.option(
    "--seam-overlap",
    metavar="MM",
    type=MM,
    help="Width by which parts overlap along smooth seams, to be glued, riveted or welded.",
)
seam_flange = click.option(
    "--seam-flange",
    metavar="MM",
    type=MM,
    help="Width of flanges along seams with an angle, folded by it.",
)
numbers = click.option(
    "--numbers",
    type=click.Choice(("inside", "outside")),
    help="Where the numbers of seams stand: in the parts, or on tabs and outside the outlines.",
)
darts = click.option("--darts/--no-darts", default=False, help="Whether cuts may end in a piece.")
cut = click.option(
    "--cut",
    metavar="A-B",
    type=EDGE,
    multiple=True,
    help="Edge to cut, by its vertices, the first being 0; may be given several times.",
)
keep = click.option(
    "--keep", metavar="A-B", type=EDGE, multiple=True, help="Edge that is not cut in any case."
)
keep_groups = click.option(
    "--keep-groups",
    is_flag=True,
    help="Cut between the groups (g) of IN in any case; without two of them, between its objects "
    "(o) or materials (usemtl).",
)
max_pieces = click.option("--max-pieces", metavar="N", type=int, help="Budget of pieces.")
min_neck = click.option(
    "--min-neck", metavar="LENGTH", type=LENGTH, help="Smallest width of a piece."
)
min_size = click.option(
    "--min-size", metavar="LENGTH", type=LENGTH, help="Smallest length of a piece."
)
symmetric = click.option(
    "--symmetric",
    is_flag=True,
    help="Symmetric seams; of bodies of revolution gores that are all alike.",
)
seam_effort = click.option(
    "--effort",
    type=click.Choice(("draft", "standard", "best")),
    default="standard",
    show_default=True,
    help="How long to search for seams where the shape may change: a first look, the "
    "usual, or for fewer pieces.",
)


def seams_along(name: str) -> Callable[[_Command], _Command]:
    """Return the option for lines that seams should follow."""
    return click.option(
        name,
        metavar="FILE",
        type=click.Path(),
        help="OBJ file of polylines (l) on the design that seams should follow.",
    )


avoid = click.option(
    "--avoid",
    metavar="FILE",
    type=click.Path(),
    help="OBJ file of polylines (l) on the design: seams should keep away from the faces there.",
)
unit = click.option(
    "--unit", type=click.Choice(tuple(MILLIMETRES)), default="mm", help="Unit of the coordinates."
)
workers = click.option(
    "--workers",
    metavar="N",
    type=click.IntRange(0),
    help="Processes; one for each processor by default, 0 for none beside this one.",
)
scheduler = click.option(
    "--scheduler", metavar="ADDRESS", help="Dask cluster that does the work instead."
)
quiet = click.option(
    "-q", "--quiet", is_flag=True, help="Print only errors and why a result is not usable."
)
constraints = click.option(
    "--constraints",
    metavar="JSON",
    type=click.Path(),
    help='File with what must hold: a list such as [{"type": "Fixed", "ids": [0, 9]}].',
)
plot = click.option(
    "--plot",
    metavar="PNG",
    type=click.Path(),
    help="Picture to draw (.png, .pdf, .svg).",
)


def _writable(ctx: click.Context, option: click.Parameter, value: str | None) -> str | None:
    """Refuse a file that cannot be written, before anything is computed."""
    if value is not None:
        from gso.io import check_writable

        check_writable(value, PAGES if option.name == "page" else None)
    return value


page = click.option(
    "--page",
    metavar="HTML",
    type=click.Path(),
    callback=_writable,
    help="Page to look at in a browser (.html): it turns, and flat patterns fold to their places.",
)


table = click.option(
    "--metrics",
    "table",
    metavar="JSON",
    type=click.Path(),
    callback=_writable,
    help="File for status and metrics.",
)


as_json = click.option(
    "--json", "as_json", is_flag=True, help="Print JSON instead of text: what was measured."
)


def named_unit(unit: str) -> str:
    """Return the unit if the user gave ``--unit``, else ""."""
    source = click.get_current_context().get_parameter_source("unit")
    return unit if source is click.core.ParameterSource.COMMANDLINE else ""


def tell(lines: Iterable[str], *, quiet: bool, aside: bool = False) -> None:
    """Print lines; quietly only those that say why a result is not usable, as errors.

    With `aside` all go to standard error, since standard output has something else.
    """
    for line in lines:
        if not quiet:
            click.echo(line, err=aside)
        elif line.startswith("not usable"):
            click.echo(line, err=True)


def tell_size(
    mesh: Mesh,
    unit: str,
    max_deviation: str | float | None,
    quiet: bool,
    drawn: bool = True,
) -> None:
    """Say on standard error what is likely to be a wrong unit.

    The size of the design only matters where its patterns are `drawn`.
    """
    if quiet:
        return
    far = None
    if max_deviation is not None:
        far = as_length(max_deviation, "--max-deviation", diagonal=mesh.diagonal, unit=unit)
    sides = (mesh.vertices.max(axis=0) - mesh.vertices.min(axis=0)).tolist()
    for note in size_notes(sides, unit, far, drawn):
        click.echo(f"note: {note}", err=True)


def tell_json(record: object) -> None:
    """Print a record as JSON."""
    import json

    from gso.io.json_file import plain

    click.echo(json.dumps(plain(record), indent=2, ensure_ascii=False))

"""``gso view``: the page of a result."""

from __future__ import annotations

from pathlib import Path

import click

from gso.cli import file_options
from gso.cli import shared_options as shared
from gso.cli.commands import Command


@click.command(
    cls=Command,
    short_help="Make a page that shows a result.",
    example="gso view panel_strips.npz -o panel_strips.html\n"
    "makes a page on which the strips turn, and fold from their patterns to their places",
)
@click.argument("file", metavar="FILE", type=click.Path())
@shared.output("Page to write, .html.")
@shared.unit
@file_options.force
@shared.quiet
def view(file: str, out: str, unit: str, force: bool, quiet: bool) -> None:
    """Show the result FILE, .npz of gso optimize or gso strips, as a page for a browser.

    The page turns, folds and explodes the patterns, and works without a network.
    """
    from gso import io
    from gso.io.atomic import write_bytes
    from gso.result import Result
    from gso.workshop.result_page import result_page

    io.check_writable(out, (".html",))
    file_options.spare([file], [out], force)
    write_bytes(out, result_page(Result.load(file), Path(file).stem, unit=unit).encode())
    if not quiet:
        click.echo(f"page to look at: {out}")

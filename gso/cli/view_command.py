"""``gso view``: the page of a result."""

from __future__ import annotations

import click

from gso.cli import file_options
from gso.cli import shared_options as shared
from gso.cli.commands import Command
from gso.cli.page_file import PAGES, write_page


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

    The page turns, folds and explodes the patterns, and works without a network. A surface without
    a pattern, as of --task denoise, turns, and has heat maps. gso optimize, gso strips, gso unfold
    and gso loft write it with --page, gso pieces and gso fabricate in their folders.
    """
    from gso import io
    from gso.result import Result

    io.check_writable(out, PAGES)
    file_options.spare([file], [out], force)
    write_page(Result.load(file), file, out, unit)
    if not quiet:
        click.echo(f"page to look at: {out}")

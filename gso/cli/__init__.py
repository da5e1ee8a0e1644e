"""The command line: ``gso optimize``, ``gso metrics``, ``gso info``, ``gso plot`` ..."""

from __future__ import annotations

import click

from gso.cli.commands import TABLE, overview
from gso.cli.completion import completion
from gso.cli.dataset import dataset
from gso.cli.fabricate_command import fabricate
from gso.cli.inspect import info, metrics, plot
from gso.cli.loft_command import loft
from gso.cli.optimize_command import optimize
from gso.cli.pieces_command import pieces
from gso.cli.serve_command import serve
from gso.cli.strips_command import strips
from gso.cli.train import train
from gso.cli.unfold_command import unfold
from gso.cli.view_command import view
from gso.errors import GSOError

__all__ = ["TABLE", "main"]

#: Exit code by which shells report a program interrupted by Ctrl-C.
INTERRUPTED = 130


class _Commands(click.Group):
    """Command group that reports errors as one line and an exit code, without a traceback."""

    def invoke(self, ctx: click.Context) -> object:
        try:
            return super().invoke(ctx)
        except GSOError as error:
            click.echo(f"gso: error: {' '.join(str(error).split())}", err=True)
            ctx.exit(1)
        except MemoryError:
            click.echo("gso: error: not enough memory; give a coarser mesh", err=True)
            ctx.exit(1)
        except KeyboardInterrupt:
            click.echo("gso: interrupted", err=True)
            ctx.exit(INTERRUPTED)


def _version(ctx: click.Context, option: click.Parameter, asked: bool) -> None:
    """Print the version; gso is imported only here because that is slow."""
    if asked:
        import gso

        click.echo(f"gso {gso.__version__}")
        ctx.exit()


@click.group(
    cls=_Commands,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "show_default": True},
)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_version,
    help="Print the version.",
)
@click.pass_context
def main(ctx: click.Context) -> None:
    """Make surfaces that can be built from flat sheets.

    Make them developable, lay them flat or denoise them (optimize), cut whole designs into pieces
    (pieces), make exactly developable strips (strips), make nets of flat faces (unfold), write what
    a cutter needs (fabricate). Without a command gso prints what to type for what you have.
    """
    if ctx.invoked_subcommand is None:
        click.echo(f"{overview()}\n\ngso COMMAND --help says more; gso --help lists all commands.")


_SURFACES = (optimize, strips, pieces, unfold, loft, fabricate, metrics, info, plot, view)
for _command in (*_SURFACES, serve, dataset, train, completion):
    main.add_command(_command)

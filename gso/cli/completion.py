"""``gso completion``: what a shell reads to complete the command line."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class

from gso.cli.commands import Command


@click.command(
    cls=Command,
    example="gso completion bash >> ~/.bashrc",
    short_help="Print what a shell needs to complete commands.",
)
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion(ctx: click.Context, shell: str) -> None:
    """Print the lines by which SHELL completes commands, options and names of files.

    Add them to what it reads when it starts: ~/.bashrc, ~/.zshrc, or
    ~/.config/fish/completions/gso.fish.
    """
    kind = get_completion_class(shell)
    if kind is None:
        raise click.UsageError(f"no completion for {shell}")
    click.echo(kind(ctx.find_root().command, {}, "gso", "_GSO_COMPLETE").source())

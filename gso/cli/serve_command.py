"""``gso serve``: answer requests of other programs."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO

import click

from gso.cli.commands import Command
from gso.errors import OptionError


@click.command(
    cls=Command,
    short_help="Answer requests of other programs.",
    example="gso serve --stdio\n"
    "answers each line of standard input, such as\n"
    '{"id": 1, "method": "unfold", "params": {"mesh": "house.obj", "output": "net.dxf"}}',
)
@click.option(
    "--stdio", is_flag=True, help="Read requests from standard input, answer on standard output."
)
def serve(stdio: bool) -> None:
    """Answer requests, each a line of JSON, until standard input ends.

    Hosts such as Rhino, Blender and FreeCAD start this command. No port is opened. Methods are
    unfold, pieces, strips, flatten, optimize, fabricate, info, describe and cancel.
    """
    if not stdio:
        raise OptionError("there is one way to talk to the server; give --stdio")
    from gso.serving import Server

    with _own_output() as out:

        def write(line: str) -> None:
            out.write(line)
            out.flush()

        try:
            Server(write).run(sys.stdin.buffer)
        except BrokenPipeError:
            # The host has gone; nobody reads answers.
            os._exit(0)


@contextmanager
def _own_output() -> Iterator[TextIO]:
    """Provide standard output for answers alone: what libraries print goes to standard error."""
    sys.stdout.flush()
    try:
        number = sys.stdout.fileno()
    except (OSError, ValueError):
        # It is no file, as in tests: only this program writes to it.
        yield sys.stdout
        return
    own = os.dup(number)
    os.dup2(sys.stderr.fileno(), number)
    with os.fdopen(own, "w", encoding="utf-8", newline="\n") as out:
        yield out
        os.dup2(own, number)

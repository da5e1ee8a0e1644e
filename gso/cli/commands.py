"""Commands whose help begins with an example, and the table of what to type."""

from __future__ import annotations

from typing import Any

import click

#: What a user has, types and gets; :func:`overview` and the README print it.
TABLE = (
    ("a curved panel", "gso optimize panel.obj -o out.obj", "a developable one near it"),
    ("a freeform design", "gso fabricate design.obj -o job", "drawings for the cutter, a page"),
    ("a sculpture, a scan", "gso pieces bunny.obj -o pieces", "few pieces that lie flat"),
    ("a hull, a facade", "gso strips hull.obj -o hull.npz", "exactly developable strips"),
    ("lines of a boat", "gso loft lines.csv -o hull.dxf", "its panels, mirrored pairs"),
    ("a box, duct, bracket", "gso fabricate part.step -o job", "its flat pattern, bend lines"),
    (
        "any surface as it is",
        "gso optimize shape.obj -o flat.svg --task flatten",
        "its flat image at 1:1",
    ),
    (
        "a noisy scan",
        "gso optimize scan.ply -o out.ply --task denoise",
        "a smooth mesh with its edges",
    ),
    ("a file", "gso info design.obj", "size, holes, curvature"),
    ("a result", "gso plot out.npz -o out.png", "a picture"),
    ("a result", "gso view out.npz -o out.html", "a page that turns"),
    ("Blender, Rhino ...", "gso serve --stdio", "patterns there: docs/hosts.rst"),
)


def overview() -> str:
    """Return the table as text.

    >>> print(overview().splitlines()[0])
    You have              You type                                           You get
    """
    rows = [("You have", "You type", "You get"), *TABLE]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )


class Command(click.Command):
    """A command whose help begins with an example.

    Parameters
    ----------
    example : str
        A command line, and what it does, in lines of their own.
    """

    def __init__(self, *given: Any, example: str, **keywords: Any):
        super().__init__(*given, **keywords)
        self.example = example

    def format_help(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Example"):
            for line in self.example.splitlines():
                formatter.write(f"  {line}\n")
        formatter.write_paragraph()
        super().format_help(ctx, formatter)

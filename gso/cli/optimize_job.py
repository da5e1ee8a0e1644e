"""Settings of ``gso optimize``, and what is done with them for each input."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from gso import tasks
from gso.cli import shared_options as shared
from gso.cli.file_options import here, source, spare
from gso.errors import OptionError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from typing_extensions import Self

    from gso.executors import Item
    from gso.mesh import Mesh
    from gso.result import Result
    from gso.solver import Callback
    from gso.typing import Keywords


@dataclass(frozen=True)
class Job:
    """Settings of a run of ``gso optimize``, shared by all inputs.

    Attributes
    ----------
    keywords : dict
        Keyword arguments of :func:`gso.tno.optimize`.
    method : {"auto", "tno", "net", "hybrid"}
        Solver. "tno": the optimiser. "net": a net alone. "hybrid": the optimiser, warm-started
        from a net's result. "auto": "hybrid" where it saves time, otherwise "tno".
    net : str, optional
        Name or file of the net.
    unit : str
        Unit of the coordinates, for drawings and CAD files.
    quiet : bool
        Print nothing but errors.
    weld : float, optional
        Vertices within this distance of each other are merged.
    force : bool
        Whether outputs may replace inputs.
    inputs : tuple of str
        Other files that are read: constraints, net.
    named : str
        The unit if ``--unit`` was given, else "": lengths are then printed without a unit.
    """

    keywords: Keywords
    method: str = "auto"
    net: str | None = None
    unit: str = "mm"
    quiet: bool = False
    weld: float | None = None
    force: bool = False
    inputs: tuple[str, ...] = ()
    named: str = ""

    @classmethod
    def of(cls, keywords: Keywords, given: Keywords, *inputs: str | None) -> Self:
        """Make the settings from the options of a command."""
        known = {f.name: given[f.name] for f in fields(cls) if f.name in given}
        read = tuple(name for name in inputs if name is not None)
        return cls(keywords, inputs=read, named=shared.named_unit(given["unit"]), **known)

    def spare(self, files: Iterable[str], *outputs: str | None) -> None:
        """Raise an error if an output is also an input, unless `force` is set."""
        spare((*files, *self.inputs), outputs, self.force)

    def solve(self, mesh: Mesh, callback: Callback | None = None) -> Result:
        """Optimise one surface."""
        if self.method == "tno":
            from gso.tno import optimize

            return optimize(mesh, **self.keywords, callback=callback)
        from gso.hybrid import solve

        return solve(mesh, **self._with_net(), callback=callback)

    def solve_many(
        self, files: Iterable[str], workers: int | None, scheduler: str | None = None
    ) -> Iterator[Item[Result]]:
        """Optimise many surfaces in parallel."""
        read = source if scheduler is None else here
        meshes = (read(file, self.weld) for file in files)
        spread: Keywords = {"workers": workers, "scheduler": scheduler}
        if self.method == "tno":
            from gso.tno import optimize_many

            return optimize_many(meshes, **spread, **self.keywords)
        from gso.hybrid import solve_many

        return solve_many(meshes, **spread, **self._with_net())

    def _with_net(self) -> Keywords:
        more = {"net": self.net, "polish": self.method != "net", "sparing": self.method == "auto"}
        return {**self.keywords, **more}

    @property
    def task(self) -> str:
        """The task, by name."""
        return str(self.keywords["task"])

    def check(self, out: str, plot: str | None = None) -> None:
        """Raise an error if an output cannot be written, before anything is computed."""
        from gso import io

        has_pattern = self.task == "developable" or tasks.get(self.task).flat
        if out.lower().endswith((".dxf", ".pdf")):
            raise OptionError(
                f"{out}: patterns are written as .svg here; gso fabricate writes .dxf and .pdf"
            )
        if out.lower().endswith(".svg"):
            if not has_pattern:
                raise OptionError(
                    f"{out}: only a flat pattern is drawn as SVG; use --task flatten or "
                    "--task developable"
                )
            io.check_writable(out)
        elif is_cad(out):
            if self.task != "developable":
                raise OptionError(
                    f"{out}: only developable surfaces are written as splines; "
                    "use --task developable"
                )
            io.check_spline(out, self.unit)
        else:
            io.check_writable(out, io.suffixes())
        if plot is not None:
            from gso import plot as pictures

            pictures.require()
            io.check_writable(plot, pictures.SUFFIXES)

    def write(self, result: Result, out: str, plot: str | None = None) -> None:
        """Write a result and its picture."""
        if is_cad(out):
            result.add_spline()
        result.save(out, unit=self.unit)
        if plot is not None:
            from gso.plot import plot_result

            plot_result(result, plot)


def is_cad(out: str) -> bool:
    """Tell whether a file name, or a suffix with or without its dot, is that of a CAD file."""
    from gso.io import SPLINE_SUFFIXES

    return f".{out.lower().rpartition('.')[2]}" in SPLINE_SUFFIXES

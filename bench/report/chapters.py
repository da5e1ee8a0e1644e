"""The text of the report, chapter by chapter."""

from __future__ import annotations

from typing import Any

from report import kernels, pages
from report.figures import Figure
from report.published import INPUT
from report.quality import Records
from report.sections import SECTIONS, rows
from report.timing import Timing
from report.verdict import Loss, against_limit


def chapters(
    result: dict[str, Any],
    records: Records,
    times: list[Timing],
    found: list[Loss],
    drawn: dict[str, list[Figure]],
) -> list[pages.Chapter]:
    """Return the chapters of the report, in order."""
    known, some = result["machine"], result["surfaces"]
    about = [
        f"Surfaces: {some['name']}; {some['count']:,} of them, mean loss_gc {some['loss_gc']:.3f} "
        f"(the paper's: {INPUT}). Means are over the surfaces that the row counts. Rows with "
        "fewer than others have the first of them: compare those with the default's row of as "
        "many.",
        "Times are medians of single solves, one process, one thread, nothing beside it, from "
        "array to array, with everything that a user waits for except what is made at first use. "
        "Published figures are those of other surfaces drawn by the same recipe; published times "
        "are those of other machines, the nets' on a GPU.",
        _builds(),
        "Peers with parameters have those that were best on surfaces of the validation split; "
        "denoisers among them for each level of the noise, which the package's method is not "
        "told.",
    ]
    packages = ", ".join(f"{k} {v}" for k, v in known["packages"].items() if v)
    machine_lines = [
        f"{known['processor']}; Python {known['python']}",
        packages,
        f"{result['command']} ({result['run']})",
    ]
    parts = [
        pages.Chapter("What this is", about, machine_lines),
        pages.Chapter(
            "Where it loses",
            [
                "Computed from the rows below: every figure of the paper or of a peer that is "
                "better than that of the package's default on the same surfaces. First those that "
                "no method of the package reaches."
            ],
            pages.loss_items(found) or ["Nowhere."],
        ),
        pages.Chapter("Not measured", [], result["unmeasured"] or ["Nothing."]),
    ]
    pictures = {"developable": ("6", "7"), "flatten": ("8",), "denoise-0.015": ("9",)}
    for section in SECTIONS:
        table = pages.quality_table(section.columns, rows(section, records))
        own = [f for key in pictures.get(section.name, ()) for f in drawn[key]]
        parts.append(pages.Chapter(section.title, table=table, figures=own))
    parts.append(pages.Chapter("Architecture of the net", figures=drawn["5"]))
    text = [
        "Each row is a process of its own; its memory is that of Python with all packages. "
        "The shares are those of one more solve: the net; setup, with starts, coarser grids, "
        "symbolic analysis and whatever is not named; evaluation of residuals and derivatives; "
        "assembly of the matrix; its factorisation; its solution. Compiled kernels evaluate "
        "derivatives and assemble in one loop, which counts as assembly. Denoising is in closed "
        "form, all of it setup but the verdict. The flat pattern of a result and the verdict on it "
        "are phases too, as the user waits for them; only the limit, which compares with the solve "
        "alone, is without them. It is one numeric factorisation of each iteration's matrix "
        "by the fastest backend that is installed, and nothing else.",
        _sizes(),
    ]
    items = [*pages.exponents(times), *against_limit(times)]
    table = pages.timing_table(times)
    return [*parts, pages.Chapter("Time against size", text, items, table, drawn["time"])]


def _built(more: str) -> str:
    """Say which build times are of; more is said where there are two builds."""
    if not kernels.compiled():
        return kernels.described()
    return f"{kernels.described()} {more}"


def _builds() -> str:
    """Say which build the times of the tables of quality are of."""
    return _built(
        'The column "time, NumPy" has the median with NumPy kernels '
        f"({kernels.VARIABLE}={kernels.NUMPY}). The cell also has the number of surfaces, which "
        "are the first of the timed ones. It is empty for methods without the solver's kernels. "
        "Results of both builds are the same up to rounding."
    )


def _sizes() -> str:
    """Say which build the times against size are of."""
    return _built(
        f"TNO, NumPy is the optimiser with NumPy kernels ({kernels.VARIABLE}={kernels.NUMPY}). On "
        "grids of up to about 40 by 40 vertices TNO uses NumPy kernels, too."
    )

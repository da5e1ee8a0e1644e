"""Write the tables of docs: ``python docs/tables.py`` from the repository's root.

They are made from the docstrings and values in the code, and from the figures that
``python bench/run_all.py --store`` measured. Each stands in one place, between the comments
``.. begin NAME`` and ``.. end NAME``; what is between them is replaced.
"""

from __future__ import annotations

import csv
import inspect
import io
import json
import re
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from statistics import median
from typing import Any

from gso import Options, RuledOptions, metrics, tasks
from gso.cli import TABLE
from gso.net import catalogue
from gso.verdict import Code

ROOT = Path(__file__).resolve().parents[1]
#: Files with tables.
PAGES = (
    ROOT / "README.rst",
    *(ROOT / "docs" / f"{name}.rst" for name in ("reference", "benchmarks", "net")),
)
#: What was measured; without it there are no tables of it.
RESULTS = ROOT / "bench" / "data" / "results.json"
#: The figures of the README, of ``python bench/run_all.py --only tno.developable --json FILE``.
PRESETS = ROOT / "bench" / "data" / "presets.json"


def tables() -> dict[str, str]:
    """Every table by name."""
    found = {"metrics": metric_table(), "reasons": reason_table()}
    found["options"] = option_table(Options, shared={})
    shared = {f.name: f.default for f in fields(Options)}
    for task in tasks.names():
        own = tasks.get(task).options
        found[f"options-{task}"] = option_table(own, shared=shared)
        for name, formulation in tasks.get(task).formulations.items():
            if formulation.options is not own:
                table = option_table(formulation.options, shared=shared)
                found[f"options-{task}-{name}"] = table
    # Strips are no formulation of the task, although they are called like one.
    found["options-strips"] = option_table(RuledOptions, shared=shared)
    for task, metric in (("developable", "K_A_r_worst"), ("flatten", "strain_mean")):
        found[f"splits-{task}"] = split_table(task, metric)
    head = ("You have", "You type", "You get")
    rows = [(have, f"``{words}``", get) for have, words, get in TABLE]
    found["what-to-type"] = csv_table(head, rows, (24, 46, 30))
    if RESULTS.exists():
        found |= measured(json.loads(RESULTS.read_text(encoding="utf-8")))
    if PRESETS.exists():
        found["measured-presets"] = preset_table(json.loads(PRESETS.read_text(encoding="utf-8")))
    return found


def metric_table() -> str:
    """Metrics, their units, which way is better, and what they mean."""
    better = {True: "lower", False: "higher", None: ""}
    rows = [
        (f"``{name}``", info.unit or "1", better[info.lower_is_better], prose(info.text))
        for name, info in metrics.INFO.items()
    ]
    return list_table(("Metric", "Unit", "Better", "Meaning"), rows, (22, 12, 10, 56))


def reason_table() -> str:
    """Codes of reasons, the units of their numbers, what they mean, and what to do."""
    rows = []
    for code in Code:
        info = code.info
        limit = "" if info.limit is None else f"{info.limit:g}"
        meaning, remedy = (
            prose(text[0].upper() + text[1:]) for text in (info.meaning, info.remedy)
        )
        rows.append((f"``{code.name}``", info.kind.value, limit, meaning, remedy))
    head = ("Code", "Unit", "Bound", "Meaning", "What to do")
    return list_table(head, rows, (22, 8, 6, 36, 28))


def option_table(options: type[Options], shared: Mapping[str, object]) -> str:
    """Settings of a task, their defaults, and what they mean; presets that change them."""
    said = descriptions(options)
    rows = []
    for f in fields(options):
        if f.default is MISSING or shared.get(f.name, MISSING) == f.default:
            continue
        rows.append((f"``{f.name}``", f"``{f.default!r}``".replace("'", '"'), prose(said[f.name])))
    parts = [list_table(("Setting", "Default", "Meaning"), rows, (22, 14, 64))]
    presets = []
    for name, changes in options.PRESETS.items():
        values = ", ".join(f"``{k}={v!r}``".replace("'", '"') for k, v in changes.items())
        presets.append(f"``{name}``: {values or 'the defaults'}")
    if presets:
        parts.append("\n".join(wrapped("Presets: " + "; ".join(presets) + ".")))
    return "\n\n".join(parts)


def split_table(task: str, metric: str) -> str:
    """Mean of a metric over every split of surfaces, for the nets whose cards have it."""
    columns = {}
    for name in catalogue.available(task):
        card = catalogue.read_card(catalogue.chain(name, task)[-1])
        of = f" of {name}" if name in catalogue.CHAINS else ""
        others = card.get(f"other splits{of}")
        if others:
            columns[name] = {"test": card[f"test{of}"], **others}
    whole = next(iter(columns.values()), {})
    head = ("Surfaces", "Count", *(f"``{name}``" for name in columns))
    rows = [
        (
            split.replace("_", " "),
            f"{found['surfaces']:,}",
            *(number(column[split][metric]) for column in columns.values()),
        )
        for split, found in whole.items()
    ]
    return csv_table(head, rows, (20, 10, *[14] * len(columns)))


def measured(results: dict[str, Any]) -> dict[str, str]:
    """Tables of a run of ``bench/run_all.py``, and where it loses, as a list."""
    sections = results["sections"]
    found = {
        f"measured-{name}": quality_table(section)
        for name, section in sections.items()
        if not name.startswith("denoise")
    }
    levels = {k: v for k, v in sections.items() if k.startswith("denoise")}
    found["measured-denoise"] = denoise_table(levels, "theta")
    found["measured-denoise-rate"] = denoise_table(levels, "rate")
    found["measured-pairs"] = pair_table(results.get("pairs", ()))
    found["measured-size"] = size_table(results["timing"])
    found["measured-losses"] = "\n".join(
        line
        for loss in results["losses"]
        if loss["lost"]
        for line in wrapped(f"{loss['section']}, {loss['text']}", "- ", "  ")
    )
    about, surfaces = results["machine"], results["surfaces"]
    # Older runs do not say which kernels they used.
    build = f" {results['kernels']}" if "kernels" in results else ""
    found["measured-machine"] = "\n".join(
        wrapped(
            f"{surfaces['name']}, of which the first {surfaces['count']:,} with a mean loss_gc of "
            f"{surfaces['loss_gc']:.3f}. {about['processor']}, "
            f"Python {about['python']}, one thread.{build} Printed by "
            f"``{results['command']}``."
        )
    )
    return found


def quality_table(section: dict[str, Any]) -> str:
    """Quality and time of the methods of a section; those without figures are left out.

    The time with NumPy kernels has a column where it was measured.
    """
    both = any(row.get("seconds_numpy") for row in section["rows"])
    times = ("seconds", "seconds_numpy") if both else ("seconds",)
    head = ("Method", *section["headings"], *("Time", "Time, NumPy")[: len(times)], "Surfaces")
    rows = [
        (
            row_name(row),
            *(number(row["figures"].get(column)) for column in section["columns"]),
            *(duration(row.get(key, {}).get("median")) for key in times),
            f"{row['count']:,}" if row["count"] else "",
        )
        for row in section["rows"]
        if not row["absent"]
    ]
    return csv_table(head, rows, (24, *[10] * (len(head) - 1)))


def denoise_table(levels: dict[str, dict[str, Any]], metric: str) -> str:
    """A metric at every level of the noise, and the time at the first.

    For the angle of the normals, "theta", the first rows are those of the surfaces with noise.
    """
    angles: dict[str, list[str]] = {}
    times: dict[str, tuple[str, str]] = {}
    for section in levels.values():
        given = {row["source"]: row for row in reversed(section["rows"]) if not row["absent"]}
        for source in ("paper", "package") if metric == "theta" else ():
            name = row_name(given[source] | {"name": "with noise"})
            angles.setdefault(name, []).append(number(given[source]["figures"]["theta_noisy"]))
            count = given[source]["count"]
            times[name] = ("", f"{count:,}" if count else "")
        for row in section["rows"]:
            if not row["absent"]:
                angles.setdefault(row_name(row), []).append(number(row["figures"][metric]))
                count = f"{row['count']:,}" if row["count"] else ""
                times.setdefault(row_name(row), (duration(row["seconds"].get("median")), count))
    whole = {name: found for name, found in angles.items() if len(found) == len(levels)}
    head = ("Method", *(f"σ {name.split('-')[1]}" for name in levels), "Time", "Surfaces")
    rows = [(name, *found, *times[name]) for name, found in whole.items()]
    return csv_table(head, rows, (28, *[12] * (len(head) - 1)))


def pair_table(pairs: Iterable[dict[str, Any]]) -> str:
    """Published rows beside the rows of their names, and hybrid beside the cold solve."""
    headings = {"seconds": "time, s", "theta": "theta", "rate": "rate, %"}
    rows = [
        (
            p["section"],
            f"*{p['other']}, published*" if p["published"] else p["other"],
            p["own"],
            headings.get(p["metric"], f"``{p['metric']}``"),
            number(p["theirs"]),
            number(p["ours"]),
            "" if p["low"] is None else f"{number(p['low'])} to {number(p['high'])}",
            {"ours": p["own"], "theirs": "published" if p["published"] else p["other"]}.get(
                p["better"], "neither"
            ),
        )
        for p in pairs
    ]
    head = ("Table", "Row", "Beside", "Figure", "Row's", "Beside's", "Interval", "Better")
    return csv_table(head, rows, (14, 20, 14, 16, 10, 10, 18, 14))


def preset_table(found: dict[str, Any]) -> str:
    """The README's figures of the presets on the 24 reference surfaces."""
    rows = [
        (
            name,
            *(f"{row[c]:.2f}" for c in ("strain %", "90th")),
            *(f"{row[c]:.4f}" for c in ("worse", "every 2nd")),
            *(f"{row[c]:.3f}" for c in ("K_A-r worse", "d_H %", "fairness")),
            duration(row["median s"]),
        )
        for name, row in found["tno.developable"].items()
        if "SciPy" not in name
    ]
    head = ("Preset", "largest strain %", "90th percentile", "worse split", "every 2nd vertex")
    head += ("removed", "d_H %", "fairness", "total time")
    return csv_table(head, rows, (12, 12, 12, 12, 14, 10, 8, 10, 10))


def size_table(timing: list[dict[str, Any]]) -> str:
    """Times of the solver and in total, iterations, memory, and the limit, by method and size."""
    rows = []
    for t in timing:
        if t["absent"]:
            continue
        total, shares = t["seconds"], t["shares"]
        solver = 1.0 - shares.get("pattern", 0.0) - shares.get("verdict", 0.0)
        low, middle, high = (duration(some(total)) for some in (min, median, max))
        rows.append(
            (
                f"{t['task']}, {t['method']}",
                f"{t['size']} x {t['size']}",
                duration(solver * median(total)),
                middle if low == high else f"{middle} [{low}, {high}]",
                str(t["iterations"] or ""),
                f"{t['peak_mb']:.0f}",
                duration(t["limit"]),
            )
        )
    head = ("Solve", "Grid", "Solver", "Total", "Iterations", "Peak MB", "Factorisations alone")
    return csv_table(head, rows, (24, 12, 12, 22, 10, 10, 12))


def row_name(row: dict[str, Any]) -> str:
    """Name of a row; published ones say so."""
    return f"*{row['name']}, published*" if row["source"] == "paper" else row["name"]


def number(value: float | None) -> str:
    """Return a number with three digits."""
    return "" if value is None else f"{value:.3g}"


def duration(seconds: float | None) -> str:
    """A time in milliseconds or seconds."""
    if seconds is None:
        return ""
    return f"{1e3 * seconds:.2g} ms" if seconds < 0.0995 else f"{seconds:.2g} s"


def descriptions(options: type) -> dict[str, str]:
    """Texts of the attributes in the docstrings of a class and its bases."""
    found: dict[str, str] = {}
    for cls in reversed(options.__mro__):
        text = inspect.getdoc(cls) if cls.__dict__.get("__doc__") else None
        if not text or "Attributes\n---" not in text:
            continue
        section = text.split("Attributes\n----------\n")[1]
        for match in re.finditer(r"^(\w[\w, ]*) : .*\n((?: +.*\n?|\n)+)", section + "\n", re.M):
            for name in match[1].split(", "):
                found[name] = " ".join(match[2].split())
    return found


def prose(text: str) -> str:
    """Text of a docstring in reStructuredText: bars are no substitutions, names are literals."""
    literal = re.sub(r"(?<!`)`([^`]+)`(?!`)", r"``\1``", text)
    return "".join(
        part if part.startswith("``") else part.replace("|", r"\|")
        for part in re.split(r"(``[^`]+``)", literal)
    )


def wrapped(text: str, first: str = "", then: str = "") -> list[str]:
    """Lines of at most a hundred signs."""
    return textwrap.wrap(
        text,
        100,
        initial_indent=first,
        subsequent_indent=then,
        break_on_hyphens=False,
        break_long_words=False,
    )


def list_table(head: Iterable[str], rows: Iterable[Iterable[str]], widths: Iterable[int]) -> str:
    """Return a table in reStructuredText."""
    width = " ".join(map(str, widths))
    lines = [".. list-table::", "   :header-rows: 1", f"   :widths: {width}", ""]
    for row in (tuple(head), *rows):
        for k, cell in enumerate(row):
            lines += wrapped(f"{'* -' if k == 0 else '  -'} {cell}", "   ", "       ")
    return "\n".join(lines)


def csv_table(head: Iterable[str], rows: Iterable[Iterable[str]], widths: Iterable[int]) -> str:
    """Return a table of figures in reStructuredText, a line for each row."""
    lines = io.StringIO()
    csv.writer(lines, lineterminator="\n").writerows([tuple(head), *map(tuple, rows)])
    width = " ".join(map(str, widths))
    text = textwrap.indent(lines.getvalue().rstrip(), "   ")
    return f".. csv-table::\n   :header-rows: 1\n   :widths: {width}\n\n{text}"


def replaced(pages: Mapping[Path, str]) -> dict[Path, str]:
    """The texts of the pages with the tables as they should be."""
    texts = dict(pages)
    for name, table in tables().items():
        pattern = re.compile(rf"(\.\. begin {name}\n).*?(\.\. end {name}\n)", re.S)
        places = [page for page, text in texts.items() for _ in pattern.finditer(text)]
        if len(places) != 1:
            raise SystemExit(f"{len(places)} places for the table {name!r}, expected one")
        texts[places[0]] = pattern.sub(
            lambda m, t=table: f"{m[1]}\n{t}\n\n{m[2]}", texts[places[0]]
        )
    return texts


if __name__ == "__main__":
    for page, text in replaced({p: p.read_text(encoding="utf-8") for p in PAGES}).items():
        page.write_text(text, encoding="utf-8")

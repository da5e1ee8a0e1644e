"""The paper's tables and figures, times, and comparisons with peers, as one report.

    python bench/run_all.py --quick      a few surfaces of the repository (five minutes)
    python bench/run_all.py              640 surfaces of the test split (half an hour)
    python bench/run_all.py --data DIR   the test split of an existing set
    python bench/run_all.py --store      the same, and stores its figures in bench/data
    python bench/run_all.py --tune       chooses the peers' parameters again

Writes ``report.html``, ``report.md``, ``results.json`` and the figures. An interrupted run
resumes; results that depend on changed code, options or packages are measured again. Peers need
``pip install ".[bench]"``; the report names those that are missing.

    python bench/run_all.py --only list                  names the other sections of the bench
    python bench/run_all.py --only tno.developable       prints the tables of one section
    python bench/run_all.py --only tno jiang             all sections of these subjects
    python bench/run_all.py --only hybrid.speed n=16     with a setting of the section
    python bench/run_all.py --only tno --json FILE       the figures as JSON, too
"""

from __future__ import annotations

import argparse
import inspect
import json
import os
import sys
from pathlib import Path

# Every process of the run has one thread, unless a section is run with more; this must be set
# before NumPy is imported.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = os.environ.get(name, "1") if "--only" in sys.argv else "1"
# Nets run on the CPU, as the optimiser does, unless a section is asked for a device.
if not any(word.startswith("device=") for word in sys.argv):
    os.environ["CUDA_VISIBLE_DEVICES"] = ""

BENCH = Path(__file__).resolve().parent
sys.path.insert(0, str(BENCH))

from harness import call  # noqa: E402
from report import build, surfaces, tuning  # noqa: E402
from report.methods import methods  # noqa: E402
from report.quality import levels  # noqa: E402
from report.settings import FULL, QUICK  # noqa: E402
from report.store import Store, machine  # noqa: E402
from sections import SUBJECTS, sections  # noqa: E402

from gso.cli.progress import share  # noqa: E402


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="few surfaces, small grids")
    parser.add_argument("--out", type=Path, default=BENCH / "out", help="default: bench/out")
    parser.add_argument("--data", type=Path, metavar="DIR", help="set of gso dataset build")
    parser.add_argument("--store", action="store_true", help="keep the figures in bench/data")
    parser.add_argument("--tune", action="store_true", help="tune the peers, and end")
    parser.add_argument("--only", nargs="+", metavar="SECTION", help="sections and name=value")
    parser.add_argument("--json", type=Path, metavar="FILE", help="of --only: write the figures")
    arguments = parser.parse_args()
    if arguments.only:
        _sections(parser, arguments)
        return
    asked = [f"--{name}" for name in ("quick", "store", "tune") if getattr(arguments, name)]
    asked += ["--data DIR"] if arguments.data else []
    command = " ".join(["python bench/run_all.py", *asked])
    if arguments.tune:
        some = _screened(arguments.out, "validation")
        total = sum(len(levels(m.task)) for m in methods().values() if m.candidates)
        with build.bar(total, "tuning") as tick:
            tuning.tune(some, Store(arguments.out), command, tick)
        return
    settings = QUICK if arguments.quick else FULL
    folder = arguments.out / "surfaces"
    if arguments.data:
        some = surfaces.opened(folder, arguments.data)
    elif arguments.quick:
        some = surfaces.reference(folder)
    else:
        some = _screened(arguments.out, "test")
    out = arguments.out / settings.name
    result = build.run(settings, some, out, command)
    if arguments.store:
        _store(settings.name, result)
    print(out / "report.html")


def _sections(parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> None:
    """Run the sections that are named, or all of the subjects that are named."""
    words = [word for word in arguments.only if "=" not in word]
    # Other subjects are not imported: some of them load PyTorch.
    named = {word.partition(".")[0] for word in words}
    every = sections(s for s in SUBJECTS if s in named or words == ["list"])
    settings = dict(word.split("=", 1) for word in arguments.only if "=" in word)
    if arguments.data:
        settings["data"] = str(arguments.data)
    if words == ["list"]:
        for name, section in every.items():
            signature = str(inspect.signature(section)).partition(" ->")[0]
            print(f"{name:20s} {(section.__doc__ or '').splitlines()[0]}\n{'':20s} {signature}")
        return
    chosen = {n: s for n, s in every.items() if {n, n.partition(".")[0]} & {*words}}
    unknown = [w for w in words if not any(w in (n, n.partition(".")[0]) for n in chosen)]
    known = {p for s in chosen.values() for p in inspect.signature(s).parameters}
    if unknown or not chosen:
        parser.error(f"no section {', '.join(unknown) or 'named'}; --only list names them")
    if not settings.keys() <= known:
        parser.error(f"no setting {', '.join(settings.keys() - known)} in these sections")
    found = {}
    for name, section in chosen.items():
        needed = inspect.signature(section).parameters.values()
        missing = [p.name for p in needed if p.default is p.empty and p.name not in settings]
        if missing and name in words:
            parser.error(f"{name} needs {', '.join(f'{m}=...' for m in missing)}")
        if not missing:
            found[name] = call(section, settings)
    if arguments.json:
        text = json.dumps({**found, "machine": machine()}, indent=1, default=float)
        arguments.json.write_text(text + "\n")


def _screened(out: Path, split: str) -> surfaces.Surfaces:
    with share("surfaces") as show:
        return surfaces.screened(out / "surfaces", split, Store(out), lambda k, n: show(k / n))


def _store(name: str, result: dict[str, object]) -> None:
    """Store the figures for docs and tests; a quick run does not replace those of a full run."""
    records, whole = result.pop("records"), BENCH / "data" / "results.json"
    if name == QUICK.name:
        kept = {key: result[key] for key in ("command", "machine", "surfaces")}
        text = json.dumps({**kept, "records": records}, indent=1)
        (BENCH / "data" / "quick.json").write_text(text + "\n")
    if name == FULL.name or not whole.exists() or json.loads(whole.read_text())["run"] == name:
        whole.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()

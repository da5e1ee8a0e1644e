"""Metrics and times of the nets on surfaces that none was trained on.

    python bench/net.py DIR                    the table of all nets (DIR: a set of surfaces)
    python bench/net.py DIR --cards            the same, and writes it into the nets' cards
    python bench/net.py DIR --model RUN/model.safetensors    one net
    python bench/net.py DIR --others           also the splits that are not Bezier surfaces
    python bench/net.py --curve [NET...] --plot FILE         quality against training time
    python bench/net.py DIR --rounding RUN     effect of half precision on the net of a run
    python bench/net.py DIR --grid FILE        figure 5: loss against parameters (hours;
                                               with --stride 2 a quarter of them)

Figures are means over the test split. Times are for one surface, from array to array, on the
CPU, with OMP_NUM_THREADS threads: the smallest of several medians, because other work on a
shared machine can only increase them.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

# The default on a machine of two cores.
os.environ.setdefault("OMP_NUM_THREADS", "2")

import numpy as np
from report.published import NETS, TABLE_3
from tno import progress as watched

from gso import dataset, net
from gso.cli.progress import share
from gso.dataset.noise import LEVELS
from gso.io import replacing
from gso.net import catalogue, tasks, weights
from gso.net.training import checkpoint
from gso.net.training.config import from_dict
from gso.net.training.curves import read
from gso.net.training.run import CHECKPOINT

OTHERS = (
    "enneper",
    "monkey_saddle",
    "catenoid",
    "helicoid",
    "sphere",
    "torus",
    "teapot",
    "terrain",
)
#: Array that denoising is timed on.
TIMED = f"noisy_{LEVELS[1]:.3f}"
#: Figure 5: blocks per level, channels, surfaces, epochs.
BLOCKS, CHANNELS, SURFACES, EPOCHS = (2, 4, 6), (8, 16, 32), 2000, 10


def measured(task: str, model: Any, split: Any, count: int | None = None) -> dict[str, float]:
    """Return the mean metrics of a net over a split."""
    if task == "denoise":
        named = isinstance(model, str | Path)
        card = catalogue.read_card(catalogue.chain(model, task)[-1]) if named else {}
        low, high = card.get("config", {}).get("sigma", (0.0, 1.0))
        levels = [s for s in LEVELS if low <= s <= high]
        found = {}
        for level in levels:
            rows = over(task, model, split, f"noisy_{level:.3f}", count)
            found[f"theta_{level:g}"] = float(np.mean([r["theta"] for r in rows]))
        return found
    rows = over(task, model, split, "surface", count)
    out = {name: float(np.mean([r[name] for r in rows])) for name in rows[0] if name != "score"}
    return out


def over(
    task: str, model: Any, split: Any, array: str, count: int | None
) -> list[dict[str, float]]:
    """Return the metrics of every surface of a split."""
    rows = []
    total = min(len(split), count or len(split))
    for k in watched(range(0, total, 32), f"{model or 'default'} {split.name} {array}"):
        block = slice(k, min(k + 32, total))
        clean = split["surface"][block]
        given = clean if array == "surface" else split[array][block]
        results = net.predict(given, task=task, model=model)
        rows += [tasks.get(task).figures(a, b) for a, b in zip(clean, results, strict=True)]
    return rows


def milliseconds(
    task: str, model: Any, surface: np.ndarray, times: int = 20, rounds: int = 10
) -> float:
    """Return the smallest of several medians of the time for one surface, array to array."""
    spent = np.empty((rounds, times))
    net.predict(surface, task=task, model=model)
    for place in np.ndindex(spent.shape):
        start = time.perf_counter()
        net.predict(surface, task=task, model=model)
        spent[place] = time.perf_counter() - start
    return 1e3 * float(np.median(spent, axis=1).min())


def line(name: str, found: dict[str, float], published: dict[str, float]) -> str:
    """Format one net as one line, with published figures in brackets."""
    parts = []
    for key, value in found.items():
        beside = f" ({published[key]:.4g})" if key in published else ""
        parts.append(f"{key} {value:.4g}{beside}")
    return f"{name:16s} " + "  ".join(parts)


def rows(arguments: argparse.Namespace) -> None:
    """Print the table of nets; with ``--cards`` also write it into their cards."""
    data = dataset.open(arguments.data)
    names = [arguments.model] if arguments.model else net.available()
    if not names:
        print("no net comes with the package yet; give --model RUN/model.safetensors")
    for name in names:
        first = catalogue.CHAINS.get(name, (name,))[0]
        task = catalogue.read_card(catalogue.located(first))["model"]["task"]
        found = measured(task, name, data["test"], arguments.n)
        timed = TIMED if task == "denoise" else "surface"
        found["ms"] = milliseconds(task, name, data["test"][timed][0])
        published = NETS.get(name, {})
        if task == "denoise":
            published = {f"theta_{s:g}": row["theta"] for s, row in TABLE_3.items()}
        print(line(Path(name).stem, found, published), flush=True)
        others = {}
        if arguments.others and task != "denoise":
            for other in (o for o in OTHERS if o in data):
                figures_there = measured(task, name, data[other], arguments.n)
                others[other] = counted(figures_there, data[other], arguments.n)
                print(line(f"  {other}", figures_there, {}), flush=True)
        if arguments.cards:
            path = catalogue.chain(name, task)[-1]
            of = f" of {name}" if name in catalogue.CHAINS else ""
            card = catalogue.read_card(path)
            card[f"test{of}"] = counted(found, data["test"], arguments.n)
            if others:
                card[f"other splits{of}"] = others
            weights.write_card(path.with_suffix(".json"), card)


def counted(found: dict[str, float], split: Any, most: int | None) -> dict[str, float]:
    """Add the number of surfaces that the metrics are means of."""
    return found | {"surfaces": min(len(split), most or len(split))}


def rounding(arguments: argparse.Namespace) -> None:
    """Print the change of every metric when a net is stored in half precision."""
    data = dataset.open(arguments.data)
    with tempfile.TemporaryDirectory() as folder:
        exact = weights.load(arguments.rounding / "model.safetensors")
        checkpoint.load(arguments.rounding / CHECKPOINT, exact, exact, [])
        task = exact.task
        halved = Path(folder) / "half.safetensors"
        weights.save(exact, halved)
        one, other = (measured(task, m, data["test"], arguments.n) for m in (exact, halved))
    for name, value in one.items():
        change = abs(other[name] - value) / max(abs(value), 1e-12)
        print(f"{name:18s} {value:.6g}  in half precision {other[name]:.6g}  {change:.2%}")


def curve(names: list[str], target: str) -> None:
    """Plot the validation metric in the cards against the hours of training."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7, 4.5), constrained_layout=True)
    for name in names:
        card = catalogue.read_card(catalogue.located(name))
        seen = np.array(card["curve"]).reshape(-1, 2)
        label = f"{card['name']}: {tasks.get(card['model']['task']).score}"
        axes.plot(*seen.T, marker=".", label=label)
    axes.set(xlabel="hours", ylabel="validation, lower is better", yscale="log")
    axes.legend()
    figure.savefig(target)


def _told(show: Any, name: str, report: Any) -> None:
    """Show the progress of training one of the nets."""
    show(report.progress, f"{name}: {report.left / 60:.0f} min left, loss {report.loss:.4g}")


def grid(arguments: argparse.Namespace) -> None:
    """Train the nets of figure 5: several sizes, supervised on the optimiser's results.

    Nets that are already in the file are not trained again. An interrupted net resumes from its
    run, in a folder beside the file.
    """
    path, stride = Path(arguments.grid), arguments.stride
    record = json.loads(path.read_text()) if path.exists() else {"stride": stride, "rows": []}
    if record["stride"] != stride:
        raise SystemExit(f"{path} was begun with --stride {record['stride']}")
    table = record["rows"]
    done = {(row["blocks"], row["channels"]) for row in table}
    for blocks in BLOCKS:
        for channels in CHANNELS:
            if (blocks, channels) in done:
                continue
            config = from_dict(
                {
                    "name": f"nb{blocks}-nc{channels}",
                    "task": "developable",
                    "augment": "none",
                    "steps": EPOCHS * SURFACES // 20,
                    "limit": SURFACES,
                    "model": {"kind": "gsonet", "channels": channels, "blocks": blocks},
                    "phase": [{"loss": "label", "batch": 20, "rate": 1e-3, "stride": stride}],
                    "validate_every": 1e9,
                }
            )
            run = path.with_suffix("") / config.name
            with share() as show:
                shown = partial(_told, show, config.name)
                card = net.train(config, arguments.data, run, show=shown)
            losses = [r["loss"] for r in read(run) if "loss" in r]
            row = {
                "blocks": blocks,
                "channels": channels,
                "parameters": card["parameters"],
                "loss": float(np.mean(losses[-5:])),
                "hours": card["hours"],
            }
            if stride == 1:
                row |= card["validation"]
            table.append(row)
            print(line(config.name, {k: v for k, v in row.items() if k[0] != "b"}, {}), flush=True)
            record["command"] = f"python bench/net.py DIR --grid {path} --stride {stride}"
            with replacing(path) as file:
                file.write((json.dumps(record, indent=1) + "\n").encode())
            shutil.rmtree(run)


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", nargs="?", metavar="DIR", help="set of surfaces")
    parser.add_argument("--model", metavar="NET", help="a name or a .safetensors file")
    parser.add_argument("-n", type=int, metavar="N", help="only so many surfaces of each split")
    parser.add_argument("--others", action="store_true", help="splits that are no Bezier surfaces")
    parser.add_argument("--cards", action="store_true", help="write the figures into the cards")
    parser.add_argument("--rounding", type=Path, metavar="RUN", help="half precision, measured")
    parser.add_argument("--grid", metavar="FILE", help="figure 5, as JSON")
    parser.add_argument(
        "--stride", type=int, default=1, metavar="N", help="of --grid: every N-th vertex"
    )
    parser.add_argument("--curve", nargs="*", metavar="NET", help="plot these, or all")
    parser.add_argument("--plot", default="curves.png", metavar="FILE", help="for --curve")
    arguments = parser.parse_args()
    if arguments.curve is not None:
        every = [name for name in net.available() if name not in catalogue.CHAINS]
        curve(arguments.curve or every, arguments.plot)
    elif arguments.data is None:
        parser.error("give a set of surfaces")
    elif arguments.rounding:
        rounding(arguments)
    elif arguments.grid:
        grid(arguments)
    else:
        rows(arguments)


if __name__ == "__main__":
    main()

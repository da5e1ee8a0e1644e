"""Metrics and times of the nets on surfaces that none was trained on.

Figures are means over the test split. Times are for one surface, from array to array, on the
CPU, with OMP_NUM_THREADS threads: the smallest of several medians, because other work on a
shared machine can only increase them.
"""

from __future__ import annotations

import json
import shutil
import tempfile
import time
from functools import partial
from itertools import groupby, product
from pathlib import Path
from typing import Any

import numpy as np
from harness import axes_of, progress, tabulate, timed
from report.published import NETS, TABLE_3
from scipy.linalg import cholesky_banded

from gso import dataset, net
from gso.cli.progress import share
from gso.dataset import LEVELS
from gso.dataset.recipe import VERSION
from gso.dataset.shapes import NAMES
from gso.io import replacing
from gso.io.json_file import write_json
from gso.net import catalogue, tasks, weights
from gso.net.training import checkpoint, from_dict
from gso.net.training.training_curves import read
from gso.net.training.training_run import CHECKPOINT

#: Array that denoising is timed on.
TIMED = f"noisy_{LEVELS[1]:.3f}"
#: Figure 5: blocks per level, channels, surfaces, epochs.
BLOCKS, CHANNELS, SURFACES, EPOCHS = (2, 4, 6), (8, 16, 32), 2000, 10


def measured(task: str, model: Any, split: Any, count: int = 0) -> dict[str, float]:
    """Return the mean metrics of a net over a split."""
    if not tasks.get(task).noisy:
        found = over(task, model, split, "surface", count)
        return {name: value for name, value in found.items() if name != "score"}
    named = isinstance(model, str | Path)
    card = catalogue.read_card(catalogue.chain(model, task)[-1]) if named else {}
    low, high = card.get("config", {}).get("sigma", (0.0, 1.0))
    return {
        f"theta_{s:g}": over(task, model, split, f"noisy_{s:.3f}", count)["theta"]
        for s in LEVELS
        if low <= s <= high
    }


def task_of(name: str) -> str:
    """Return the task of a net, or of a chain of nets."""
    task: str = catalogue.read_card(catalogue.located(catalogue.parts(name)[0]))["model"]["task"]
    return task


def over(task: str, model: Any, split: Any, array: str, count: int) -> dict[str, float]:
    """Return the mean metrics over a split."""
    figures, rows = tasks.get(task).figures, []
    total = min(len(split), count or len(split))
    for k in progress(range(0, total, 32), f"{model or 'default'} {split.name} {array}"):
        block = slice(k, min(k + 32, total))
        results = net.predict(split[array][block], task=task, model=model)
        rows += [figures(a, b) for a, b in zip(split["surface"][block], results, strict=True)]
    return {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}


def milliseconds(task: str, model: Any, surface: np.ndarray) -> float:
    """Return the smallest of several medians of the time for one surface, array to array."""
    spent = np.empty((10, 20))
    net.predict(surface, task=task, model=model)
    for place in np.ndindex(spent.shape):
        spent[place] = timed(net.predict, surface, task=task, model=model)[1]
    return 1e3 * float(np.median(spent, axis=1).min())


def line(name: str, found: dict[str, float], published: dict[str, float]) -> str:
    """Format one net as one line, with published figures in brackets."""
    parts = []
    for key, value in found.items():
        beside = f" ({published[key]:.4g})" if key in published else ""
        parts.append(f"{key} {value:.4g}{beside}")
    return f"{name:16s} " + "  ".join(parts)


def rows(
    data: Path, model: str = "", n: int = 0, others: bool = False, cards: bool = False
) -> dict[str, Any]:
    """Print the table of nets; with `cards` also write it into their cards.

    `others` adds the splits that are no Bezier surfaces, and `n` limits the surfaces of a split.
    """
    opened, out = dataset.open(data), {}
    for name in [model] if model else net.available():
        task = task_of(name)
        noisy = tasks.get(task).noisy
        found = measured(task, name, opened["test"], n)
        found["ms"] = milliseconds(task, name, opened["test"][TIMED if noisy else "surface"][0])
        published = NETS.get(name, {})
        if noisy:
            published = {f"theta_{s:g}": row["theta"] for s, row in TABLE_3.items()}
        print(line(Path(name).stem, found, published), flush=True)
        elsewhere = {}
        for other in (o for o in NAMES if others and not noisy and o in opened):
            figures = measured(task, name, opened[other], n)
            elsewhere[other] = counted(figures, opened[other], n)
            print(line(f"  {other}", figures, {}), flush=True)
        out[name] = found
        if cards:
            path = catalogue.chain(name, task)[-1]
            of = f" of {name}" if name in catalogue.CHAINS else ""
            card = catalogue.read_card(path)
            card[f"test{of}"] = counted(found, opened["test"], n)
            if elsewhere:
                card[f"other splits{of}"] = elsewhere
            write_json(path.with_suffix(".json"), card)
    return out


def counted(found: dict[str, float], split: Any, most: int) -> dict[str, float]:
    """Add the number of surfaces that the metrics are means of."""
    return found | {"surfaces": min(len(split), most or len(split))}


def cards() -> dict[str, Any]:
    """Print what the cards say: kind of net, version of the data, hours, and chain of runs.

    The hours are those of all runs of the chain. A run is named with the hours under its name
    until then; ``>`` is a run that starts from the weights of the one before.
    """
    table = {}
    for name in (name for name in net.available() if name not in catalogue.CHAINS):
        card = catalogue.read_card(catalogue.located(name))
        chain = [card]
        while "begun_with" in chain[-1]:
            chain.append(chain[-1]["begun_with"])
        last = [next(group) for _, group in groupby(chain, key=lambda run: run["name"])]
        table[name] = {
            "kind": card["model"]["kind"],
            "data": card["data"]["version"],
            "steps": card["steps"],
            "hours": round(sum(run["hours"] for run in last), 3),
            "runs": len(chain),
            "chain": " > ".join(f"{run['name']} {run['hours']:g}" for run in reversed(last)),
        }
    title = f"Cards of the nets; today's data have version {VERSION}"
    return tabulate(title, ["net"], table)


def rounding(data: Path, run: Path, n: int = 0) -> dict[str, Any]:
    """Print the change of every metric when the net of a run is stored in half precision."""
    split = dataset.open(data)["test"]
    with tempfile.TemporaryDirectory() as folder:
        exact = weights.load(run / "model.safetensors")
        checkpoint.load(run / CHECKPOINT, exact, exact, [])
        halved = Path(folder) / "half.safetensors"
        weights.save(exact, halved)
        one, other = (measured(exact.task, m, split, n) for m in (exact, halved))
    rows = {name: {"exact": x, "half": other[name]} for name, x in one.items()}
    for name, x in one.items():
        rows[name]["change %"] = 100.0 * abs(other[name] - x) / max(abs(x), 1e-12)
    return tabulate("Metrics of the net of the run, and in half precision", ["metric"], rows)


def curve(plot: str = "curves.png") -> dict[str, Any]:
    """Plot the validation metric in the cards against the hours of training."""
    with axes_of(plot, xlabel="hours", ylabel="validation, lower is better") as axes:
        for name in (name for name in net.available() if name not in catalogue.CHAINS):
            card = catalogue.read_card(catalogue.located(name))
            seen = np.array(card["curve"]).reshape(-1, 2)
            label = f"{card['name']}: {tasks.get(card['model']['task']).score}"
            axes.plot(*seen.T, marker=".", label=label)
    return {}


def grid(data: Path, file: Path, stride: int = 1) -> dict[str, Any]:
    """Train the nets of figure 5: several sizes, supervised on the optimiser's results (hours).

    With ``stride=2`` it takes a quarter of the time.

    Nets that are already in the file are not trained again. An interrupted net resumes from its
    run, in a folder beside the file.
    """
    record = json.loads(file.read_text()) if file.exists() else {"stride": stride, "rows": []}
    if record["stride"] != stride:
        raise SystemExit(f"{file} was begun with stride= {record['stride']}")
    command = f"python bench/run_all.py --only net.grid data=DIR file={file} stride={stride}"
    done = {(row["blocks"], row["channels"]) for row in record["rows"]}
    for blocks, channels in product(BLOCKS, CHANNELS):
        if (blocks, channels) in done:
            continue
        row = _trained(blocks, channels, stride, data, file.with_suffix(""))
        record["rows"].append(row)
        record["command"] = command
        with replacing(file) as stream:
            stream.write((json.dumps(record, indent=1) + "\n").encode())
    return record


def _trained(blocks: int, channels: int, stride: int, data: Path, folder: Path) -> dict[str, Any]:
    """Train one net in a folder, which is removed then, and return its row."""
    phase = {"loss": "label", "batch": 20, "rate": 1e-3, "stride": stride}
    config = from_dict(
        {
            "name": f"nb{blocks}-nc{channels}",
            "task": "developable",
            "augment": "none",
            "steps": EPOCHS * SURFACES // 20,
            "limit": SURFACES,
            "model": {"kind": "gsonet", "channels": channels, "blocks": blocks},
            "phase": [phase],
            "validate_every": 1e9,
        }
    )
    run = folder / config.name
    with share(config.name) as show:

        def told(report: Any) -> None:
            show(report.progress, f"loss {report.loss:.4g}", report.left)

        card = net.train(config, data, run, show=told)
    losses = [r["loss"] for r in read(run) if "loss" in r]
    row = {"parameters": card["parameters"], "loss": float(np.mean(losses[-5:]))}
    row |= {"hours": card["hours"], **(card["validation"] if stride == 1 else {})}
    print(line(config.name, row, {}), flush=True)
    shutil.rmtree(run)
    return {"blocks": blocks, "channels": channels, **row}


def cost(n: int = 40) -> dict[str, Any]:
    """Print the CPU time of a prediction beside that of one banded Cholesky factorisation.

    The matrix has the size and the bandwidth of a Gauss-Newton step of the surface, 64 x 64
    vertices row by row. All are computed `n` times, in turn. Use OMP_NUM_THREADS=1.
    """
    x, y = np.mgrid[-1:1:64j, -1:1:64j]
    surface = np.dstack([x, y, 0.2 * x * y + 0.1 * np.sin(2.0 * x)])
    band = 3 * (len(surface) + 1)
    matrix = np.random.default_rng(0).normal(0.0, 0.01, (band + 1, surface.size))
    matrix[0] = 10.0
    ways = {"Cholesky factorisation": partial(cholesky_banded, matrix, lower=True)}
    for name in net.available():
        ways[name] = partial(net.predict, surface, task=task_of(name), model=name)
    spent = {name: np.empty(n) for name in ways}
    for k in range(-1, n):
        for name, way in ways.items():
            clock = time.process_time()
            way()
            spent[name][k] = time.process_time() - clock
    middle = {name: float(np.median(s)) for name, s in spent.items()}
    whole = middle["Cholesky factorisation"]
    rows = {name: {"ms": 1e3 * s, "ratio": s / whole} for name, s in middle.items()}
    return tabulate(f"CPU time; {surface.size} unknowns, bandwidth {band}", ["what"], rows)


SECTIONS = (rows, cards, cost, rounding, curve, grid)

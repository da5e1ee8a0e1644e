"""Comparison of the statistics of a set of surfaces with those in the repository.

The surfaces depend on the seed only. The labels differ in their last digits between machines
and versions; the tolerance of two percent covers these differences.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from harness import BENCH

from gso import dataset
from gso.typing import Json

COMMITTED = BENCH / "data" / "dataset_manifest.json"


def statistics(data: Path, write: bool = False) -> dict[str, Any]:
    """Compare the statistics of a set made by ``gso dataset build --n 10401 --seed 0``.

    With `write` they replace those in the repository.
    """
    record = dataset.open(data).manifest
    if write:
        kept = {key: value for key, value in record.items() if key != "files"}
        COMMITTED.write_text(json.dumps(kept, indent=1) + "\n")
        return {}
    committed = json.loads(COMMITTED.read_text())
    found = [
        f"recipe/{key}: {record['recipe'][key]} and {value}"
        for key, value in committed["recipe"].items()
        if record["recipe"][key] != value
    ]
    found += differences(record["summary"], committed["summary"])
    if found:
        raise SystemExit("\n".join(found))
    print("the same, within the tolerance")
    return {}


SECTIONS = (statistics,)


#: Splits whose means are compared; in other splits extreme values dominate the mean.
_EVEN = ("train", "validation", "test")


def differences(one: Json, other: Json, *, tolerance: float = 0.02) -> list[str]:
    """List where two summaries differ by more than a tolerance, relative to the larger number.

    Counts may differ by two in any case: a draw on the border of an interval can fall on
    either side of it on another machine. For the hard and named splits, means and 90th
    percentiles are not compared.

    Examples
    --------
    >>> a = {"test": {"count": 10, "features": {"K_A": {"mean": 0.300, "median": 0.2}}}}
    >>> b = {"test": {"count": 11, "features": {"K_A": {"mean": 0.307, "median": 0.2}}}}
    >>> differences(a, b)
    ['test/features/K_A/mean: 0.3 and 0.307']
    """
    left, right = dict(_leaves(one)), dict(_leaves(other))
    found = []
    for path in sorted(left.keys() | right.keys()):
        split, *_, last = path.split("/")
        if split not in _EVEN and last in ("mean", "p90"):
            continue
        a, b = left.get(path), right.get(path)
        if not _close(a, b, tolerance):
            found.append(f"{path}: {a} and {b}")
    return found


def _leaves(
    tree: Json | list[float] | float | None, path: str = ""
) -> Iterator[tuple[str, float | None]]:
    if isinstance(tree, dict | list):
        for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
            yield from _leaves(value, f"{path}/{key}" if path else str(key))
    else:
        yield path, tree


def _close(a: float | None, b: float | None, tolerance: float) -> bool:
    if isinstance(a, int) or isinstance(b, int):
        # A count that only one summary has is zero in the other.
        a, b = a or 0, b or 0
        return abs(a - b) <= max(2, tolerance * max(abs(a), abs(b)))
    if a is None or b is None:
        return a is b
    return abs(a - b) <= tolerance * max(abs(a), abs(b)) + 1e-12

"""Comparison of the statistics of a set of surfaces with those in the repository.

The surfaces depend on the seed only. The labels differ in their last digits between machines
and versions; the tolerance of two percent covers these differences.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from harness import BENCH

from gso import dataset
from gso.dataset import differences

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

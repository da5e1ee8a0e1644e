"""Compare the statistics of a set of surfaces with those in the repository.

    gso dataset build --n 10401 --seed 0 -o DIR     makes the set
    python bench/dataset.py DIR                     compares it; exit code 1 if they differ
    python bench/dataset.py DIR --write             replaces the statistics

The surfaces depend on the seed only. The labels differ in their last digits between machines
and versions; the tolerance of two percent covers these differences.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from gso import dataset
from gso.dataset.summary import differences

COMMITTED = Path(__file__).resolve().parent / "data" / "dataset_manifest.json"


def main() -> None:
    """Compare the statistics, or replace them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", metavar="DIR", type=Path)
    parser.add_argument("--write", action="store_true", help="replace the committed statistics")
    arguments = parser.parse_args()
    record = dataset.open(arguments.folder).manifest
    if arguments.write:
        kept = {key: value for key, value in record.items() if key != "files"}
        COMMITTED.write_text(json.dumps(kept, indent=1) + "\n")
        return
    committed = json.loads(COMMITTED.read_text())
    found = [
        f"recipe/{key}: {record['recipe'][key]} and {value}"
        for key, value in committed["recipe"].items()
        if record["recipe"][key] != value
    ]
    found += differences(record["summary"], committed["summary"])
    print("\n".join(found) or "the same, within the tolerance")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()

"""Strip packing by sparrow (spyrrow), in a process of its own: it can end the one it runs in.

Source: Gardeyn and Wauters 2025, An open-source heuristic to reboot 2D nesting research.
"""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.util import find_spec

#: Seconds that starting takes at most, and that a solve may take beyond its time.
_START = 30.0


def solved(
    items: list[dict[str, object]], height: float, seconds: float, seed: int
) -> tuple[list[dict[str, float]] | None, str]:
    """Pack polygons into a strip of a given height and least length.

    Parameters
    ----------
    items : list of dict
        "shape": its corners; "count"; "angles": allowed rotations in degrees, None for all.
    height : float
    seconds : float
    seed : int

    Returns
    -------
    placed : list of dict, or None
        "item", "angle" in degrees, "x" and "y" of the translation after the rotation.
    why : str
        Why there is no result.
    """
    if find_spec("spyrrow") is None:
        return None, 'spyrrow is not installed: pip install ".[workshop]"'
    whole = max(round(seconds), 1)
    asked = {
        "items": items,
        "height": height,
        "seconds": whole,
        "seed": seed,
    }
    try:
        done = subprocess.run(
            [sys.executable, "-m", "gso.workshop.sparrow"],
            input=json.dumps(asked),
            capture_output=True,
            text=True,
            timeout=_START + 2.0 * whole,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None, "spyrrow took too long"
    if done.returncode != 0:
        return None, f"spyrrow ended with code {done.returncode}"
    try:
        return json.loads(done.stdout.splitlines()[-1]), ""
    except (ValueError, IndexError):
        return None, "spyrrow gave no result"


def main() -> None:
    """Solve what is read from the input, and print the result."""
    import spyrrow

    asked = json.load(sys.stdin)
    items = [
        spyrrow.Item(str(k), [tuple(p) for p in item["shape"]], item["count"], item["angles"])
        for k, item in enumerate(asked["items"])
    ]
    instance = spyrrow.StripPackingInstance("parts", asked["height"], items)
    config = spyrrow.StripPackingConfig(
        early_termination=True,
        total_computation_time=asked["seconds"],
        num_workers=1,
        seed=asked["seed"],
    )
    found = instance.solve(config)
    placed = [
        {"item": int(p.id), "angle": p.rotation, "x": p.translation[0], "y": p.translation[1]}
        for p in found.placed_items
    ]
    sys.stdout.write(json.dumps(placed) + "\n")


if __name__ == "__main__":
    main()

"""Strip packing by sparrow (spyrrow), in a process of its own: it can end the one it runs in.

Source: Gardeyn and Wauters 2025, An open-source heuristic to reboot 2D nesting research.
"""

from __future__ import annotations

from concurrent.futures import BrokenExecutor, TimeoutError
from importlib.util import find_spec

from gso.executors.process_pool import ProcessExecutor
from gso.typing import Json

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
    with ProcessExecutor(1) as executor:
        try:
            placed = executor.submit(packed, items, height, whole, seed)
            return placed.result(_START + 2.0 * whole), ""
        except TimeoutError:
            return None, "spyrrow took too long"
        except BrokenExecutor:
            return None, "spyrrow ended its process"
        except Exception as error:  # of a package that we do not know
            return None, f"spyrrow failed: {error}"


def packed(items: list[Json], height: float, seconds: int, seed: int) -> list[Json]:
    """Pack polygons as :func:`solved` does, in this process."""
    import spyrrow

    instance = spyrrow.StripPackingInstance(
        "parts",
        height,
        [
            spyrrow.Item(str(k), [tuple(p) for p in item["shape"]], item["count"], item["angles"])
            for k, item in enumerate(items)
        ],
    )
    config = spyrrow.StripPackingConfig(
        early_termination=True, total_computation_time=seconds, num_workers=1, seed=seed
    )
    return [
        {"item": int(p.id), "angle": p.rotation, "x": p.translation[0], "y": p.translation[1]}
        for p in instance.solve(config).placed_items
    ]

"""Batches as a pure function of the step, so that a run can be resumed at any step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from gso.dataset import store
from gso.dataset.drawing import draw_broad, draw_many
from gso.errors import DatasetError
from gso.io import replacing
from gso.net import tasks
from gso.net.models.grid_geometry import ball, normalise
from gso.net.training import augment
from gso.net.training.config import Config, Phase
from gso.typing import Ints

#: Progress callback: (name of the counted items, number done, total number).
Tick = Callable[[str, int, int], None]

#: Keys of the run's random streams.
_ORDER, _CHANGES, _FRESH = 0, 1, 2
#: Number of surfaces drawn with one seed.
_DRAWN = 256
#: Fraction of a GPU's free memory that a run's surfaces may take.
_ROOM = 0.5
#: Augmentations by their name in a configuration.
_AUGMENTED = {"symmetries": augment.symmetries, "shear": augment.shear}


@dataclass(frozen=True)
class Batch:
    """Surfaces of one step on one process.

    Attributes
    ----------
    surface : Tensor, (B, H, W, 3)
        Input of the net, in the unit ball.
    target : Tensor, (B, H, W, d), or None
        Labels; where inputs have noise, the surfaces without it.
    sigma : Tensor, (B,), or None
        Standard deviation of the noise of each surface.
    design : Tensor, (B, H, W, 3), or None
        Surfaces with which results are compared, if these differ from `surface`.
    step : int
        Step of the run.
    """

    surface: Tensor
    target: Tensor | None = None
    sigma: Tensor | None = None
    design: Tensor | None = None
    step: int = 0

    @property
    def compared(self) -> Tensor:
        """Surfaces with which results are compared."""
        return self.surface if self.design is None else self.design


@dataclass
class Source:
    """Surfaces in memory; those without labels come last.

    Attributes
    ----------
    surfaces : Tensor, (n, H, W, 3)
    labels : Tensor, (m, H, W, d), or None
        Labels of the first m surfaces.
    designs : Tensor, (n, H, W, 3), or None
        The designs, if `surfaces` are another net's results for them.
    """

    surfaces: Tensor
    labels: Tensor | None = None
    designs: Tensor | None = None

    def placed(self, device: torch.device) -> Source:
        """Copy to a GPU if there is room, because gathering batches on the CPU is slower."""
        arrays = [self.surfaces, self.labels, self.designs]
        size = sum(x.numel() * x.element_size() for x in arrays if x is not None)
        if device.type != "cuda" or size > _ROOM * torch.cuda.mem_get_info(device)[0]:
            return self
        return Source(*(None if x is None else x.to(device) for x in arrays))  # type: ignore[arg-type]

    def count(self, phase: Phase) -> int:
        """Return the number of surfaces that a phase sees: those with labels, if it needs them."""
        return len(self.labels if phase.labelled and self.labels is not None else self.surfaces)

    def batch(
        self,
        config: Config,
        phase: Phase,
        step: int,
        *,
        rank: int = 0,
        world: int = 1,
        device: torch.device | str = "cpu",
    ) -> Batch:
        """Return the part of a step's batch that belongs to process `rank` of `world`.

        The surfaces of a step do not depend on the number of processes.
        """
        if phase.labelled and self.labels is None:
            raise DatasetError(f"there are no labels {config.label!r} to learn")
        labels = self.labels if phase.labelled else None
        count = self.count(phase)
        rows = _rows(count, phase.batch, step, config.seed).to(self.surfaces.device)
        generator = torch.Generator().manual_seed(_seed(config.seed, _CHANGES, step))
        arrays = {"surface": self.surfaces}
        if labels is not None:
            arrays["target"] = labels
        if self.designs is not None:
            arrays["design"] = self.designs
        chosen = [x[rows] for x in arrays.values()]
        if config.augment != "none":
            chosen = _AUGMENTED[config.augment](chosen, generator)
        chosen = [x[:, :: phase.stride, :: phase.stride] for x in chosen]
        found = dict(zip(arrays, chosen, strict=True))
        if tasks.get(config.task).noisy:
            seen = noisy(found["surface"], config.sigma, generator)
            found = dict(zip(("surface", "target", "sigma"), seen, strict=True))
        mine = slice(rank, None, world)
        placed = {k: x[mine].to(device, torch.float32) for k, x in found.items()}
        return Batch(**placed, step=step)


def noisy(
    clean: Tensor, levels: tuple[float, float], generator: torch.Generator
) -> tuple[Tensor, Tensor, Tensor]:
    """Add noise to surfaces; return noisy surfaces, clean surfaces and standard deviations.

    The noisy surfaces are normalised to the unit ball; the other results are scaled with them.
    """
    low, high = np.log(levels[0]), np.log(levels[1])
    sigma = torch.exp(low + (high - low) * torch.rand(len(clean), generator=generator)).to(clean)
    noise = torch.randn(clean.shape, generator=generator).to(clean)
    seen = clean + sigma[:, None, None, None] * noise
    centre, radius = ball(seen)
    return (seen - centre) / radius, (clean - centre) / radius, sigma / radius.ravel()


def _seed(seed: int, *key: int) -> int:
    """Derive the seed of an item of a random stream."""
    return int(np.random.SeedSequence(seed, spawn_key=key).generate_state(1, np.uint64)[0] >> 1)


def _rows(count: int, batch: int, step: int, seed: int) -> Tensor:
    """Return the rows of a step; each epoch has its own random order."""
    places = np.arange(step * batch, (step + 1) * batch)
    epochs, within = np.divmod(places, count)
    return torch.from_numpy(
        np.array([_order(count, int(e), seed)[w] for e, w in zip(epochs, within, strict=True)])
    )


@lru_cache(maxsize=4)
def _order(count: int, epoch: int, seed: int) -> Ints:
    return np.random.default_rng(_seed(seed, _ORDER, epoch)).permutation(count)


def open_source(
    config: Config, folder: str | Path, cache: Path, tick: Tick | None = None
) -> Source:
    """Load the surfaces of a run: those of the train split, freshly drawn ones, the broad set's.

    Parameters
    ----------
    config : Config
    folder : path
        Folder of the dataset.
    cache : Path
        Folder of the files that keep the drawn surfaces.
    tick : callable, optional
        Progress callback, called with the name of the counted items, the number done and the
        total number.
    """
    split = store.open(folder)["train"]
    rows = slice(config.limit or None)
    given = torch.from_numpy(split["surface"][rows])
    if given.shape[1] != given.shape[2]:
        height, width = given.shape[1:3]
        raise DatasetError(f"{folder} has grids {height} x {width}; nets learn from square ones")
    surfaces, labels = normalise(given).float(), None
    if not config.teacher and any(phase.labelled for phase in config.phases):
        centre, radius = ball(given)
        labels = torch.from_numpy(split[config.label][rows])
        # Flat images are not translated: their position is independent of the surface's.
        labels = ((labels - centre if labels.shape[-1] == 3 else labels) / radius).float()
        # Surfaces for which the solver failed have no label.
        sound = labels.isfinite().all(dim=(1, 2, 3))
        surfaces = torch.cat([surfaces[sound], surfaces[~sound]])
        labels = labels[sound]
    size = surfaces.shape[1]
    more = [
        fresh(config.fresh, config.seed, size, cache / f"fresh-{config.seed}.npy", tick),
        broad(config.broad, config.seed, size, cache / f"broad-{config.seed}.npy", tick),
    ]
    return Source(torch.cat([surfaces, *more]), labels)


def fresh(count: int, seed: int, size: int, cache: Path, tick: Tick | None = None) -> Tensor:
    """Draw surfaces (count, size, size, 3) by the recipe that are in no dataset, or load them.

    They are cached in a file, which is replaced if its count or size differs. The seed is not
    checked: the name of the file must identify it.
    """

    def draw() -> NDArray[np.float32]:
        pieces = [(min(_DRAWN, count - k), _seed(seed, _FRESH, k)) for k in range(0, count, _DRAWN)]
        return draw_many(pieces, size, _told(tick, "surfaces drawn", count))

    return _kept(draw, (count, size, size, 3), cache)


def broad(count: int, seed: int, size: int, cache: Path, tick: Tick | None = None) -> Tensor:
    """Draw surfaces (count, size, size, 3) of the broad set's train split, or load them.

    They are cached as those of :func:`fresh`.
    """

    def draw() -> NDArray[np.float32]:
        told = _told(tick, "surfaces of the broad set drawn", count)
        return draw_broad("train", count, seed=seed, size=size, tick=told)

    return _kept(draw, (count, size, size, 3), cache)


def _told(tick: Tick | None, what: str, count: int) -> Callable[[int], None] | None:
    """Return a callback that takes the number made only."""
    if tick is None:
        return None
    told = tick
    return lambda made: told(what, made, count)


def _kept(draw: Callable[[], NDArray[np.float32]], shape: tuple[int, ...], cache: Path) -> Tensor:
    """Load an array from a file, or make it and write the file."""
    if not shape[0]:
        return torch.zeros(shape)
    try:
        kept = np.load(cache, allow_pickle=False)
        if kept.shape == shape and kept.dtype == np.float32:
            return torch.from_numpy(kept)
    except (OSError, ValueError, EOFError):
        pass
    drawn = draw()
    with replacing(cache) as file:
        np.save(file, drawn, allow_pickle=False)
    return torch.from_numpy(drawn)

"""The figures of the paper, and time against size."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from harness import BENCH

from gso import geometry, metrics
from gso.dataset import CURVATURE
from gso.mesh import Mesh
from gso.plot import GRAZING, Heat, Panel, Scale, View, curvatures, distance, strain
from gso.plot.draw import draw
from gso.typing import Array
from report.examples import Example, Examples
from report.method import TASKS
from report.published import CHOSEN
from report.quality import Records
from report.timing import METHODS, PHASES, Timing, exponent

#: The file with the runs of figure 5.
GRID = BENCH / "data" / "architecture_grid.json"
#: Methods of figure 6.
CURVES = ("TNO jiang2020", "TNO balanced", "Net-S", "Net-C", "Net-CF", "Net", "hybrid")
#: Percentile of all values that is the upper end of a colour scale shared by several panels.
_TOP = 99.0


@dataclass(frozen=True)
class Figure:
    """A picture and its caption."""

    caption: str
    path: Path


#: By the names of the report's template.
Figures = dict[str, list[Figure]]


def drawn(folder: Path, records: Records, times: Sequence[Timing], examples: Examples) -> Figures:
    """Draw every figure into a folder."""
    noisy = [(sigma, some) for (task, sigma), some in examples.items() if task == "denoise"]
    return {
        "5": [figure_5(folder)],
        "6": [figure_6(folder, records)],
        "7": [*figure_7(folder, examples["developable", 0.0])],
        "8": [*figure_8(folder, examples["flatten", 0.0])],
        "9": [figure for sigma, some in noisy for figure in figure_9(folder, sigma, some)],
        "time": [time_against_size(folder, times), shares(folder, times)],
    }


def intervals(records: Records, metric: str, name: str) -> list[dict[str, float]]:
    """Average a metric of a developable method over intervals of the input's curvature."""
    good = [r["figures"] for r in records["developable", 0.0, name] if "error" not in r]
    curved = np.array([f["loss_gc_before"] for f in good])
    values = np.array([f[metric] for f in good])
    place = np.clip(np.searchsorted(CURVATURE, curved) - 1, 0, len(CURVATURE) - 2)
    return [
        {"from": a, "to": b, "mean": float(values[place == k].mean()), "count": int(n)}
        for k, (a, b) in enumerate(pairwise(CURVATURE))
        if (n := (place == k).sum())
    ]


def figure_5(folder: Path) -> Figure:
    """Plot loss against parameters of nets of several sizes, from the stored runs."""
    text = "Figure 5: loss of nets supervised on the optimiser's results, against their size"
    stored = json.loads(GRID.read_text())
    rows, command = stored["rows"], stored["command"]
    canvas, axes = _canvas(1)
    for channels in sorted({r["channels"] for r in rows}):
        some = sorted((r for r in rows if r["channels"] == channels), key=lambda r: r["blocks"])
        millions = [r["parameters"] / 1e6 for r in some]
        axes[0].plot(millions, [r["loss"] for r in some], "o-", label=f"{channels}X channels")
        for r, m in zip(some, millions, strict=True):
            axes[0].annotate(f"NB={r['blocks']}", (m, r["loss"]), fontsize=7)
    axes[0].axvline(CHOSEN["parameters"] / 1e6, color="0.7", linewidth=0.8)
    axes[0].set(xlabel="million parameters", ylabel="loss", xscale="log", yscale="log")
    axes[0].legend(fontsize=8)
    text += f"; the line: the paper's choice. Made by {command}"
    return _written(canvas, folder / "figure-5.png", text)


def curves(records: Records) -> dict[str, dict[str, list[dict[str, float]]]]:
    """Return the curves of figure 6, by metric and method."""
    known = [name for name in CURVES if ("developable", 0.0, name) in records]
    return {
        metric: {name: intervals(records, metric, name) for name in known}
        for metric in ("K_A_r_worst", "d_H")
    }


def figure_6(folder: Path, records: Records) -> Figure:
    """Plot curvature removed and distance against intervals of the input's curvature."""
    canvas, axes = _canvas(2)
    for ax, lines in zip(axes, curves(records).values(), strict=True):
        for name, found in lines.items():
            label = f"{name}, {sum(f['count'] for f in found):,} surfaces"
            middle = [(f["from"] + f["to"]) / 2 for f in found]
            ax.plot(middle, [f["mean"] for f in found], "o-", markersize=3, label=label)
    axes[0].set(xlabel="mean |K| of the input", ylabel="K_A-r by the worse split, higher is better")
    axes[1].set(xlabel="mean |K| of the input", ylabel="d_H %, lower is better")
    axes[0].legend(fontsize=8)
    text = "Figure 6: share of curvature removed, and distance, by the curvature of the input"
    return _written(canvas, folder / "figure-6.png", text)


def figure_7(folder: Path, examples: Iterable[Example]) -> Iterator[Figure]:
    """Draw developable surfaces: curvature before and after, and distance."""
    for k, example in enumerate(examples):
        design, meshes = _meshes(example)
        size = metrics.unit(design)
        every = {"input": design, **meshes}
        heats = [
            replace(heat, summary=f"|K| {metrics.loss_gc_worst(mesh, scale=size):.3f}")
            for heat, mesh in zip(curvatures([*every.values()]), every.values(), strict=True)
        ]
        caption = f"Figure 7: surface {example.number}, Gaussian curvature before and after"
        panels = _panels(design, every, heats)
        yield _drawn(panels, folder / f"figure-7-{k}-curvature.png", caption)
        panels = _panels(design, meshes, _shared([distance(design, m) for m in meshes.values()]))
        caption = f"Figure 7: surface {example.number}, distance to the input"
        yield _drawn(panels, folder / f"figure-7-{k}-distance.png", caption)


def figure_8(folder: Path, examples: Iterable[Example]) -> Iterator[Figure]:
    """Draw flat images: the published isometry defect and the strain of every cell."""
    for k, example in enumerate(examples):
        design = Mesh.from_grid(example.case.surface, weld=False)
        flat = {name: p.reshape(-1, 2) for name, p in example.results.items()}
        for kind, heat_of in (("isometry", _defect), ("strain", strain)):
            heats = _shared([heat_of(design, image) for image in flat.values()])
            panels = [
                Panel(_laid(design, x), design.faces, f"{name}\n{h.summary}", h, shaded=False)
                for (name, x), h in zip(flat.items(), heats, strict=True)
            ]
            caption = f"Figure 8: surface {example.number}, {kind} of the cells"
            yield _drawn(panels, folder / f"figure-8-{k}-{kind}.png", caption)


def figure_9(folder: Path, sigma: float, examples: Iterable[Example]) -> Iterator[Figure]:
    """Draw surfaces with noise and denoised: angles of the cells' normals to the clean ones."""
    for example in examples:
        clean, meshes = _meshes(example)
        noisy = View.of(clean).project(example.case.given.reshape(-1, 3))
        heats = _shared([_angles(clean, m) for m in meshes.values()])
        panels = [Panel(noisy, clean.faces, f"sigma {sigma:.3f}", light=GRAZING)]
        caption = f"Figure 9: surface {example.number} with noise {sigma:.3f}, and denoised"
        path = folder / f"figure-9-{sigma:.3f}.png"
        yield _drawn([*panels, *_panels(clean, meshes, heats)], path, caption)


def time_against_size(folder: Path, timings: Sequence[Timing]) -> Figure:
    """Plot seconds against vertices by task, with exponents and the time of factorisations."""
    canvas, axes = _canvas(len(TASKS))
    for ax, task in zip(axes, TASKS, strict=True):
        for name in METHODS:
            some = [t for t in timings if (t.task, t.method) == (task, name) and t.seconds]
            if not some:
                continue
            vertices = [t.size**2 for t in some]
            power = exponent(some)
            label = name if power is None else f"{name}, n^{power:.2f}"
            (line,) = ax.plot(vertices, [t.median for t in some], "o-", markersize=3, label=label)
            limits = [(n, t.limit) for n, t in zip(vertices, some, strict=True) if t.limit]
            if limits:
                ax.plot(*zip(*limits, strict=True), ":", color=line.get_color())
        sizes = sorted({t.size for t in timings})
        ax.set(xscale="log", yscale="log", xlabel="vertices", ylabel="seconds", title=task)
        ax.set_xticks([n**2 for n in sizes], [f"{n}²" for n in sizes])
        ax.minorticks_off()
        ax.legend(fontsize=8)
    text = "Time against size; dotted: one numeric factorisation per iteration, nothing else"
    return _written(canvas, folder / "time.png", text)


def shares(folder: Path, timings: Sequence[Timing]) -> Figure:
    """Plot the share of each phase in the time, by size."""
    some = [t for t in timings if t.shares and t.method != "Net"]
    canvas, axes = _canvas(1, width=max(7.0, 0.45 * len(some)))
    base = np.zeros(len(some))
    for phase in PHASES:
        part = np.array([100.0 * t.shares.get(phase, 0.0) for t in some])
        if part.any():
            axes[0].bar(range(len(some)), part, bottom=base, label=phase)
        base += part
    labels = [f"{t.task} {t.method} {t.size}" for t in some]
    axes[0].set_xticks(range(len(some)), labels, rotation=90, fontsize=7)
    axes[0].set(ylabel="% of the time")
    axes[0].legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return _written(canvas, folder / "shares.png", "Where the time of a solve goes")


def _meshes(example: Example) -> tuple[Mesh, dict[str, Mesh]]:
    """Return the design of an example, and the results by method."""
    design = Mesh.from_grid(example.case.surface, weld=False)
    results = example.results.items()
    return design, {name: design.replaced(points.reshape(-1, 3)) for name, points in results}


def _panels(design: Mesh, meshes: dict[str, Mesh], heats: Iterable[Heat]) -> list[Panel]:
    """Return panels of surfaces, all seen as the design is, with their names and summaries."""
    view = View.of(design)
    return [
        Panel(view.project(mesh.vertices), mesh.faces, f"{name}\n{heat.summary}", heat)
        for (name, mesh), heat in zip(meshes.items(), heats, strict=True)
    ]


def _defect(design: Mesh, flat: Array) -> Heat:
    values = metrics.isometry_defect(design, flat)
    scale = Scale("loss_iso of the cell (size)", "PuRd", 0.0, float(values.max()))
    return Heat(values, scale, f"mean {values.mean():.2g}")


def _angles(clean: Mesh, mesh: Mesh) -> Heat:
    """Return the angle of each cell's normal to the clean surface's, degrees."""
    one, other = (metrics.components(metrics.face_normals(m)) for m in (clean, mesh))
    values = np.degrees(np.asarray(geometry.angle(one, other)))
    scale = Scale("angle of the normals (degrees)", "OrRd", 0.0, float(values.max()))
    return Heat(values, scale, f"{metrics.normal_angle(clean, mesh):.3g} degrees")


def _shared(heats: Sequence[Heat]) -> list[Heat]:
    """Give heat maps one colour scale, which ends at a high percentile of all values."""
    every = np.concatenate([h.values[np.isfinite(h.values)] for h in heats])
    high = max(float(np.percentile(every, _TOP)), 1e-9)
    scale = replace(heats[0].scale, high=high, extend="max" if every.max() > high else "neither")
    return [replace(heat, scale=scale) for heat in heats]


def _laid(design: Mesh, flat: Array) -> Array:
    """Rotate a flat image so that its longer side is horizontal."""
    points = (flat - flat.mean(axis=0)) / design.frame.scale
    _, _, axes = np.linalg.svd(points, full_matrices=False)
    # A rotation, not a reflection.
    axes[1] *= np.sign(np.linalg.det(axes))
    return np.c_[points @ axes.T, np.zeros(len(points))]


def _drawn(panels: list[Panel], path: Path, caption: str) -> Figure:
    figure = draw(panels)
    for ax in figure.axes:
        ax.title.set_fontsize(8)
    return _written(figure, path, caption)


def _canvas(count: int, width: float = 0.0) -> tuple[Any, list[Any]]:
    from matplotlib.figure import Figure as Canvas

    canvas = Canvas(figsize=(width or 4.5 * count, 3.6), dpi=110, layout="constrained")
    return canvas, list(np.atleast_1d(canvas.subplots(1, count)))


def _written(canvas: Any, path: Path, caption: str) -> Figure:
    path.parent.mkdir(parents=True, exist_ok=True)
    canvas.savefig(path, dpi=90)
    return Figure(caption, path)

"""Damaged small designs through the workshop: only the package's own errors come out.

With ``GSO_EXHAUSTIVE=1`` in the environment there are five times as many.
"""

from __future__ import annotations

import numpy as np
import pytest

import gso
from gso import GSOError
from gso.workshop import Finish, Thickness
from tests.conftest import EXHAUSTIVE

#: Numbers of the slow test's designs, and of the fast one's; every so many is made of strips.
FULL, SAMPLE, STRIPS = range(0, 300, 1 if EXHAUSTIVE else 5), range(1, 13), 50


def sheet(kind, rng):
    """Return the vertices and faces of a small design by formula."""
    rows, columns = rng.integers(2, 5, 2)
    x, y = np.meshgrid(np.arange(columns + 1.0), np.arange(rows + 1.0))
    z = {
        "plane": 0 * x,
        "saddle": 0.1 * (x - 1) * (y - 1),
        "fold": np.abs(x - 1),
        "tube": 0 * x,
        "cone": y,
    }[kind]
    if kind in ("tube", "cone"):
        turn = 0.9 * 2 * np.pi * x / columns
        size = 2.0 + (0.4 * y if kind == "cone" else 0)
        x, y, z = size * np.cos(turn), size * np.sin(turn), y
    points = 20.0 * np.stack([x, y, z], axis=-1).reshape(-1, 3)
    k = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    faces = np.stack([k, k + 1, k + columns + 2, k + columns + 1], axis=1)
    return points, faces


def damaged(points, faces, rng):
    """Return a design with one to three faults."""
    points, faces = points.copy(), [list(face) for face in faces]
    for _ in range(rng.integers(1, 4)):
        k, face = rng.integers(len(points)), rng.integers(len(faces))
        match rng.integers(9):
            case 0:
                points[k] += rng.normal(0, 10.0 ** rng.integers(-9, 2), 3)
            case 1:
                points[k] = points[rng.integers(len(points))]
            case 2 if len(faces) > 1:
                del faces[face]
            case 3:
                faces[face] = faces[face][::-1]
            case 4:
                points = points * 10.0 ** rng.integers(-3, 2, 3)
            case 5:
                points = points + rng.normal(0, 10.0 ** rng.integers(-6, 1), points.shape)
            case 6:
                # A corner moves towards the middle of its face: the face is concave.
                own = points[faces[face]]
                points[faces[face][0]] += 1.3 * (own.mean(axis=0) - own[0])
            case 7:
                faces[face] = faces[face][:3]
            case 8:
                points = np.r_[points, points[k : k + 1]]
                faces[face] = [len(points) - 1 if v == k else v for v in faces[face]]
    table = np.array([face + [-1] * (4 - len(face)) for face in faces])
    return points, table


def finish(rng):
    """Return a finish with some of its options."""
    tabs = 10.0 ** rng.uniform(-1, 1) if rng.random() < 0.4 else None
    sheet = None
    if rng.random() < 0.3:
        sheet = Thickness(10.0 ** rng.uniform(-1, 1), 0.44, "outside")
    return Finish(
        kerf=10.0 ** rng.uniform(-2, 0.5) if rng.random() < 0.4 else 0.0,
        allowance=10.0 ** rng.uniform(-1, 1.3) if tabs is None and rng.random() < 0.4 else 0.0,
        notches=None if rng.random() < 0.4 else 10.0,
        registration=(3.0, 10.0 ** rng.uniform(0, 1)) if rng.random() < 0.3 else None,
        tabs=tabs,
        face=str(rng.choice(["outside", "inside"])),
        thickness=sheet,
    )


def attempt(number, folder):
    """Fabricate one damaged design; return whether it was made, refused, or not read."""
    rng = np.random.default_rng([55, number])
    given = sheet(str(rng.choice(["plane", "saddle", "fold", "tube", "cone"])), rng)
    design = damaged(*given, rng)
    strips = number % STRIPS == 0
    try:
        job = gso.fabricate(
            design,
            folder / str(number),
            formulation="ruled" if strips else "flatten",
            max_strain="5%",
            darts=bool(rng.integers(2)),
            finish=finish(rng),
            formats=("svg",),
            workers=0,
        )
    except GSOError as error:
        assert len(str(error)) > 10
        return "refused"
    for part in job.parts:
        assert np.isfinite(part.outline).all() and np.isfinite(part.area)
    return "usable" if job.usable else "not usable"


def counted(numbers, folder):
    made = [attempt(number, folder) for number in numbers]
    return {kind: made.count(kind) for kind in ("usable", "not usable", "refused")}


@pytest.mark.filterwarnings("ignore")
def test_a_sample_of_damaged_designs_ends_in_parts_or_own_errors(tmp_path):
    found = counted(SAMPLE, tmp_path)
    assert min(found["usable"], found["not usable"] + found["refused"]) >= 1


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_damaged_designs_end_in_parts_or_own_errors(tmp_path):
    found = counted(FULL, tmp_path)
    assert min(found.values()) > len(FULL) // 30

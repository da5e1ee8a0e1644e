"""Processes that stay for several rounds of work."""

from __future__ import annotations

import os

import numpy as np
import pytest

from gso.mesh import Mesh
from gso.parallel import helpers, here
from gso.pipeline.lay_flat import strains_of
from tests.conftest import sphere_cap


def square(x):
    if x < 0:
        raise ValueError(f"{x} is negative")
    return x * x, os.getpid()


@pytest.mark.parametrize("workers", [0, 1, 2])
def test_results_are_in_order(workers):
    with helpers(workers) as each:
        for _ in range(2):
            assert [y for y, _ in each(square, range(9))] == [x * x for x in range(9)]
        assert each(square, []) == []


def test_two_processes_share_the_work():
    with helpers(2) as each:
        assert len({pid for _, pid in each(square, range(6))}) == 2


def test_errors_are_raised():
    with helpers(2) as each, pytest.raises(ValueError, match="-1 is negative"):
        each(square, [1, -1])


def leave(x):
    if os.getpid() != x:
        os._exit(1)
    return x


def test_the_work_of_a_process_that_dies_is_repeated_here():
    with helpers(2) as each:
        own = os.getpid()
        assert each(leave, [own, own, own]) == [own] * 3
        assert each(square, [3])[0][0] == 9


def test_strains_of_many_components_do_not_depend_on_processes():
    cap = Mesh.from_grid(sphere_cap(24, radius=1.0))
    faces = cap.triangles
    count = 5
    points = np.concatenate([cap.vertices * [1, 1, 1 + 0.1 * k] for k in range(count)])
    points[:, 0] += np.repeat(3.0 * np.arange(count), len(cap.vertices))
    many = Mesh(points, np.concatenate([faces + k * len(cap.vertices) for k in range(count)]))
    alone = strains_of(many, here)
    with helpers(2) as each:
        assert strains_of(many, each) == alone
    one = [strains_of(Mesh(points[k * 576 : (k + 1) * 576], faces)) for k in range(count)]
    assert alone["strain_max"] == pytest.approx(max(s["strain_max"] for s in one), rel=0.05)

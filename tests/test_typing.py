"""The public interface has types: a user's file passes ``mypy --strict``."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.slow
def test_a_file_of_a_user_passes_mypy_strict():
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent"]
    done = subprocess.run(
        [*command, "tests/typed_use.py"], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout


def test_the_file_runs(tmp_path):
    from tests import typed_use

    assert 0.0 <= typed_use.main(tmp_path) < 0.05
    assert (tmp_path / "strips.svg").exists()

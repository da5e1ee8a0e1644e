"""The public interface has types: a user's file passes ``mypy --strict``, as the package does."""

from __future__ import annotations

from configparser import ConfigParser
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def test_the_configuration_of_mypy_includes_the_file_of_a_user():
    config = ConfigParser()
    config.read(ROOT / "setup.cfg")
    checked = config["mypy"]
    assert "tests/typed_use.py" in checked["files"].split(", ") and checked["strict"] == "True"


def test_the_file_runs(tmp_path):
    from tests import typed_use

    assert 0.0 <= typed_use.main(tmp_path) < 0.05
    assert (tmp_path / "strips.svg").exists()

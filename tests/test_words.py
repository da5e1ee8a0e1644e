"""Options that several commands or functions share have one name, unit, default and spelling."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import click
import numpy as np
import pytest

import gso
from gso import OptionError
from gso.cli import main
from gso.tasks import check

#: Units of length, in millimetres.
MILLIMETRES = {
    "um": 1e-3, "mm": 1.0, "cm": 10.0, "dm": 100.0, "m": 1000.0, "in": 25.4, "ft": 304.8,
    "yd": 914.4,
}  # fmt: skip
COMMANDS = dict(main.commands)
FUNCTIONS = {
    "optimize": gso.tno.optimize,
    "strips": gso.strips,
    "pieces": gso.pieces,
    "fabricate": gso.fabricate,
    "unfold": gso.unfold,
}
TERMS = (Path(__file__).parents[1] / "docs" / "terms.rst").read_text()
#: Options that mean the same wherever they are, by the names of Python.
SHARED = ("max_deviation", "max_strain", "min_radius", "max_strips", "darts", "sheet", "unit")


def options(name):
    """The options of a name in all commands and groups of commands."""
    found = {}
    for command, made in COMMANDS.items():
        for part in getattr(made, "commands", {command: made}).values():
            for param in part.params:
                if param.name == name:
                    found[command] = param
    return found


@pytest.mark.parametrize("name", [*SHARED, "workers", "scheduler", "keep_groups", "quiet"])
def test_commands_agree(name):
    first, *others = options(name).values()
    for other in others:
        assert other.opts == first.opts
        assert type(other.type) is type(first.type)
        assert (other.default, other.nargs) == (first.default, first.nargs)
        assert (other.metavar, other.help) == (first.metavar, first.help)


@pytest.mark.parametrize("name", SHARED)
def test_functions_agree_with_each_other_and_with_the_page_of_terms(name):
    assert f"``{name}``" in TERMS
    defaults = {
        key: function.__kwdefaults__[name]
        for key, function in FUNCTIONS.items()
        if name in (function.__kwdefaults__ or {})
    }
    assert len(set(map(repr, defaults.values()))) <= 1, defaults
    kinds = {inspect.signature(FUNCTIONS[key]).parameters[name].annotation for key in defaults}
    assert len(kinds) <= 1, kinds


@pytest.mark.parametrize("command", ["optimize", "strips", "pieces", "fabricate", "unfold"])
def test_options_of_a_command_have_the_defaults_of_its_function(command):
    given = FUNCTIONS[command].__kwdefaults__
    for param in COMMANDS[command].params:
        if param.name in SHARED and param.name in given:
            default = param.get_default(click.Context(COMMANDS[command]))
            # Click has a value of its own for options without a default.
            plain = isinstance(default, bool | int | float | str)
            assert (default if plain else None) == given[param.name], param.name


def length(given, diagonal=1.0, unit="mm"):
    request = check("developable", max_deviation=given, diagonal=diagonal, unit=unit)
    return request.limits.max_deviation


def test_every_spelling_of_a_length_is_one_length():
    for text in ("5", " 5.0 ", "5mm", "5 mm", "0.5cm", "5e-3m", 5, np.float64(5.0), "2.5%"):
        assert length(text, diagonal=200.0) == pytest.approx(5.0)
    for unit, size in MILLIMETRES.items():
        assert length(f"3{unit}", unit="m") == pytest.approx(3e-3 * size)
        assert length("3", unit=unit) == 3.0
    for option in options("unit").values():
        assert set(option.type.choices) == set(MILLIMETRES)


def test_every_spelling_of_a_strain_is_one_strain():
    for text in ("0.01", "1%", " 1 %", 0.01, np.float32(0.01)):
        assert check("developable", max_strain=text).limits.max_strain == pytest.approx(0.01)


@pytest.mark.parametrize("bad", ["", "-1", "0", "5 miles", "nan", "inf", True, [1], "1%%"])
def test_what_is_no_quantity_is_named(bad):
    with pytest.raises(OptionError, match=re.escape("max_deviation")):
        check("developable", max_deviation=bad)
    with pytest.raises(OptionError, match="max_strain"):
        check("developable", max_strain=bad)
    with pytest.raises(OptionError, match="max_strain"):
        check("developable", max_strain="5mm")

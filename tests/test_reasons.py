"""Reasons: codes, comparisons with limits, words, records."""

from __future__ import annotations

import ast
import json
import string
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gso import verdict
from gso.verdict import (
    TIGHT,
    Code,
    Kind,
    Measurement,
    Places,
    Reason,
    describe,
    failure,
    merge,
    ordered,
)
from tests.conftest import codes

ROOT = Path(__file__).resolve().parents[1]
MEASURED = [code for code in Code if code.info.kind is not Kind.NONE]


@pytest.mark.parametrize("code", Code)
def test_every_code_has_a_meaning_words_and_a_remedy(code):
    info = code.info
    assert code == code.value == code.name.lower()
    assert info.meaning.endswith(".") and info.remedy and not info.remedy.endswith(".")
    used = {name for _, name, _, _ in string.Formatter().parse(info.sentence) if name}
    assert used <= ({"detail"} if info.kind is Kind.NONE else {"value", "bound"})
    # What is compared with a limit that a user gives says both.
    if info.kind is not Kind.NONE and info.limit is None and code is not Code.NOTHING_DONE:
        assert used == {"value", "bound"}


def test_only_the_verdict_makes_reasons():
    makers = set()
    for path in (ROOT / "gso").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] == "Reason":
                makers.add(path.parent.name)
    assert makers == {"verdict"}


@pytest.mark.parametrize("code", MEASURED)
@given(bound=st.floats(1e-3, 1e3), excess=st.sampled_from([-0.5, -1e-3, 1e-3, 0.5]))
def test_values_are_compared_with_one_tolerance(code, bound, excess):
    edge = bound * (1.0 + (-1 if code.info.least else 1) * code.info.tolerance)
    value = edge * (1.0 + (-1 if code.info.least else 1) * excess)
    found = verdict.compare({code: value}, {code: bound})
    assert bool(found) == (excess > 0)
    if found:
        assert (found[0].code, found[0].value, found[0].bound) == (code, value, bound)


def test_a_bound_itself_is_kept_and_not_a_number_is_not():
    assert not verdict.compare(
        dict.fromkeys((Code.NECK, Code.STRAIN), 2.0), dict.fromkeys(Code, 2.0)
    )
    assert not verdict.compare({Code.STRAIN: 2.0 * (1.0 + 0.9 * TIGHT)}, {Code.STRAIN: 2.0})
    assert codes(verdict.compare({Code.STRAIN: np.nan}, {Code.STRAIN: 2.0})) == [Code.STRAIN]
    slack = Measurement(1.001, slack=0.01)
    assert not verdict.compare({Code.DEVIATION: slack}, {Code.DEVIATION: 1.0})


def test_without_a_limit_that_of_the_code_counts():
    measured = {Code.FOLDED: Measurement.count("face", np.array([7, 9])), Code.STRAIN: 0.5}
    (why,) = verdict.compare(measured, {Code.STRAIN: None})
    assert why == Reason(Code.FOLDED, 2.0, 0.0, Places("face", (7, 9)))
    assert not verdict.compare({Code.FOLDED: Measurement.count("face", [])}, {})


def test_the_worst_place_comes_first_each_with_its_own_bound():
    found = Measurement(np.array([1.0, 5.0, 3.0, 9.0]), "part", ("a", "b", "c", "d"))
    (why,) = verdict.compare({Code.SEAM_SIDES: found}, {Code.SEAM_SIDES: [2.0, 2.0, 2.0, 8.5]})
    assert (why.value, why.bound, why.places.ids) == (5.0, 2.0, ("b", "c", "d"))
    assert not verdict.compare({Code.NECK: Measurement(np.empty(0), "piece")}, {Code.NECK: 1.0})


def test_the_most_severe_comes_first():
    given = dict.fromkeys(reversed(MEASURED), 5.0)
    limits = {code: 9.0 if code.info.least else 1.0 for code in MEASURED}
    reasons = verdict.compare(given, limits)
    assert codes(reasons) == MEASURED
    assert ordered(reversed(reasons)) == reasons
    assert MEASURED.index(Code.FOLDED) < MEASURED.index(Code.STRAIN) < MEASURED.index(Code.PIECES)


def test_a_later_measurement_decides_what_it_is_told_to():
    solve = verdict.compare({Code.DEVIATION: 3.0, Code.STRAIN: 0.2}, dict.fromkeys(Code, 0.1))
    later = verdict.compare({Code.STRAIN: 0.3, Code.TOO_LONG: 4.0}, dict.fromkeys(Code, 0.1))
    merged = merge(solve, later, decided=(Code.DEVIATION,))
    assert [(r.code, r.value) for r in merged] == [(Code.STRAIN, 0.2), (Code.TOO_LONG, 4.0)]
    assert merge(solve, later) == (solve[0], *merged)


def test_lengths_change_with_the_unit_and_nothing_else_does():
    for code in MEASURED:
        why = Reason(code, 0.3, 0.2)
        factor = 1000.0 if code.info.kind is Kind.LENGTH else 1.0
        assert (why.scaled(1000.0).value, why.scaled(1000.0).bound) == (0.3 * factor, 0.2 * factor)
    assert failure(Code.FAILED, "so").scaled(10.0) == failure(Code.FAILED, "so")


@pytest.mark.parametrize("code", Code)
def test_records_are_json_and_come_back(code):
    why = Reason(code, 0.3, 0.2, Places("edge", ("3-4", "5-6")), "component 1", "because")
    said = json.loads(json.dumps(why.record("mm")))
    assert Reason.read(said) == why and said["text"] == describe(why, "mm")
    assert Reason.read(replace(why, value=np.inf).record()).value is None


def test_words():
    bound = {Code.DEVIATION: 0.49, Code.STRAIN: 0.01}
    deviation, strain = verdict.compare({Code.DEVIATION: 0.5, Code.STRAIN: 0.0123}, bound)
    assert str(deviation).startswith("the result is 0.500 away from the design, more than 0.490; ")
    assert describe(deviation, "mm").startswith("the result is 0.500 mm away")
    assert str(strain).startswith("the largest strain of the pattern is 1.23 %, more than 1.00 %; ")
    near = Reason(Code.DEVIATION, 1.00002, 1.00001)
    assert "1.00002 away from the design, more than 1.00001" in str(near)
    folded = Reason(Code.FOLDED, 9.0, 0.0, Places("face", tuple(range(9))))
    assert "onto itself at faces 0, 1, 2, 3, 4, 5 and 3 more; " in str(folded)
    neck = Reason(Code.NECK, 0.1, 0.2, Places("piece", ("A",))).within("dome")
    assert str(neck).startswith("dome: necks are 0.100 wide, less than 0.200: piece A; allow ")
    assert str(neck.within("job")).startswith("job: dome: ")
    assert str(failure(Code.FAILED, "no such file")) == "no such file"
    assert "bends of up to 90 degrees" in str(Reason(Code.BEND_ANGLE, 90.0, 45.0))
    assert "there are 7 pieces, more than 5; " in str(Reason(Code.PIECES, 7.0, 5.0))

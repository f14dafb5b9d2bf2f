"""Every statement of the loop has its sentence, and a sentence is nothing that a fit depends on."""

import ast
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from worded import in_words

from metro.codehash import imported_modules
from metro.loop.statement import Statement, to_json
from metro.wording.statements import SENTENCES, worded

PACKAGE = Path(__file__).parents[2] / "src/metro"


def stated():
    """Return the codes of all statements that the code of the loop can make."""
    calls = [
        node
        for path in PACKAGE.glob("loop/**/*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Statement"
    ]
    codes = [code for call in calls for code in ast.walk(call.args[0]) if isinstance(code, ast.Constant)]
    assert len(codes) >= len(calls) > 40
    return {code.value for code in codes}


def rooms_of(stage):
    """Return the rooms of which a stage uses modules; "" for the package itself."""
    return {name.partition(".")[2].partition(".")[0] for name in imported_modules(f"metro.stages.{stage}")}


def test_every_statement_has_a_sentence_and_every_sentence_is_stated():
    assert stated() == set(SENTENCES)


def test_statements_are_put_into_words_wherever_they_are_the_inner_ones_first():
    inner = Statement("no_prediction", {"run": "r1", "why": "it breaks"})
    content = {"a": [Statement("unseen", {"places": inner})], "b": {"code": 1}, "c": None}
    outer = "only in conditions that were left out of the fit: in r1 it breaks"
    assert in_words(content) == {"a": [outer], "b": {"code": 1}, "c": None}


@pytest.mark.parametrize(
    ("gain", "words"), [(-np.inf, "gain -inf, 3 needed"), (np.float64(1.26), "gain 1.3, 3 needed")]
)
def test_a_number_that_is_not_finite_comes_through_json(gain, words):
    content = json.loads(
        json.dumps(to_json(Statement("no_gain", {"gain": gain, "needed": 3.0})), allow_nan=False)
    )
    assert words in worded(content)


@pytest.mark.parametrize(
    ("step", "words"),
    [
        (3.14159, "next step: 3.1 standard"),
        (234.5, "next step: 234 standard"),
        (np.inf, "next step: inf standard"),
    ],
)
def test_a_step_is_written_to_its_digits(step, words):
    assert words in in_words(Statement("not_converged", {"step": step}))


def test_no_more_places_are_named_than_can_be_read():
    places = [{"axis": "x", "label": f"order {i}", "relative": 0.1 / i} for i in range(1, 8)]
    words = in_words(Statement("places", {"places": places}))
    assert words.startswith("order 1 in x (10 % of the signal there); order 2")
    assert words.endswith("order 4 in x (2.5 % of the signal there) and 3 more places")
    assert "more" not in in_words(Statement("places", {"places": places[:4]}))


@pytest.mark.parametrize("stage", ["identify", "predict", "loop"])
def test_what_fits_does_not_depend_on_a_sentence(stage):
    assert "wording" not in rooms_of(stage)


@pytest.mark.parametrize("stage", ["identify", "predict"])
def test_the_base_models_do_not_depend_on_the_search(stage):
    used = imported_modules(f"metro.stages.{stage}")
    assert {name.split(".")[2] for name in used if name.startswith("metro.loop.")} == {"fitting"}


def test_the_stage_that_words_the_findings_fits_nothing():
    files = {"", "batch", "formats", "joint_columns", "stages", "units"}
    closed_forms = {"decisions", "cutting", "signals", "compiled"}  # torque of an arc, waveform of orders
    assert rooms_of("verdict") <= {*files, *closed_forms, "wording"}


def test_the_wording_uses_no_package_but_the_standard_library():
    nodes = [n for path in PACKAGE.glob("wording/*.py") for n in ast.walk(ast.parse(path.read_text()))]
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    names |= {str(node.module) for node in nodes if isinstance(node, ast.ImportFrom)}
    assert {name.partition(".")[0] for name in names} <= {"metro", *sys.stdlib_module_names}


@pytest.mark.parametrize(
    ("least", "unit", "words"),
    [
        (7.13e10, "N m/rad3", "from a size of 7.1·10¹⁰ N m/rad³ on"),
        (2.4e-6, "N m", "from a size of 2.4·10⁻⁶ N m on"),
        (152.0, "ms", "from a size of 150 ms on"),
        (0.034, "1", "from a size of 0.034 on"),
    ],
)
def test_the_least_size_that_shows_is_written_as_in_print(least, unit, words):
    content = {"share": 0.02, "least": least, "unit": unit}
    assert in_words(Statement("hidden_by_zeros", content)).endswith(words)

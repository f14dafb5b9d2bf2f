"""From a residual to a draft, from the draft to an effect that the next batch is explained with."""

import importlib
import sys

import pytest

from metro.batch.processed import Processed, read_batch
from metro.discovery.draft import files
from metro.discovery.example import Workshop, rows_of
from metro.discovery.record import record
from metro.discovery.search import searched
from metro.discovery.words import in_words
from metro.effects.library import library
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise
from metro.loop.search.search import search
from metro.loop.search.trial import Gates
from metro.loop.statement import to_json
from metro.observables.force import observable as force
from metro.stages.ingest import ingest
from metro.wording.statements import worded
from virtual_cell.recipes.force import make

GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)
EXPONENT = -0.25  # that the simulator is given, with the other sign


def problem_of(folder, hidden, seed):
    """A simulated batch with several spindle speeds, as the loop has it."""
    make(folder / "shop", hidden, seed, "b")
    ingest(folder / "shop", folder, folder / "out", {}, "test")
    batch = read_batch(folder / "out")
    return force.problem(batch, force.observe(batch, Processed(folder / "out"), {}), {})


def base_of(problem):
    blocks = problem.role("identify", "calibrate")
    return fit(Candidate(problem.base), blocks, first_noise(0.007, problem.scatter, blocks))


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    problem = problem_of(tmp_path_factory.mktemp("found"), {"speed_dependence": {"exponent": -EXPONENT}}, 3)
    return problem, searched(problem, base_of(problem), [], GATES)


@pytest.fixture(scope="module")
def drafted(found, tmp_path_factory):
    """The folder of the draft, with what pip writes beside it."""
    problem, outcome = found
    said = worded(to_json(record(outcome, problem)))
    cutter = problem.base.cutter
    shop = Workshop(
        cutter.radius,
        cutter.helix,
        cutter.tooth_angles,
        tuple(outcome.current.beta[:6].tolist()),
        rows_of(problem.role("identify")),
    )
    folder = tmp_path_factory.mktemp("draft")
    for name, text in files("shop", "1", outcome.proposal.entry, said, shop).items():
        (folder / name).write_text(text, encoding="utf-8")
    name = outcome.proposal.entry.name
    info = folder / f"{name}-0.1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 0.1\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(f"[metro.effects]\n{name} = {name}:EFFECT\n", encoding="utf-8")
    return folder, name


@pytest.fixture
def installed(drafted, monkeypatch):
    folder, name = drafted
    monkeypatch.syspath_prepend(folder)
    yield name
    for module in (name, f"test_{name}"):
        sys.modules.pop(module, None)


def test_the_variable_the_form_and_the_size_are_those_that_were_hidden(found):
    _, outcome = found
    chosen = outcome.proposal
    assert chosen.entry.variables == ("speed",)
    assert chosen.entry.form == "power"
    assert abs(chosen.trial.fit.theta[-1] - EXPONENT) < 0.05


def test_it_is_said_with_its_formula_its_interval_and_the_runs_that_would_test_it(found):
    problem, outcome = found
    said = {"status": "searched", "verdict": "unexplained", **worded(to_json(record(outcome, problem)))}
    text = "\n".join(in_words("shop", said))
    assert "Proposed: shear force by speed." in text
    assert "rev/min)^exponent" in text
    low, high = said["terms"][0]["parameters"]["exponent"]["ci95"]
    assert low < EXPONENT < high
    assert "To test it, measure" in text


def test_the_tests_of_the_draft_pass_and_fail_where_the_draft_is_wrong(installed):
    tests = importlib.import_module(f"test_{installed}")
    tests.test_it_is_found_with_its_size_in_runs_that_have_it()
    tests.test_it_is_not_found_in_runs_that_lack_it()
    tests.VALUES = {name: -value for name, value in tests.VALUES.items()}
    right = tests.estimated
    tests.estimated = lambda effect, shop, values, seed: right(
        effect, shop, values and {name: -value for name, value in values.items()}, seed
    )
    with pytest.raises(AssertionError):
        tests.test_it_is_found_with_its_size_in_runs_that_have_it()


@pytest.mark.slow
def test_the_next_batch_is_explained_with_it(installed, tmp_path):
    assert installed in {effect.name for effect in library("force")}
    problem = problem_of(tmp_path, {"speed_dependence": {"exponent": -EXPONENT}}, 7)
    near = {installed, "chip_size_effect", "tool_wear", "tool_runout"}
    outcome = search(problem, tuple(one for one in library("force") if one.name in near), GATES)
    assert outcome.names == (installed,)
    assert abs(outcome.final.theta[0] - EXPONENT) < 0.05


def test_where_nothing_is_hidden_nothing_is_proposed(tmp_path):
    problem = problem_of(tmp_path, {}, 3)
    assert searched(problem, base_of(problem), [], GATES).proposal is None


def test_without_the_draft_its_effect_is_not_there():
    assert "shear_force_by_speed" not in {effect.name for effect in library()}

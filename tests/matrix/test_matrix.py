"""Whatever part of a batch there is ends with a report, or with a refusal that the check has foretold."""

import shutil

import matrix_batches
import matrix_cases
import matrix_outcome
import matrix_run
import pytest

from metro.batch.check import check

# A few cases of each kind, of batches that take little time; ``python tests/matrix`` has them all.
FEW = {
    "clean-slot": [
        "batch.yaml without tool.helix_deg",
        "runs.csv without spindle_rpm",
        "only run 1",
    ],
    "irb6640-face": ["no scan/r01.ply"],
    "irb6640-setup": [
        *("a load test of the wrong sign", "every load test of the wrong sign"),
        *("only loads.csv", "only touches.csv", "only payload.csv", "only mass.csv"),
    ],
    "irb6640-published": ["no published.csv", "published.csv without axis"],
    "kr160-published": ["published.csv with one row"],
    "kr160-side": ["runs.csv without axial_depth_mm", "only loads.csv"],
    "made-grid": ["as it is"],
    "made-hits-no-driving-point": ["as it is"],
    "made-scans-alone": ["batch.yaml without work"],
    "made-slopes-alone": ["as it is"],
    "trimule-helical": ["only impacts.csv"],
    "trimule-published": ["runs.csv without operation"],
}


@pytest.fixture(scope="module")
def batches(tmp_path_factory):
    place = tmp_path_factory.mktemp("matrix")
    return {source.name: source.folder for source in matrix_batches.sources(place, FEW)}


@pytest.mark.parametrize("batch", FEW)
def test_a_part_of_a_batch_ends_as_the_check_says(batch, batches, tmp_path):
    known = {case.name: case for case in matrix_run.cases(batches[batch], 0)}
    wrong = []
    for name in FEW[batch]:
        copy = tmp_path / name.replace("/", "-").replace(" ", "-") / batch
        shutil.copytree(batches[batch], copy)
        known[name].edit(copy)
        ended = matrix_outcome.outcome(copy, tmp_path / "out", {})
        wrong += [f"{name}: {ended.wrong}"] if ended.wrong else []
    assert wrong == []


def test_no_small_copy_of_a_batch_lacks_what_makes_it_sound(tmp_path):
    said = {
        source.name: [str(problem) for problem in check(source.folder, matrix_outcome.CELLS).problems]
        for source in matrix_batches.sources(tmp_path)
        if not check(source.folder, matrix_outcome.CELLS).ok
    }
    assert said == {}


@pytest.mark.slow
def test_every_part_of_every_batch_ends_as_the_check_says(tmp_path):
    results = list(matrix_run.run(tmp_path))
    wrong = [f"{one.batch}: {one.case.name}: {one.outcome.wrong}" for one in results if one.outcome.wrong]
    assert wrong == [], matrix_run.table(results)


def test_a_traceback_and_a_word_of_a_program_are_wrong_outcomes():
    crashed = matrix_outcome.Outcome("passed", "crashed", ("stages/loop.py:1: KeyError",))
    assert "KeyError" in crashed.wrong
    assert matrix_outcome.Outcome("passed", "refused", ("no",)).wrong.startswith(
        "check passed, pipeline refused"
    )
    said = ["cannot convert float NaN to integer", "the finance of a nanometre", "None of the usual mistakes"]
    odd = matrix_outcome.odd_in(said)
    assert odd == ("cannot convert float NaN to integer",)
    assert matrix_outcome.Outcome("passed", "PDF").wrong == ""
    assert matrix_cases.ODD_NAMES
